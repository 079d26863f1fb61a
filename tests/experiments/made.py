"""Records of runs that never were."""

from jmorl.experiments.record import GenerationRecord, PolicyRecord, QuestionRecord, RunRecord

CAR = "mo-mountaincarcontinuous-v0"
ITERATION = 24_000  # steps, at the paper's sizes on MountainCar


def record(
    generations,
    sigma=None,
    chosen=0,
    questions=(),
    raw=None,
    discounted=None,
    candidates=3,
    env=CAR,
    parents=None,
    fault=None,
    **config,
):
    """A run whose generations are lists of new policies' values; all stay in archive and buffer that no other beats.

    `sigma`: of each generation, in paper units. `raw`: every policy's returns by id, by default its values;
    `discounted` likewise, by default not known. `parents`: id -> (parent, predicted values).
    """
    policies, made, known = [], [], []
    for number, born in enumerate(generations):
        for values in born:
            parent, predicted = (parents or {}).get(len(policies), (None, None))
            returns = raw[len(policies)] if raw else values
            worth = tuple(discounted[len(policies)]) if discounted else None
            policies.append(PolicyRecord(number, parent, (0.5, 0.5), tuple(values), predicted, tuple(returns), worth))
        known = [index for index, policy in enumerate(policies) if not beaten(policy.values, policies)]
        made.append(
            GenerationRecord(
                steps=10 * ITERATION * (number + 1),
                select_seconds=0.5,
                train_seconds=3.0,
                evaluate_seconds=0.5,
                candidates=candidates if number else 0,
                bounds=(None, None),
                sigma=tuple(sigma[number]) if sigma else (None, None),
                front=tuple(known),
                buffer=tuple(range(len(policies))),
            )
        )
    settings = {
        "env": env,
        "steps": 10 * ITERATION * len(generations) + ITERATION,
        "checkpoints": {"keep": 2},
        **config,
    }
    asked = tuple(QuestionRecord(generation, 5, policy) for generation, policy in questions)
    return RunRecord(
        digest="0" * 16,
        config=settings,
        objectives=("time", "fuel"),
        commit="c",
        device="2 x cpu",
        reason="budget",
        chosen=chosen,
        generations=tuple(made),
        questions=asked,
        policies=tuple(policies),
        fault=fault,
    )


def beaten(values, policies):
    return any(
        all(o >= v for o, v in zip(other.values, values, strict=True)) and other.values != values for other in policies
    )

"""What the page of a run says: sentences made of what there is to see. Words that never change are in `words`."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from envs.core import Objective
from jmorl.display import questions
from jmorl.display.commands import command
from jmorl.display.readings import Writer, bounds_in_words, values_in_words, writers_for
from jmorl.display.text import duration, minus, plural, short_count
from jmorl.report.timeline import Timeline
from jmorl.search.bounds import within
from jmorl.search.policy import Policy
from jmorl.storage.notes_file import LONGEST_NAME
from jmorl.studio import words
from jmorl.studio.between import EPISODES, BlendScore
from jmorl.studio.home import printable
from jmorl.studio.selection import LETTERS, Selection, last_choice, reaching, wanted
from jmorl.studio.view import PERSON, View

SHORT = 18  # characters of a name, in the line of the question
SURELY = 3  # standard errors that a score must lie behind another to be called worse


def phase(view: View, now: float, leaving: bool = False) -> str:
    """Say what is going on."""
    timeline = view.timeline
    if view.problem:
        return "Stopped"
    if view.result:
        return f"Finished: {view.reason}"
    if timeline is None:
        after = f" after round {view.generations[-1].number}" if view.generations else ""
        return f"Paused{after}"
    if leaving:
        return "Pausing after this round"
    if view.question:
        number = view.questions
        return "Waiting for your answer" + (f": question {number[0]} of at most {number[1]}" if number else "")
    elapsed = duration(now - timeline.since)
    match timeline.phase:
        case "compiling":
            return f"Compiling the programs, {elapsed}"
        case "warm-up":
            left = timeline.seconds_of_warmup(now)
            more = "" if left is None else f", about {duration(left)} left"
            return f"Warm-up: training {plural(view.config.population.agents, 'new agent')}, {elapsed}{more}"
        case "generation":
            return f"Training round {timeline.generation}"
        case "blending":
            return f"Blending the front, {elapsed}"
    return "Thinking"


def title(view: View, watching: bool = False) -> str:
    """Name the browser's tab after the run, and say there that a question waits, to somebody who can answer it."""
    return f"{'Your turn: ' if view.question and not watching else ''}{printable(view.path.name)} – jmorl studio"


def facts(view: View, now: float) -> str:
    """Say how far the run is, and how fast; nothing for a run that does not go on."""
    timeline = view.timeline
    if timeline is None:
        return ""
    done = [f"round {_generation(timeline)} of {timeline.generations}"]
    done.append(f"{short_count(timeline.steps(now))} of {short_count(timeline.total_steps)} steps")
    if timeline.finished:
        done.append(f"{short_count(timeline.finished.steps_per_second)} steps/s")
    seconds = timeline.seconds_to_question(now)
    if seconds is not None and not view.question:
        done.append(f"next question in {duration(seconds)}")
    return "  ·  ".join(done)


def share_done(view: View, now: float) -> float:
    """Return the share of the budget of steps that is used, from 0 to 1."""
    timeline = view.timeline
    return timeline.steps(now) / timeline.total_steps if timeline else float(view.result is not None)


def heading(view: View, selection: Selection) -> str:
    """Say what is asked, or what there is to see."""
    question, more = view.question, wanted(view, selection)
    if more is not None and selection.more_of is not None and selection.than is not None:
        label = view.objectives[selection.more_of].label
        return f"{plural(len(more), 'policy')} better in {label} than {policy_name(view, selection.than, SHORT)}"
    if question:
        purpose, generation, form, again = question.purpose, question.generation, question.form, question.again
        asked = questions.front_question(purpose, generation, len(question.front), form, again)
        if view.timeline is not None and view.timeline.left == 1 and purpose == "steer":
            asked = f"{asked} {words.LAST_ROUND}"
        return asked if reaching(view, selection).any() else f"{asked} {words.NONE_REACHES}"
    if view.result:
        values = minus(values_in_words(view.result.values, writers_of(view)))
        return f"The result is {policy_name(view, view.result.id, SHORT)}: {values}"
    if view.problem:
        then = words.GOING_ON_FAILS if view.for_good else words.PUT_RIGHT
        return f"Training has stopped: {view.problem.rstrip('.')}. {words.KEPT} {then}"
    if view.timeline is None:
        return "Look around, step back in the history, or go on with this run."
    if not view.generations:
        return words.EARLY if view.early else words.WARM_UP
    if view.config.user != PERSON:
        return f"User {view.config.user} decides; you watch."
    if view.rounds_to_question is None:
        return "You are asked once, at the end."
    if view.asking == "end":
        return words.END_LATER
    if view.stand_in and view.previous:
        name = policy_name(view, view.previous.id, SHORT)
        return f"{name[0].upper()}{name[1:]} was chosen for you: {view.stand_in}."
    unless = "" if view.asking or view.config.ask == "always" else ", unless your answers leave no doubt"
    if view.rounds_to_question > 1:
        return f"You are asked again in {view.rounds_to_question} rounds{unless}."
    return f"You are asked when this round is over{unless}."


def lost(folder: Path) -> str:
    """Say that the studio is gone, and what to do."""
    return words.LOST.format(command=printable(command("studio", folder)))


def policy_name(view: View, policy_id: int, longest: int = LONGEST_NAME) -> str:
    """Return the number of a policy, and the name that somebody has given it, cut where it is longer than that."""
    note = view.noted.policy(policy_id)
    cut = note if len(note.name) <= longest else replace(note, name=f"{note.name[: longest - 1].rstrip()}…")
    return cut.named(f"policy {policy_id}")


def subject(what: str) -> str:
    """Return the title of the dialog for the name and the note of a policy or a run."""
    return f"Name and note of {what}"


def remarks(view: View, policy: Policy) -> str:
    """Say in the table what else there is to know of a policy: its name, and that it is no longer in the front."""
    replaced = "no longer in the front" if policy.id in view.replaced else ""
    return ", ".join(filter(None, (view.noted.policy(policy.id).name, replaced)))


def watched(objectives: Sequence[Objective]) -> str:
    """Say to somebody new who only watches what happens here."""
    return words.WATCHED.format(objectives=questions.joined([objective.label for objective in objectives]))


def ranges(view: View) -> list[str]:
    """Return the worst and the best value of each objective on the front; nothing without a front."""
    if not view.front:
        return [""] * len(view.objectives)
    each = zip(writers_of(view), view.values.min(axis=0), view.values.max(axis=0), strict=True)
    return [minus(writer.span(worst, best)) for writer, worst, best in each]


def limits_reached(view: View, selection: Selection) -> str:
    """Say how many policies reach the limits."""
    return f"{int(reaching(view, selection).sum())} of {plural(len(view.front), 'policy')} reach your limits."


def keep(view: View) -> str:
    """Name the way to choose again what was chosen last; nothing where that is not possible."""
    last = last_choice(view)
    if last is None or view.previous is None or not view.choosable(last.id):
        return ""
    if last.id == view.previous.id:
        return f"Keep {policy_name(view, last.id, SHORT)}"
    return f"Take {policy_name(view, last.id, SHORT)}, which has replaced {view.previous.id}"


def offers_equal(view: View) -> bool:
    """Return whether the open question is about two policies."""
    return view.question is not None and (view.question.form == "pair" or view.question.again)


def offers_pair(view: View) -> bool:
    """Return whether two policies could be asked about in place of the open question."""
    question = view.question
    return question is not None and question.form != "pair" and not question.again and len(question.whole.front) > 2


def end_with(view: View, selection: Selection, policy: Policy) -> str:
    """Name a way to end the run: with which policy, by letter, number, name and scores."""
    letter = selection.letters.get(policy.id)
    name = f"{letter}, {policy_name(view, policy.id)}" if letter else policy_name(view, policy.id)
    values = minus(values_in_words(policy.values, writers_of(view)))
    missed = missed_limits(view, selection, policy)
    return f"End with {name}: {values}{f' – not within your limit: {missed}' if missed else ''}"


def missed_limits(view: View, selection: Selection, policy: Policy) -> str:
    """Return the limits that a policy does not reach: `time ≤ 80`; nothing where it reaches all."""
    if selection.limits is None:
        return ""
    missed = np.where(policy.values < selection.limits, selection.limits, -np.inf)
    return minus(bounds_in_words(missed, [Writer(objective, "g") for objective in view.objectives]))


def standing(view: View, policy: Policy) -> str:
    """Say what a policy is to the person: the last choice, what has replaced it, or new; nothing for any other."""
    last = last_choice(view)
    if last and policy.id == last.id:
        chosen = "chosen for you" if view.stand_in else "your last choice"
        replaced = "has replaced what was chosen for you" if view.stand_in else "has replaced your last choice"
        return chosen if view.previous and view.previous.id == last.id else replaced
    return "new" if view.is_new(policy) else ""


def beside(view: View, selection: Selection, policy: Policy) -> str:
    """Say by how much a policy is better or worse than A, the first that is laid out; nothing of A itself."""
    first = view.policy(selection.places.get(LETTERS[0], -1))
    if first is None or first.id == policy.id:
        return ""
    told = [
        f"{writer.objective.label} {writer.size(change)} {'better' if change > 0 else 'worse'}"
        for writer, change in zip(writers_of(view), policy.values - first.values, strict=True)
        if float(writer.size(change))
    ]
    return f"Beside A: {', '.join(told) or 'the same'}"


def scores(view: View, policy: Policy) -> str:
    """Return all scores of a policy in one line."""
    each = zip(view.objectives, score_of_each(view, policy), strict=True)
    return ", ".join(f"{objective.label} {score}" for objective, score in each)


def blend_name(selection: Selection, pair: tuple[int, int], per_cent: int) -> str:
    """Say where the dial between two policies is."""
    first, second = (f"{selection.letters[policy]} (policy {policy})" for policy in pair)
    if per_cent < 0:
        return f"Beyond {first}, away from {second}"
    if per_cent > 100:
        return f"Beyond {second}, away from {first}"
    if per_cent in (0, 100):
        return f"This is {second if per_cent else first}"
    return f"{100 - per_cent} % of {first}, {per_cent} % of {second}"


def blend_scores(view: View, score: BlendScore, pair: tuple[int, int]) -> str:
    """Return the scores of a blend in one line, as those of a policy, and where it is worse than both of its own."""
    each = zip(view.objectives, _with_units(view, score.mean, score.std), strict=True)
    found = [f"{objective.label} {text}" for objective, text in each]
    told = f"{', '.join(found)}, over {plural(EPISODES, 'episode')}"
    ends, episodes = [policy for policy in map(view.policy, pair) if policy], view.config.evaluation.episodes
    errors = [np.sqrt(score.std**2 / EPISODES + policy.std**2 / episodes) for policy in ends]
    behind = [policy.values - score.mean > SURELY * error for policy, error in zip(ends, errors, strict=True)]
    worse = np.all(behind, axis=0) & bool(ends)
    labels = [objective.label for objective, is_worse in zip(view.objectives, worse, strict=True) if is_worse]
    return f"{told}. Worse than either of the two in {' and '.join(labels)}." if labels else told


def raw_returns(view: View, policy: Policy) -> str:
    """Return the mean undiscounted returns of a policy; nothing where they are its scores."""
    if policy.raw is None:
        return ""
    return "raw returns: " + minus(values_in_words(policy.raw, writers_for(policy.raw[None], view.objectives)))


@lru_cache(maxsize=4)
def writers_of(view: View) -> list[Writer]:
    """Return a writer of each objective, fit for the front; for zeros where there is no front."""
    return writers_for(view.values if view.front else np.zeros((1, len(view.objectives))), view.objectives)


def decimals(view: View) -> list[int | None]:
    """Return the digits after the point of each objective's scores; None: significant digits, as needed."""
    return [int(writer.format[1:-1]) if writer.format.endswith("f") else None for writer in writers_of(view)]


def score_of_each(view: View, policy: Policy) -> list[str]:
    """Return `66.1 ±0.4 steps` for each objective: mean and standard deviation over the evaluation episodes."""
    return _with_units(view, policy.values, policy.std)


def _with_units(view: View, values: np.ndarray, deviations: np.ndarray) -> list[str]:
    each = zip(writers_of(view), values, deviations, strict=True)
    return [minus(writer.score(*score)) + f" {writer.objective.read.unit}" for writer, *score in each]


def remark(view: View, policy: Policy) -> str:
    """Say where a policy comes from, that it cannot be chosen, or how far its scores can be trusted as the result's."""
    if view.question and not view.choosable(policy.id):
        return f"{words.REPLACED}, so it cannot be chosen"
    if policy.id in view.replaced:
        return words.REPLACED
    if view.result or (view.question and view.question.purpose == "final"):
        return _certainty(view, policy)
    if view.early:
        return "still learning"
    return f"trained in round {policy.generation}" if policy.generation else "trained in the warm-up"


def outlook(view: View, selection: Selection) -> str:
    """Say what choosing the policy in focus would mean for the search; nothing where it would mean nothing."""
    focus, question = selection.focus, view.question
    if focus is None or question is None or question.purpose != "steer" or not view.choosable(focus):
        return ""
    letter = selection.letters[focus]
    if selection.prospect is None:
        return f"If you choose {letter}: …"
    return questions.outlook(letter, "the dashed area", selection.prospect, view.values, writers_of(view))


def _certainty(view: View, policy: Policy) -> str:
    outside = "" if within(policy.values[None], view.bounds)[0] else "Outside the search area. "
    if policy.confirmation:
        return f"{outside}Scores from {plural(policy.confirmation.episodes, 'fresh episode')}."
    return f"{outside}Scores from the search: the best of many, they may be lucky."


def opened_elsewhere(view: View) -> str:
    """Say that another run was opened than the one that was shown."""
    return f"{printable(view.path.name)} was opened, in another tab."


def _generation(timeline: Timeline) -> int:
    return min(timeline.generation, timeline.generations)

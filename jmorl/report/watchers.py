"""Who watches a run without a screen of their own: in lines, in JSON, or not at all."""

import json
from abc import ABC, abstractmethod
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict
from types import TracebackType
from typing import Any, Self, TextIO

import numpy as np

from envs.core import Objective
from jmorl.config import Config
from jmorl.display.console import PlainConsole
from jmorl.display.fronts import final_title, front_table
from jmorl.display.readings import bounds_in_words, confirmed_in_words, values_in_words, writers_for
from jmorl.display.text import REASONS, duration, number, plural, short_count
from jmorl.events import Blended, Compiled, Decided, Event, GenerationFinished, Resumed, RunFinished
from jmorl.report.timeline import Timeline
from jmorl.search.families import Blending
from jmorl.search.policy import Confirmation, Policy


class Watcher(ABC):
    """Shows a run, event by event, within a `with` block."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        return None

    def asking(self) -> AbstractContextManager[object]:
        """While somebody is asked on the same screen, leave it alone."""
        return nullcontext()

    @abstractmethod
    def show(self, event: Event) -> None:
        """Show what has just happened."""


class Quiet(Watcher):
    """Shows nothing."""

    def show(self, event: Event) -> None:
        """Show what has just happened."""
        pass


class Lines(Watcher):
    """One line for every event, and the final front as a table."""

    def __init__(self, config: Config, objectives: tuple[Objective, ...], console: PlainConsole):
        self.objectives = objectives
        self.console = console
        self.timeline = Timeline(config, since=0.0)
        self.generations = self.timeline.generations

    def show(self, event: Event) -> None:
        """Show what has just happened."""
        self.console.print(self._line(event), soft_wrap=True)
        if isinstance(event, RunFinished):
            show_result(self.console, event, self.objectives)

    def _line(self, event: Event) -> str:
        match event:
            case Compiled():
                left, rate = max(self.timeline.total_steps - event.steps, 0), event.steps_per_second
                return (
                    f"compiled in {duration(event.seconds)} on {plural(event.devices, 'device')}; "
                    f"training {short_count(left)} steps at about {short_count(rate)} steps/s "
                    f"takes {duration(left / rate)}"
                )
            case Resumed():
                front = len(event.state.archive.members)
                after = "its blending" if event.state.blendings else self._name(event.state.generation)
                return f"resumed after {after}, with a front of {front}"
            case Blended():
                return self._blending_line(event)
            case GenerationFinished():
                return self._generation_line(event)
            case Decided():
                why = "" if event.question.was_asked(event.answer) else f" ({event.answer.reason})"
                return f"{question_name(event)}: {choice_in_words(event, self.objectives)}{why}"
            case RunFinished():
                found = confirmed_in_words(event.chosen, self.objectives)
                result = f"policy {event.chosen.id}" + (f": {found}" if found else "")
                return f"finished: {REASONS[event.reason]}; the result is {result}"

    def _generation_line(self, event: GenerationFinished) -> str:
        generation, seconds = event.state.generation, event.seconds
        facts = [
            f"{short_count(event.steps)} steps",
            f"{short_count(event.steps_per_second)} steps/s",
            f"front of {event.front.front_size}",
            f"hypervolume {number(event.front.hypervolume)}",
        ]
        if event.front.below_reference:
            facts.append(f"{event.front.below_reference} of the front below the reference point")
        if event.candidates == 1 and event.state.choice:
            facts.append("nothing but the choice itself within the bounds")
        if event.utility_max is not None:
            facts.append(f"best utility {number(event.utility_max)}")
        times = f"train {duration(seconds.train)}, evaluate {duration(seconds.evaluate)}"
        if generation:
            times = f"select {duration(seconds.select)}, {times}"
        return f"{self._name(generation)}: {', '.join(facts)} ({times})"

    def _blending_line(self, event: Blended) -> str:
        blending, front = event.blending, event.front
        facts = [
            f"{len(blending.blends)} of {plural(blending.tried, 'blend')} joined the front",
            f"front of {front.front_size}",
            f"hypervolume {number(front.hypervolume)} after {number(event.before.hypervolume)}",
            f"{short_count(blending.evaluation_steps)} steps to evaluate",
            plural(len(blending.families), "family"),
        ]
        return f"blending: {', '.join(facts)} (evaluate {duration(event.seconds.total)})"

    def _name(self, generation: int) -> str:
        return f"round {generation} of {self.generations}" if generation else "warm-up"


class Json(Watcher):
    """One JSON object per line for every event, for other programs. Numbers that are not finite are null.

    `event` says which one, and `values`, `std`, `weights` and `bounds` have a number for each objective:

        {"event": "compiled", "seconds", "devices", "steps_per_second": to expect, "steps": made before}
        {"event": "resumed", "generation": the last one finished, "steps"}
        {"event": "generation", "generation": 0 is the warm-up, "generations": in the budget, "steps",
         "evaluation_steps", "steps_per_second", "seconds": {"select", "train", "evaluate"}, "candidates",
         "policy_loss", "value_loss", "entropy", "approximate_kl", "bounds",
         "front_size", "hypervolume", "expected_utility", "sparsity", "below_reference", "utility_max", "utility_mean",
         "utility_mean_within_bounds", "prediction_error", "realized_change", "interval_coverage",
         "widenings" (interactive only),
         "front": [policy, ...]}
        {"event": "blended": like "generation", and "tried": how many blends, "families": [[policy id, ...], ...],
         "links": [{"ends": two policy ids, "values": of the blend half-way, "loss": of the range}, ...],
         "blends": [policy, ...]: that joined the front}
        {"event": "decided", "purpose": "steer" or "final", "generation": about to start, "policy": its id, "values",
         "bounds": that follow, "shown": how many policies, the fields of the answer ("stop", "generations": before the
         next question, "stand_in": whether a stand-in answered, "reason": why), "seconds"}
        {"event": "finished", "reason": "budget", "satisfied" or "stopped", "chosen": policy}

    A policy is {"policy": its id, "generation", "parent", "weights", "values", "std"}. Where its values are confirmed
    it has "confirmation_episodes", "error" (of the values, 99 of 100) and "claimed" (what the search went by). A blend
    has "blend": {"parents": ids, "coefficients"}.
    """

    def __init__(self, config: Config, file: TextIO):
        self.file = file
        self.generations = Timeline(config, since=0.0).generations

    def show(self, event: Event) -> None:
        """Show what has just happened."""
        self.file.write(json.dumps(_finite(self._fields(event)), allow_nan=False) + "\n")
        self.file.flush()

    def _fields(self, event: Event) -> dict[str, Any]:
        match event:
            case Compiled():
                return {"event": "compiled", **asdict(event)}
            case Resumed():
                return {"event": "resumed", "generation": event.state.generation, "steps": event.steps}
            case Blended():
                return {**self._generation_fields(event), "event": "blended", **blending_fields(event.blending)}
            case GenerationFinished():
                return self._generation_fields(event)
            case Decided():
                return self._decided_fields(event)
            case RunFinished():
                return {"event": "finished", "reason": event.reason, "chosen": _policy_fields(event.chosen)}

    def _decided_fields(self, event: Decided) -> dict[str, Any]:
        question, chosen = event.question, event.chosen
        return {
            "event": "decided",
            "purpose": question.purpose,
            "generation": question.generation,
            "policy": chosen.id if chosen else None,
            "values": chosen.values.tolist() if chosen else None,
            "bounds": event.bounds.tolist(),
            "shown": len(question.shown),
            **question.to_json(event.answer),
            "seconds": event.seconds,
        }

    def _generation_fields(self, event: GenerationFinished) -> dict[str, Any]:
        return {
            "event": "generation",
            "generation": event.state.generation,
            "generations": self.generations,
            "steps": event.steps,
            "evaluation_steps": event.state.evaluation_steps,
            "steps_per_second": event.steps_per_second,
            "seconds": asdict(event.seconds),
            "candidates": event.candidates,
            **event.training,
            "bounds": event.bounds.tolist(),
            **asdict(event.front),
            "utility_max": event.utility_max,
            **event.search,
            "front": [_policy_fields(policy) for policy in event.state.archive.members],
        }


def blending_fields(blending: Blending) -> dict[str, Any]:
    """Return what came of blending a front, for JSON."""
    return {
        "tried": blending.tried,
        "families": blending.families,
        "links": [{"ends": link.ends, "values": link.values.tolist(), "loss": link.loss} for link in blending.links],
        "blends": [_policy_fields(policy) for policy in blending.blends],
    }


def question_name(decided: Decided) -> str:
    """Name the question, and who answered it if nobody was asked."""
    question = decided.question
    name = "final choice" if question.purpose == "final" else f"choice for round {question.generation}"
    name += ", asked again" if getattr(question, "again", False) else ""
    return name if question.was_asked(decided.answer) else f"the stand-in's {name}"


def choice_in_words(decided: Decided, objectives: Sequence[Objective]) -> str:
    """`policy 12 (time 66.1, fuel 57.3) of 9 shown; bounds time ≤ 70.2, fuel ≤ 60.4`."""
    question, chosen = decided.question, decided.chosen
    if chosen is None:
        answer = ", ".join(f"{name} {value}" for name, value in question.to_json(decided.answer).items())
        return f"{answer} ({plural(len(question.shown), 'policy')} shown)"
    writers = writers_for(question.values, objectives)
    values = values_in_words(chosen.values, writers)
    choice = f"policy {chosen.id} ({values}) of {len(question.shown)} shown{_more_of_answer(decided)}"
    if question.stops(decided.answer):
        return f"{choice}, and stop"
    if question.purpose == "final":
        return choice
    bounds = bounds_in_words(decided.bounds, writers) or "none"
    silent = decided.generations_to_question or 0
    more = f", no question for {plural(silent, 'round')}" if silent > 1 else ""
    return f"{choice}; bounds {bounds}{more}"


def _more_of_answer(decided: Decided) -> str:
    """Say what an answer tells beside the policy: an order of several, or that none is better than the others."""
    ranking, equal = getattr(decided.answer, "ranking", ()), getattr(decided.answer, "equal", False)
    if equal:
        return ", no difference between them"
    return f", in the order {', '.join(map(str, ranking))}" if len(ranking) > 1 else ""


def show_result(console: PlainConsole, event: RunFinished, objectives: tuple[Objective, ...]) -> None:
    """Show the final front by the scores of the search, with the chosen policy marked."""
    table = front_table(event.state.archive.members, objectives, event.chosen.id)
    table.title = final_title(event.chosen)
    console.print()
    console.print(table)


def _policy_fields(policy: Policy) -> dict[str, Any]:
    return {
        "policy": policy.id,
        "generation": policy.generation,
        "parent": policy.parent,
        **({"blend": asdict(policy.blend)} if policy.blend else {}),
        "weights": policy.weights.tolist(),
        "values": policy.values.tolist(),
        "std": policy.std.tolist(),
        **_confirmation_fields(policy.confirmation),
    }


def _confirmation_fields(confirmation: Confirmation | None) -> dict[str, Any]:
    if confirmation is None:
        return {}
    return {
        "confirmation_episodes": confirmation.episodes,
        "error": confirmation.error.tolist(),
        "claimed": confirmation.claimed.tolist(),
    }


def _finite(content: Any) -> Any:
    """Return the same without infinity and NaN, which JSON does not know."""
    match content:
        case dict():
            return {name: _finite(value) for name, value in content.items()}
        case list():
            return [_finite(value) for value in content]
        case float() if not np.isfinite(content):
            return None
    return content

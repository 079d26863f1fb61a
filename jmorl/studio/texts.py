"""The texts of the page."""

import re

import numpy as np

from jmorl.display.text import duration, front_question, number_format, plural, short_count, values_in_words
from jmorl.methods.base import Prospect
from jmorl.report.timeline import Timeline
from jmorl.search.policy import Policy
from jmorl.studio.between import EPISODES, BlendScore
from jmorl.studio.selection import Selection, wanted
from jmorl.studio.view import PERSON, View

# Titles of panels:
POLICIES, PROGRESS, HISTORY, NAVIGATION, BETWEEN = "Policies", "Progress", "History", "E-NAUTILUS", "Between"
BETWEEN_HINT = "Lay out two policies. A dial then leads from one to the other: see what lies between them, and beyond."
SCORING = "Scoring …"
MOST_POINTS = 3  # that the prediction model is quoted with
KEYS = (
    ("← →", "look at the next policy along the front"),
    ("↑ ↓", "in the table: look at the next row"),
    ("1 2 …", "what is better in objective 1, 2, …; once more: all policies"),
    ("c", "choose the policy in focus"),
    ("k", "keep the last choice"),
    ("x", "put the policy in focus away"),
    ("space", "stop and start the playback"),
    ("?", "these keys"),
)


def phase(view: View, now: float, leaving: bool = False) -> str:
    """Say what is going on."""
    timeline = view.timeline
    if view.problem:
        return f"Stopped: {view.problem}"
    if view.result:
        return f"Finished: {view.reason}"
    if timeline is None:
        after = f" after generation {view.generations[-1].number}" if view.generations else ""
        return f"Nothing is running; this run was left{after}"
    if leaving:
        return "Stopping after this generation"
    if view.question:
        return "Waiting for your answer"
    elapsed = duration(now - timeline.since)
    match timeline.phase:
        case "compiling":
            return f"Compiling the programs, {elapsed}"
        case "warm-up":
            return f"Warm-up: training {plural(view.config.population.agents, 'new agent')}, {elapsed}"
        case "generation":
            return f"Training generation {timeline.generation}"
        case "blending":
            return f"Blending the front, {elapsed}"
    return "Thinking"


def facts(view: View, now: float) -> str:
    """Say how far the run is, and how fast; nothing for a run that does not go on."""
    timeline = view.timeline
    if timeline is None:
        return ""
    done = [f"generation {_generation(timeline)} of {timeline.generations}"]
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
        return f"{plural(len(more), 'policy')} better in {label} than policy {selection.than}"
    if question:
        return front_question(question.purpose, question.generation, len(question.front), question.form, question.again)
    if view.result:
        return f"The result is policy {view.result.id}: {scores(view, view.result)}"
    if view.timeline is None:
        return "Look around, step back in the history, or go on with this run."
    if not view.generations:
        return "What there is to see comes with the end of the warm-up."
    if view.config.user != PERSON:
        return f"User {view.config.user} decides; you watch."
    if view.timeline.silent is None:
        return "You are asked once, at the end."
    if view.timeline.silent > 1:
        return f"You are asked again in {view.timeline.silent} generations."
    return "You are asked when this generation is over."


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


def blend_scores(view: View, score: BlendScore) -> str:
    """Return the scores of a blend in one line, as those of a policy."""
    each = zip(view.objectives, score.mean, score.std, formats_of(view), strict=True)
    found = [minus(f"{o.label} {value:{fmt}} ±{std:{fmt}} {o.unit}") for o, value, std, fmt in each]
    return f"{', '.join(found)}, over {plural(EPISODES, 'episode')}"


def raw_returns(view: View, policy: Policy) -> str:
    """Return the mean undiscounted returns of a policy; nothing where they are its scores."""
    if policy.raw is None:
        return ""
    formats = [number_format(np.array([value])) for value in policy.raw]
    return "raw returns: " + minus(values_in_words(policy.raw, view.objectives, formats))


def formats_of(view: View) -> list[str]:
    """Return the number format of each objective, fit for the front; for zeros where there is no front."""
    values = view.values if view.front else np.zeros((1, len(view.objectives)))
    return [number_format(column) for column in values.T]


def score_of_each(view: View, policy: Policy) -> list[str]:
    """Return `−66.1 ±0.4 -steps` for each objective: mean and standard deviation over the evaluation episodes."""
    each = zip(view.objectives, policy.values, policy.std, formats_of(view), strict=True)
    return [minus(f"{value:{fmt}} ±{std:{fmt}}") + f" {o.unit}" for o, value, std, fmt in each]


def consequences(view: View, prospect: Prospect | None, policy: Policy) -> str:
    """Say what choosing a policy would mean: what it rules out, and what the prediction model expects of the rest."""
    question = view.question
    if question and not view.choosable(policy.id):
        if policy.id in {each.id for each in view.front}:
            return "Outside the bounds, so it cannot be the result"
        return "No longer in the front: a later policy is better in everything, so it cannot be chosen"
    if question is None or question.purpose != "steer":
        return f"born in generation {policy.generation}"
    if prospect is None:
        return "Working out what choosing it would mean …"
    formats = formats_of(view)
    count = int((~prospect.kept).sum())
    bounds = minus(values_in_words(prospect.bounds, view.objectives, formats, "≥ "))
    ruled_out = f"Rules out {count} of {plural(len(prospect.kept), 'policy')}: {bounds}."
    if not len(prospect.expected):
        return f"{ruled_out} The model expects nothing new within these bounds."
    best = dict.fromkeys(prospect.expected.argmax(axis=0).tolist())  # in an objective, each a point of its own
    points = [minus(values_in_words(prospect.expected[row], view.objectives, formats)) for row in best]
    odds = f"Training leads at least as far in {10 * prospect.odds:.0f} of 10 cases."
    return f"{ruled_out} The model expects {'; or '.join(points[:MOST_POINTS])}. {odds}"


def minus(text: str) -> str:
    """Write numbers with the sign for minus that is as wide as a digit."""
    return re.sub(r"(?<!\w)-(?=\d)", "−", text)


def _generation(timeline: Timeline) -> int:
    return min(timeline.generation, timeline.generations)

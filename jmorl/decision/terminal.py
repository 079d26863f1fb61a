"""A person at a terminal, asked in text. Works with piped input, too."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from envs.core import Objective
from jmorl.decision.answers import Adjust, Answer, AskPair, Back, Choose, Instead, PointAnswer, Skip
from jmorl.decision.protocol import DecisionMaker, PointQuestion, Question
from jmorl.decision.terminal_view import show_front, show_introduction, show_outlook, show_points
from jmorl.display.console import PlainConsole
from jmorl.display.readings import direction

LONGEST_NUMBER = 9  # digits
COMPARISON = re.compile(r"([<>]=?|[≤≥])")
POLICY_HELP = """\
A policy is one way to act that was trained. Its scores are means over episodes,
± their spread from episode to episode. {directions}.
To choose otherwise later: jmorl branch RUN --round K --out NEW.
  12           choose policy 12
  if 12        say what choosing policy 12 would mean
  Enter        keep the last choice, while it is in the front: none is better
  12 4 9       prefer policy 12, then 4, then 9, to all others
  same         no difference between these
  pair         ask about two policies instead, whose comparison tells most
  skip         I cannot say: go on by my earlier answers
  {limit}
               rule out what does not reach this; none takes it back
  {best:<12} list the policies that are best in an objective first
  all          list every policy, where only some are shown
  12 go 5      choose policy 12, then no question for 5 rounds (or go 5)
  12 q         choose policy 12 and end (q or Ctrl-D: with the last choice)
  ?            this help"""
POINT_HELP = """\
  2            move to point 2: nothing will ever be worse than its worst values
  back         undo the last choice; back 2 undoes two
  iterations 4 take 4 more iterations to the front
  points 5     show up to 5 points in each
  q            end here, or with Ctrl-D, with the policy nearest to where you are
  ?            this help"""


@dataclass(frozen=True)
class If:
    """The wish to know what choosing a policy would mean."""

    policy: int


class TerminalUser(DecisionMaker):
    """Shows each question on `console` and takes the answer from `read`, which is given a prompt as `input` is.

    An answer that makes no sense is explained and asked for again. Raises EOFError if the input ends when there is no
    choice to end the run with, and `Instead` where the person wants to skip a question, or be asked about a pair.
    """

    signs = True

    def __init__(self, console: PlainConsole | None = None, read: Callable[[str], str] | None = None):
        self.console = console or PlainConsole()
        self.read = read or input
        self._introduced = False

    def answer(self, question: Question) -> Answer:
        """Return the preferred member of the question's front."""
        if question.generation == 1 and not self._introduced:
            self._introduced = True
            show_introduction(self.console, question)
        show_front(self.console, question, by=0)
        limits = question.limits
        while True:
            line = self._line(_prompt(question))
            if line and line.strip().lower() == "all":
                question = question.whole
                show_front(self.console, question, by=0)
                continue
            reply = policy_reply(question, "q" if line is None else line)
            match reply:
                case Answer() if line is None:
                    self._say(f"The input has ended: policy {reply.policy} is the result, the last choice.")
                    return replace(reply, limits=None if question.limits == limits else question.limits)
                case Answer():
                    return replace(reply, limits=None if question.limits == limits else question.limits)
                case If():
                    show_outlook(self.console, question, reply.policy)
                case Instead():
                    reply.limits = None if question.limits == limits else question.limits
                    raise reply
                case tuple():
                    question = replace(question, limits=reply)
                    show_front(self.console, question, by=0)
                case int():
                    show_front(self.console, question, by=reply)
                case str() if line is None:
                    raise EOFError(f"the input ended, and nothing is chosen. {reply} Resume the run to be asked again")
                case str():
                    self._say(reply)

    def choose_point(self, question: PointQuestion) -> PointAnswer:
        """Return the answer to a question of E-NAUTILUS."""
        show_points(self.console, question)
        while True:
            line = self._line("point (? for help) > ")
            reply = point_reply(question, "q" if line is None else line)
            if not isinstance(reply, str):
                return reply
            self._say(reply)

    def _line(self, prompt: str) -> str | None:
        """Return what the person types; None at the end of the input."""
        try:
            return self.read(prompt)
        except EOFError:
            self.console.print()
            return None
        except UnicodeDecodeError:
            return "?"

    def _say(self, sentence: str) -> None:
        self.console.print(sentence)


def _prompt(question: Question) -> str:
    """Say what to type."""
    ids = [str(policy.id) for policy in question.front]
    if question.form == "rank":
        return f"policies, the best first, for example {' '.join(ids[:3])} (? for help) > "
    if question.form == "pair":
        return f"{' or '.join(ids[:2])}, or same (? for help) > "
    return "policy (? for help) > "


def policy_reply(question: Question, line: str) -> Answer | Instead | If | int | tuple[float, ...] | str:
    """Return what a line means: an answer, what is wanted instead, an objective to list by, limits, or what to say.

    An objective is its index. What is said is a sentence, after which the question is asked again. Limits [M] are those
    from now on, -inf where there is none.
    """
    words = line.lower().replace("−", "-").replace(",", " ").replace(">", " ").split()
    name = question.objectives[-1].name
    if words[:1] in (["?"], ["help"]):
        directions = "; ".join(f"{each.label}: {direction(each)}" for each in question.objectives)
        return POLICY_HELP.format(
            best=f"best {name}", limit=f"limit {name} {_middle(question)}", directions=directions.capitalize()
        )
    if words[:1] == ["best"]:
        return _objective(question.objectives, " ".join(words[1:]))
    if words[:1] == ["limit"]:
        return _limits(question, COMPARISON.sub(r" \1 ", line.lower().replace("−", "-").replace(",", ".")).split()[1:])
    if words == ["same"]:
        kept = question.previous in [policy.id for policy in question.whole.front]
        return Answer(question.previous if kept and question.previous is not None else question.front[0].id, equal=True)
    if words[:1] == ["if"]:
        return _if(question, words[1:])
    if words in (["skip"], ["pair"]):
        return _instead(question, words[0])
    ranking = _ranking(question, words)
    if isinstance(ranking, str):
        return ranking
    named = words.pop(0) if words and words[0] not in ("go", "q") else None
    chosen = _policy(question, named)
    if isinstance(chosen, str):
        return chosen
    del words[: max(len(ranking) - 1, 0)]
    match words:
        case []:
            return Answer(chosen, ranking=ranking)
        case ["q"]:
            return Answer(chosen, stop=True, ranking=ranking)
        case ["go", number] if question.purpose == "steer" and (generations := _number(number)):
            return Answer(chosen, generations=generations, ranking=ranking)
        case ["go", *_] if question.purpose == "steer":
            return "Say for how many rounds to go on, for example: go 5"
        case ["go", *_]:
            return "The run has no rounds left to go on for; choose the policy that is its result."
    return f"I do not understand {line.strip()!r}; ? lists what you can type."


def point_reply(question: PointQuestion, line: str) -> PointAnswer | str:
    """Return what a line means: an answer, or a sentence to say and ask again."""
    state, shown = question.state, len(question.points)
    words = line.lower().split()
    number = _number(words[1]) if len(words) == 2 else None
    match words:
        case ["?" | "help"]:
            return POINT_HELP
        case ["q"]:
            return Adjust(iterations_left=0, points=state.points)
        case ["back", *_] if not state.choices:
            return "You are at the start; there is nothing to undo."
        case ["back"]:
            return Back(1)
        case ["back", _] if number and number <= state.choices:
            return Back(number)
        case ["back", *_]:
            return f"You can go back by 1 to {state.choices}, for example: back {state.choices}"
        case ["iterations", _] if number:
            return Adjust(number, state.points)
        case ["points", _] if number:
            return Adjust(state.iterations_left, number)
        case ["iterations" | "points" as what, *_]:
            return f"Say how many {what}, at least 1, for example: {what} 4"
        case [word] if (chosen := _number(word)) and chosen <= shown:
            return Choose(chosen - 1)
    return f"Choose a point by its number, 1 to {shown}; ? lists what else you can type."


def _if(question: Question, words: list[str]) -> If | str:
    """Return the policy whose choice is asked about, or why nothing can be said of it."""
    if question.purpose != "steer":
        return "The policy that you choose is the result; nothing follows."
    if len(words) != 1:
        return f"Say which policy, for example: if {question.front[0].id}"
    chosen = _policy(question, words[0])
    return chosen if isinstance(chosen, str) else If(chosen)


def _instead(question: Question, word: str) -> Instead | str:
    """Return what the word asks for, or why this question does not have it."""
    if question.purpose != "steer":
        return "This question has to be answered: the policy that you choose is the result."
    if question.again:
        return "Choose one of the two. With same, what you have just chosen stays."
    if word == "skip":
        return Skip()
    if question.form == "pair":
        return "This question is about two policies already."
    return AskPair() if len(question.whole.front) > 2 else "There are no more than two policies."


def _policy(question: Question, named: str | None) -> int | str:
    """Return the id of the policy somebody named, or of the last choice; a sentence if the front has no such policy."""
    ids, previous = [policy.id for policy in question.whole.front], question.previous
    hint = f"choose a policy by its number, for example {ids[0]}, or type ? for help"
    if named is None and previous is None:
        return f"There is no last choice yet; {hint}."
    if named is None and previous not in ids:
        return f"Your last choice is no longer in the front: a later policy is better in everything; {hint}."
    number = previous if named is None else _number(named)
    if number is None:
        return f"I do not understand {named!r}; {hint}."
    if number not in ids:
        return f"There is no policy {number}. You can choose from: {', '.join(map(str, sorted(ids)))}."
    return number


def _ranking(question: Question, words: list[str]) -> tuple[int, ...] | str:
    """Return the ids of a line that begins with several; a sentence if one is twice, or not shown; else nothing."""
    ids = []
    for word in words:
        number = _number(word)
        if number is None:
            break
        ids.append(number)
    if len(ids) < 2:
        return ()
    shown = [policy.id for policy in question.front]
    if len(set(ids)) < len(ids):
        return "Name each policy once, from the best down."
    strange = [str(each) for each in ids if each not in shown]
    if strange:
        return f"Only the policies shown can be put in order. Not shown: {', '.join(strange)}."
    return tuple(ids)


def _limits(question: Question, words: list[str]) -> tuple[float, ...] | str:
    """Return all limits, with one objective's changed; a sentence if the words do not say how."""
    compared = [word for word in words if COMPARISON.fullmatch(word)]
    *named, value = [word for word in words if word not in compared] or [""]
    index = _objective(question.objectives, " ".join(named)) if named else ""
    if isinstance(index, str):
        name = question.objectives[-1].name
        names = ", ".join(objective.name for objective in question.objectives)
        return (
            f"Name an objective ({names}) and what it must reach, for example: limit {name} {_middle(question)}; or: "
            f"limit {name} none"
        )
    try:
        number = None if value == "none" else float(value)
    except ValueError:
        number = math.nan
    if number is not None and not math.isfinite(number):
        return f"A limit is a number, or none; {value!r} is neither."
    objective = question.objectives[index]
    if any((sign[0] in "<≤") != objective.read.less_is_better for sign in compared):
        most = "most" if objective.read.less_is_better else "least"
        return f"{objective.label}: {direction(objective)}. So a limit says at {most}: limit {objective.name} {value}"
    limits = list(question.limits or [-math.inf] * len(question.objectives))
    limits[index] = -math.inf if number is None else objective.read.to_return(number)
    return tuple(limits)


def _middle(question: Question) -> str:
    """Return a score in the last objective that about half of the policies reach, as people say it."""
    return f"{float(np.median(question.objectives[-1].read.of(question.values[:, -1]))):.3g}"


def _objective(objectives: tuple[Objective, ...], named: str) -> int | str:
    """Return the index of the objective with this number, or whose name or label begins so; else a sentence."""
    number = _number(named)
    if number and number <= len(objectives):
        return number - 1
    matching = [
        index
        for index, objective in enumerate(objectives)
        if named and any(text.lower().startswith(named) for text in (objective.name, objective.label))
    ]
    if len(matching) == 1:
        return matching[0]
    names = ", ".join(f"{number} {objective.name}" for number, objective in enumerate(objectives, start=1))
    return f"Best in what? Name one of the objectives: {names}. For example: best {objectives[0].name}"


def _number(word: str) -> int | None:
    """Return the whole number that the word is, if it is one, and short enough to have been meant."""
    return int(word) if word.isdecimal() and len(word) <= LONGEST_NUMBER else None

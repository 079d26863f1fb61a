"""The stand-in: it asks where it is not sure, its answers are marked, and runs with it resume and replay exactly."""

import shutil
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import envs
from jmorl import Decided, DecisionMaker, PairQuestion, branch, read_run, resume, run
from jmorl.cli import main
from jmorl.decision.answers import Answer, AnswerError, AskPair, Skip
from jmorl.decision.records import DecisionRecord, ScriptError, from_json, record_of, to_json
from jmorl.decision.remembered import Remembered
from jmorl.decision.scripted import ScriptedUser
from jmorl.decision.stand_in import DOUBTED_REGRET, TRUSTED_REGRET, StandIn
from jmorl.decision.terminal import TerminalUser
from jmorl.decision.users import make_user
from jmorl.studio.person import Person
from tests.resuming import Counting, follow, go_on, outcome, train


@pytest.fixture(scope="module")
def config(small_config):
    """Eight generations, long enough that answers begin to agree."""
    return small_config.replace(ask="unsure", steps=4 * 3 * 16 * 26)


@pytest.fixture(scope="module")
def whole(config, tmp_path_factory):
    return train(tmp_path_factory.mktemp("stand_in") / "whole", config)


def decisions(events):
    return [event for event in events if isinstance(event, Decided)]


def questions(path):
    """How many reached the user, the last one included."""
    return sum(not record.stand_in for record in read_run(path).decisions)


def test_only_a_part_of_the_questions_reaches_the_user(config, small_config):
    user = Counting(config)
    events = list(run(config, user))
    asked = [event for event in decisions(events) if not event.answer.stand_in]
    assert 1 <= len(asked) == len(user.asked) == events[-1].state.questions < len(decisions(events)) == 9
    assert events[-1].state.policies_shown == sum(len(event.question.front) for event in asked)
    assert all(event.answer.reason for event in decisions(events) if event.answer.stand_in)
    utility = make_user(config.user, envs.make(config.env).objectives).utility
    always = list(run(config.replace(ask="always")))
    for chosen, best in zip(decisions(events), decisions(always), strict=True):
        if len(chosen.question.front) == len(best.question.front):
            worth = utility(chosen.question.values)
            assert utility(chosen.chosen.values[None]) >= worth.max() - 0.05 * np.ptp(worth)


def test_a_target_is_nobodys_time_and_asked_every_time(config):
    """Steering to a point by answers that are only almost right takes longer."""
    events = list(run(config.replace(user="target=0,0,0")))
    assert len(decisions(events)) == 9
    assert not any(event.answer.stand_in for event in decisions(events))


def test_the_log_and_the_table_tell_whose_an_answer_is(whole, tmp_path, capsys):
    records = read_run(whole).decisions
    assert {record.stand_in for record in records} == {True, False}
    assert {(record.stand_in, record.format) for record in records} == {(True, 3), (False, 1)}
    assert main(["show", str(shutil.copytree(whole, tmp_path / "copy"))]) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if " steer " in line or " final " in line]
    assert ["by the stand-in" in row for row in rows] == [record.stand_in for record in records]
    *_, last = read_run(whole).metrics["questions"]
    assert last == sum(not record.stand_in for record in records if record.purpose == "steer")


@pytest.mark.parametrize("events", [3, 8, 12])
def test_a_run_with_a_stand_in_is_resumed_to_the_same_result(whole, config, tmp_path, events):
    path = train(tmp_path / "broken", config, events=events)
    user = Counting(config)
    go_on(path, user=user)
    assert outcome(path) == outcome(whole)
    assert len(user.asked) < questions(whole) or events == 3


def test_who_wants_to_be_asked_now_is_asked_once_and_never_again_the_same(whole, config, tmp_path):
    """A stand-in's answer is taken back; the user's own in its place survives a run that is broken off after it."""
    first = next(record for record in read_run(whole).decisions if record.stand_in)
    path = tmp_path / "taken_back"
    with branch(whole, first.generation - 1, path).folder:
        pass
    others = {shown.policy for shown in first.shown} - {first.policy}

    class Other(Counting):
        def answer(self, question):
            self.asked.append(question)
            return Answer(min(others))

    user = Other(config)
    continued = resume(path, user, ask_now=True)
    with continued.folder:
        for event in continued.events():
            if isinstance(event, Decided):
                break
    assert len(user.asked) == 1 and event.chosen.id == min(others) and not event.answer.stand_in
    later = Counting(config)
    again = resume(path, later)
    with again.folder:
        taken = next(event for event in again.events() if isinstance(event, Decided))
    assert taken.chosen.id == min(others) and not taken.answer.stand_in and not later.asked


def test_a_branch_asks_at_once(whole, config, tmp_path):
    first = next(record for record in read_run(whole).decisions if record.stand_in)
    continued = branch(whole, first.generation - 1, tmp_path / "branch")
    user = Counting(config)
    with continued.folder:
        decided = next(event for event in continued.events(user) if isinstance(event, Decided))
    assert len(user.asked) == 1 and not decided.answer.stand_in


@pytest.mark.parametrize("ask", ["unsure", "always"])
def test_its_log_replays_to_the_same_choices(whole, config, ask):
    replayed = decisions(run(config.replace(ask=ask), ScriptedUser(whole / "decisions.jsonl")))
    recorded = read_run(whole).decisions
    assert [event.answer.policy for event in replayed] == [record.policy for record in recorded]
    assert [event.answer.stand_in for event in replayed] == [record.stand_in for record in recorded]


def test_a_mark_survives_writing_and_a_file_without_it_is_a_users(ask):
    question = ask([[1, 2], [2, 1]])
    for answer in (Answer(10), Answer(10, stand_in=True, reason="sure")):
        record = record_of(question, answer)
        assert isinstance(record, DecisionRecord) and record.stand_in == answer.stand_in
        assert from_json(to_json(record)) == record
        assert ("stand_in" in to_json(record)) == answer.stand_in
    with pytest.raises(ScriptError):
        from_json(to_json(record).replace("true", '"yes"'))


def test_other_questions_are_the_users(front_of):
    class User(Counting):
        def __init__(self):
            pass

        def compare(self, question):
            return question.pair[1].id

    pair = PairQuestion(1, (), front_of([[1, 2], [2, 1]]))
    assert StandIn(User(), 0).respond(pair) == 11


def test_a_front_of_one_needs_nobody(ask):
    assert StandIn(Says(None), 0).respond(ask([[1, 2]])) == Answer(10, stand_in=True)


def test_a_branch_knows_what_was_answered_before_it(whole, config, tmp_path):
    user = Counting(config)
    follow(branch(whole, 6, tmp_path / "branch"), user=user)
    assert len(user.asked) < questions(whole)


@pytest.mark.parametrize("ask", ["always", "unsure"])
def test_short_questions_show_few_policies_and_lead_to_the_same(small_config, ask, tmp_path):
    config = small_config.replace(question="few", ask=ask, steps=4 * 3 * 16 * 26)
    utility = make_user(config.user, envs.make(config.env).objectives).utility
    path = train(tmp_path / "run", config)
    events = decisions(run(config))
    asked = [event for event in events if not event.answer.stand_in]
    assert ask == "unsure" or len(asked) == len(events)
    for event in asked:
        question: Any = event.question
        assert len(question.front) == min(5, len(question.front) + len(question.others))
        assert question.previous is None or question.previous in [each.id for each in question.whole.front]
        worth = utility(question.whole.values)
        assert worth.max() - utility(event.chosen.values[None])[0] <= 0.1 * np.ptp(worth)
    assert any(len(event.question.shown) == 5 for event in asked)
    records = read_run(path).decisions
    assert [[shown.policy for shown in record.shown] for record in records] == [
        [policy.id for policy in event.question.shown] for event in events
    ]
    broken = train(tmp_path / "broken", config, events=7)
    go_on(broken)
    assert outcome(broken) == outcome(path)
    replayed = decisions(run(config, ScriptedUser(path / "decisions.jsonl")))
    assert [event.chosen.id for event in replayed] == [event.chosen.id for event in events]


def test_who_chooses_from_the_others_has_seen_them_all(ask):
    class Last(DecisionMaker):
        def answer(self, question):
            return Answer(question.others[-1].id)

    question = ask([[k, 9 - k] for k in range(10)], previous=12)
    asked: Any
    asked, answer = StandIn(Last(), 0, ask="always", shows="few").decide(question)
    assert not asked.others and {policy.id for policy in asked.front} == {policy.id for policy in question.front}
    assert asked.checked(answer) == answer


def test_a_choice_from_the_others_is_remembered_and_replayed(small_config, tmp_path):
    """Its record has all policies, though the question will show few."""

    class Last(Counting):
        def answer(self, question):
            self.asked.append(question.generation)
            return Answer(question.whole.front[-1].id)

    config = small_config.replace(question="few", steps=4 * 3 * 16 * 17)
    whole = train(tmp_path / "whole", config, user=Last(config))
    assert any(len(record.shown) > 5 for record in read_run(whole).decisions)
    path = shutil.copytree(whole, tmp_path / "copy")
    (path / "result.json").unlink()
    for generation in (4, 5):
        shutil.rmtree(path / "checkpoints" / f"{generation:05d}")
    user = Last(config)
    go_on(path, user=user)
    assert not user.asked
    assert outcome(path) == outcome(whole)
    replayed = decisions(run(config, ScriptedUser(whole / "decisions.jsonl")))
    assert [event.chosen.id for event in replayed] == [record.policy for record in read_run(whole).decisions]


@pytest.mark.parametrize("seed", range(4))
def test_a_short_question_has_the_last_choice_and_is_spread_over_the_front(ask, seed):
    asked = []

    class First(DecisionMaker):
        def answer(self, question):
            asked.append([policy.id for policy in question.front])
            return Answer(question.front[0].id)

    StandIn(First(), seed, ask="always", shows="few").decide(ask([[k, 9 - k] for k in range(10)], previous=12))
    assert len(asked[0]) == 5 and 12 in asked[0] and min(asked[0]) <= 11 and max(asked[0]) >= 18


# --- questions of other forms, and what somebody says besides ----------------------------------------------------


class Says(DecisionMaker):
    """Answers as a function of the question says, and keeps the questions."""

    def __init__(self, says):
        self.says = says
        self.questions = []

    def answer(self, question):
        self.questions.append(question)
        return self.says(question)


def best_first(question, weights=(0.3, 0.7)):
    """The ids of those shown, from the best down."""
    order = np.argsort(-(question.values @ np.array(weights)), kind="stable")
    return tuple(question.front[row].id for row in order)


def chooses(question):
    return Answer(best_first(question)[0])


def ranks(question):
    return Answer(best_first(question)[0], ranking=best_first(question))


@pytest.fixture
def growing(ask):
    """Questions of so many generations about a front that grows; a policy keeps its id."""

    def make(count):
        points = np.abs(np.random.default_rng(5).normal(size=(6 + 2 * count, 2)))
        points *= np.array([100, 3]) / np.linalg.norm(points, axis=1, keepdims=True)
        return [ask(points[: 6 + 2 * number], generation=number) for number in range(1, count + 1)]

    return make


def live(stand_in, questions, previous=None):
    """Ask all as a run would. Returns the questions as they were asked, with their answers, and the last choice."""
    decided = []
    for question in questions:
        asked, answer = stand_in.decide(replace(question, previous=previous))
        decided.append((asked, answer))
        further = stand_in.follow_up(asked, answer)
        if further:
            decided.append(stand_in.decide(further))
        previous = decided[-1][1].policy
    return decided, previous


def written(decided):
    """The records of decisions, as a log has them."""
    return [from_json(to_json(record_of(asked, asked.checked(answer)))) for asked, answer in decided]


def as_seen(decided):
    return [
        (asked.generation, asked.form, asked.again, [policy.id for policy in asked.front], answer)
        for asked, answer in decided
    ]


def test_a_pair_has_two_policies_and_the_run_goes_on_with_the_best_by_expectation(growing):
    user = Says(chooses)
    decided, chosen = live(StandIn(user, 1, ask="always", shows="pair"), growing(10))
    for (asked, answer), seen in zip(decided, user.questions, strict=True):
        assert asked is seen and seen.form == "pair" and len(seen.front) == 2
        assert answer.ranking == best_first(seen)[:1]
    assert any(answer.policy not in [policy.id for policy in asked.front] for asked, answer in decided)
    asked, _ = decided[-1]
    worth = asked.whole.values @ np.array([0.3, 0.7])
    assert worth.max() - asked.whole.policy(chosen).values @ np.array([0.3, 0.7]) < 0.05 * np.ptp(worth)


def test_a_ranked_pair_is_the_same_as_the_better_one(growing):
    one, other = (live(StandIn(Says(says), 1, ask="always", shows="pair"), growing(4)) for says in (chooses, ranks))
    assert one[1] == other[1]
    assert [[policy.id for policy in asked.front] for asked, _ in one[0]] == [
        [policy.id for policy in asked.front] for asked, _ in other[0]
    ]


def test_the_last_question_is_about_few_and_its_answer_is_the_result(growing):
    """Nobody ends a run with a policy that they have not chosen, or not seen."""
    last = replace(growing(6)[-1], purpose="final")
    for index in range(5):
        user = Says(lambda question, index=index: Answer(question.front[min(index, len(question.front) - 1)].id))
        stand_in: Any = StandIn(user, 1, ask="always", shows="pair")
        live(stand_in, growing(5))
        asked, answer = stand_in.decide(last)
        assert asked.form == "best" and len(asked.front) == 5 and answer.policy == asked.front[index].id


def test_a_question_says_whether_the_last_choice_was_a_stand_ins(growing):
    user = Says(chooses)
    stand_in = StandIn(user, 1, ask="unsure")
    decided, _ = live(stand_in, growing(8))
    own = [not answer.stand_in for _, answer in decided]
    assert False in own and own.count(True) > 1
    asked = [question.previous_by_stand_in for question in user.questions if not question.again]
    assert asked == [index > 0 and not own[index - 1] for index in range(len(own)) if own[index]]
    later: Any = StandIn(Says(chooses), 1, written(decided[: own.index(False) + 1]), ask_now=True)
    assert later.decide(growing(9)[-1])[0].previous_by_stand_in


def test_none_of_a_pair_keeps_the_last_choice_and_speaks_for_it(ask):
    line = [[k, 9 - k] for k in range(10)]

    def stand_in():
        return StandIn(Says(lambda question: Answer(12)), 0, ask="always", shows="pair")

    decided, chosen = live(stand_in(), [ask(line, generation=number) for number in range(1, 7)], previous=12)
    assert chosen == 12 and all(answer == Answer(12) for asked, answer in decided if 12 not in best_first(asked))
    assert any(12 not in best_first(asked) for asked, _ in decided)
    records = written([each for each in decided if 12 not in best_first(each[0])])

    def expected(history):
        unsure = StandIn(Says(lambda question: Answer(12, equal=True)), 0, history, "always", "pair")
        return unsure.decide(ask(line, generation=7))[1].policy

    assert abs(expected(records) - 12) <= 1 < abs(expected(()) - 12)


def test_who_ends_the_run_with_one_of_a_pair_gets_that_one(growing):
    def says(question):
        return Answer(question.front[0].id, stop=question.generation == 4)

    decided, chosen = live(StandIn(Says(says), 1, ask="always", shows="pair"), growing(4))
    asked, answer = decided[-1]
    assert answer.stop and chosen == asked.front[0].id


def test_a_few_are_ranked_and_the_run_goes_on_with_the_first(growing):
    user = Says(ranks)
    decided, _ = live(StandIn(user, 1, ask="always", shows="rank"), growing(4))
    for asked, answer in decided:
        assert asked.form == "rank" and len(asked.front) == 5 and asked.others
        assert answer == ranks(asked)


@pytest.mark.parametrize("shows", ["few", "pair", "rank"])
def test_who_has_all_listed_can_put_any_in_order(growing, shows):
    def says(question):
        order = best_first(question.whole)
        return Answer(order[0], ranking=order[:3])

    decided, _ = live(StandIn(Says(says), 1, ask="always", shows=shows), growing(3))
    for asked, answer in decided:
        assert answer.ranking == best_first(asked.whole)[:3] and answer.policy == answer.ranking[0]


def test_rankings_leave_less_to_ask_than_best_ones(growing):
    one, other = Says(chooses), Says(ranks)
    live(StandIn(one, 1, shows="few"), growing(10))
    live(StandIn(other, 1, shows="rank"), growing(10))
    assert 1 <= len(other.questions) <= len(one.questions) < 10


@pytest.mark.parametrize("shows", ["front", "few", "pair", "rank"])
def test_who_sees_no_difference_goes_on_with_the_best_by_expectation(growing, shows):
    def says(question):
        last = question.generation == 6
        return Answer(question.front[-1].id, equal=True) if last else chooses(question)

    *_, (asked, answer) = live(StandIn(Says(says), 1, ask="always", shows=shows), growing(6))[0]
    worth = asked.whole.values @ np.array([0.3, 0.7])
    assert answer.equal and worth.max() - asked.whole.policy(answer.policy).values @ np.array([0.3, 0.7]) < 0.15 * (
        np.ptp(worth)
    )


def test_limits_hold_for_the_stand_in_too(growing):
    """It wants the most of the second objective, and now at least some of the first."""

    def says(question):
        limits = (60.0, -np.inf) if question.generation == 3 else None
        good = [policy for policy in question.front if question.generation < 3 or policy.values[0] >= 60]
        return Answer(max(good or question.front, key=lambda policy: policy.values[1]).id, limits=limits)

    decided, _ = live(StandIn(Says(says), 1, ask="always"), growing(3))
    assert decided[-1][0].policy(decided[-2][1].policy).values[0] < 60
    later = StandIn(Says(None), 1, written(decided))
    question = growing(5)[-1]
    model_free = StandIn(Says(None), 1, written(decided[:2]))
    assert question.policy(later.decide(question)[1].policy).values[0] >= 60
    assert question.policy(model_free.decide(question)[1].policy).values[0] < 60


def test_what_a_limit_rules_out_is_no_rival_that_lost(ask):
    """All that has more of the first objective misses the limit on the second: nothing is said against the first."""
    front = [[80, 3], [60, 4], [40, 5], [20, 6], [10, 7]]
    limits = (-np.inf, 6.5)
    _, answer = StandIn(Says(lambda question: Answer(14, limits=limits)), 1, ask="always").decide(ask(front))
    assert answer.policy == 14
    question = ask(front, generation=1)
    assert not StandIn(Says(None), 1, written([(question, Answer(14, limits=limits))])).answers
    wider = ask([*front, [15, 6.8], [5, 9]], generation=2)
    stand_in = StandIn(Says(None), 1, written([(question, Answer(14, limits=limits)), (wider, Answer(15))]))
    [said] = stand_in.answers
    assert said.shown.tolist() == [[10, 7], [15, 6.8], [5, 9]] and said.ranking == (1,)
    nothing_reaches = StandIn(Says(None), 1, written([(question, Answer(14, limits=(-np.inf, 70.0)))]))
    assert len(nothing_reaches.answers[0].shown) == 5


def varied(question):
    """Answers of every sort, by generation."""
    if question.again:
        return Answer(question.front[-1].id)
    answer = ranks(question) if question.form == "rank" else chooses(question)
    match question.generation:
        case 2:
            return Answer(best_first(question)[0], equal=True)
        case 3:
            return replace(answer, limits=(-np.inf, 1.0))
        case 4 if question.previous is not None:
            return Answer(question.previous)
        case 5:
            return replace(answer, limits=(40.0, -np.inf))
        case 6:
            return Answer(question.whole.front[-1].id)
        case 7:
            raise Skip(limits=(30.0, -np.inf))
        case 8 if question.form != "pair":
            raise AskPair
    return answer


@pytest.mark.parametrize("decides", ["always", "unsure"])
@pytest.mark.parametrize("shows", ["front", "few", "pair", "rank"])
def test_who_knows_the_records_goes_on_as_who_was_there(growing, shows, decides):
    parts = [growing(9)[:3], growing(9)[3:6], growing(9)[6:]]
    lived = StandIn(Says(varied), 3, ask=decides, shows=shows)
    past: list[Any] = []
    previous = None
    for part in parts:
        resumed = StandIn(Says(varied), 3, written(past), decides, shows)
        found, _ = live(resumed, part, previous)
        decided, previous = live(lived, part, previous)
        assert as_seen(found) == as_seen(decided)
        past += decided


# --- somebody who wants something else than to answer --------------------------------------------------------------


def test_who_skips_a_question_goes_on_with_the_best_by_their_earlier_answers(growing):
    def says(question):
        if question.generation > 4:
            raise Skip
        return chooses(question)

    stand_in: Any = StandIn(Says(says), 1, ask="always")
    decided, _ = live(stand_in, growing(6))
    known = len(stand_in.answers)
    for asked, answer in decided[4:]:
        worth = asked.values @ np.array([0.3, 0.7])
        assert answer.stand_in and "skipped" in answer.reason
        assert worth.max() - worth[[policy.id for policy in asked.front].index(answer.policy)] < 0.05 * np.ptp(worth)
    assert known == 4 and stand_in.chose_last


def test_limits_that_are_set_with_a_skip_hold_at_once_and_later(growing):
    def says(question):
        raise Skip(limits=(60.0, -np.inf))

    decided, _ = live(StandIn(Says(says), 1, ask="always"), growing(1))
    asked, answer = decided[0]
    assert answer.limits == (60.0, -np.inf) and asked.policy(answer.policy).values[0] >= 60
    assert StandIn(Says(None), 1, written(decided)).limits == (60.0, -np.inf)


def test_who_asks_for_a_pair_gets_the_one_that_tells_most_this_once(growing):
    def says(question):
        if question.generation == 3 and question.form != "pair":
            raise AskPair
        return chooses(question)

    user = Says(says)
    decided, _ = live(StandIn(user, 1, ask="always"), growing(4))
    pairs, _ = live(StandIn(Says(chooses), 1, written(decided[:2]), ask="always", shows="pair"), growing(3)[2:])
    assert [asked.form for asked, _ in decided] == ["best", "best", "pair", "best"]
    assert as_seen(decided[2:3]) == as_seen(pairs)
    assert decided[2][1].ranking == best_first(decided[2][0])[:1]


def test_what_cannot_be_had_instead_is_an_error_that_says_so(growing, ask):
    def never(question):
        raise Skip

    def pair(question):
        raise AskPair

    question = growing(1)[0]
    for says, asked in ((never, replace(question, purpose="final")), (pair, replace(question, again=True))):
        with pytest.raises(AnswerError, match="neither be skipped"):
            StandIn(Says(says), 1, ask="always").decide(asked)
    for asked in (question, ask([[1, 2]])):
        with pytest.raises(AnswerError, match="no other pair"):
            StandIn(Says(pair), 1, ask="always").decide(asked)


def test_a_log_with_a_skipped_question_and_a_pair_is_replayed_as_it_was(growing, tmp_path):
    lived = StandIn(Says(varied), 3, ask="always")
    decided, _ = live(lived, growing(9))
    path = tmp_path / "decisions.jsonl"
    path.write_text("".join(to_json(record) + "\n" for record in written(decided)))
    replayed = StandIn(ScriptedUser(path), 3, ask="always")
    found, _ = live(replayed, growing(9))
    assert as_seen(found) == as_seen(decided)
    assert len(replayed.answers) == len(lived.answers)


def test_who_was_asked_about_a_pair_before_a_crash_is_not_asked_again(growing):
    def says(question):
        if question.form != "pair":
            raise AskPair
        return chooses(question)

    *past, last = growing(3)
    decided, previous = live(StandIn(Says(says), 3, ask="unsure"), [*past, last])
    before, ahead = decided[:-1], decided[-1:]
    later = StandIn(Remembered(Says(None), written(ahead)), 3, written(before), "unsure")
    found, _ = live(later, [last], before[-1][1].policy)
    assert as_seen(found) == as_seen(ahead)


# --- an answer that may be a mistake ------------------------------------------------------------------------------


@pytest.fixture
def mistaken(growing):
    """A stand-in after four answers and one against them, with that question and that answer."""

    def make(decides="unsure", **changes):
        decided, _ = live(StandIn(Says(chooses), 1, ask="always"), growing(4))
        question = replace(growing(5)[-1], previous=decided[-1][1].policy)
        answer = replace(Answer(best_first(question)[-1]), **changes)
        records = written([*decided, (question, answer)])
        return StandIn(Says(chooses), 1, records, decides), question, answer

    return make


def test_an_answer_against_all_earlier_ones_is_asked_again_as_a_pair(mistaken):
    stand_in, question, answer = mistaken()
    further: Any = stand_in.follow_up(question, answer)
    best, chosen = further.front
    worth = question.values @ np.array([0.3, 0.7])
    assert chosen.id == answer.policy
    assert worth.max() - best.values @ np.array([0.3, 0.7]) < 0.05 * np.ptp(worth)
    assert further.again and (further.purpose, further.generation) == (question.purpose, question.generation)
    assert {policy.id for policy in further.whole.front} == {policy.id for policy in question.front}


def test_who_says_so_twice_is_believed(mistaken):
    stand_in, question, answer = mistaken()
    further: Any = stand_in.follow_up(question, answer)
    stand_in.user = Says(lambda asked: answer)
    asked, second = stand_in.decide(further)
    assert second == answer and asked.front == further.front
    assert stand_in.follow_up(asked, second) is None


def test_who_corrects_themselves_is_not_asked_a_third_time(mistaken):
    stand_in, question, answer = mistaken()
    further: Any = stand_in.follow_up(question, answer)
    asked, second = stand_in.decide(further)
    assert second.policy == further.front[0].id and not second.stand_in
    assert stand_in.follow_up(asked, second) is None


def test_who_then_sees_no_difference_keeps_what_they_have_just_chosen(mistaken):
    stand_in, question, answer = mistaken()
    stand_in.user = Says(lambda asked: Answer(asked.front[0].id, equal=True))
    _, second = stand_in.decide(stand_in.follow_up(question, answer))
    assert second.equal and second.policy == answer.policy


@pytest.mark.parametrize("signs", [True, False])
def test_who_signs_names_the_result_however_clear_it_is(growing, monkeypatch, signs):
    monkeypatch.setitem(TRUSTED_REGRET, "final", 1.0)  # as clear as can be
    user = Says(chooses)
    user.signs = signs
    *steering, last = growing(9)
    stand_in = StandIn(user, 1)
    live(stand_in, steering)
    asked, answer = stand_in.decide(replace(last, purpose="final"))
    assert answer.stand_in != signs and (user.questions[-1] is asked) == signs
    assert TerminalUser.signs and Person.signs


@pytest.mark.parametrize("changes", [{"stand_in": True}, {"stop": True}])
def test_neither_a_stand_in_nor_who_ends_the_run_is_doubted(mistaken, changes):
    stand_in, question, answer = mistaken()
    assert stand_in.follow_up(question, replace(answer, **changes)) is None


def test_who_wants_to_be_asked_always_is_not_doubted(mistaken):
    stand_in, question, answer = mistaken("always")
    assert stand_in.follow_up(question, answer) is None


def test_what_agrees_with_the_other_answers_is_not_doubted(mistaken):
    stand_in, question, _ = mistaken()
    assert stand_in.follow_up(question, chooses(question)) is None


def test_a_first_answer_has_no_others_to_be_against(growing):
    question = growing(5)[-1]
    doubted = 0
    for policy in question.front:
        answer = Answer(policy.id)
        stand_in = StandIn(Says(lambda asked, answer=answer: answer), 1)
        asked, _ = stand_in.decide(question)
        expected = stand_in._model(asked).utilities(asked.values).mean(axis=0)
        doubted += expected.max() - expected[question.front.index(policy)] >= DOUBTED_REGRET
        assert stand_in.follow_up(asked, answer) is None
    assert doubted  # one answer may be taken for a random one


def test_a_pair_or_a_ranking_is_not_asked_again(mistaken):
    stand_in, question, answer = mistaken()
    for form in ("pair", "rank"):
        assert stand_in.follow_up(replace(question, form=form), answer) is None


def test_the_second_question_has_the_limits_of_the_first_answer(mistaken):
    stand_in, question, answer = mistaken(limits=(-np.inf, 0.0))
    further: Any = stand_in.follow_up(question, answer)
    assert further.limits == (-np.inf, 0.0)


class Errs(Counting):
    """The config's user, who once chooses the worst of all; `corrects` says whether they mend it when asked again."""

    def __init__(self, config, corrects):
        super().__init__(config)
        self.corrects = corrects
        self.wrong = None
        self.doubted = 0

    def answer(self, question):
        right = super().answer(question)
        self.doubted += question.again
        if question.again and not self.corrects:
            return Answer(self.wrong)
        if len(self.asked) == 3 and not question.again:
            self.wrong = question.whole.front[int(np.argmin(self.user.utility(question.whole.values)))].id
            return Answer(self.wrong)
        return right


@pytest.mark.parametrize("corrects", [True, False])
def test_a_run_takes_the_second_answer_and_counts_both_questions(config, corrects, tmp_path):
    user = Errs(config, corrects)
    *everything, last = run(config, user)
    events = decisions(everything)
    places = [place for place, event in enumerate(events) if event.question.again]
    assert len(places) == user.doubted >= 1
    first, second = events[places[0] - 1], events[places[0]]
    assert first.chosen.id == user.wrong and first.question.generation == second.question.generation
    assert (second.chosen.id == user.wrong) != corrects
    after: Any = events[places[0] + 1].question
    assert after.previous == second.chosen.id
    assert last.state.questions == len(user.asked) == sum(not event.answer.stand_in for event in events)
    log = tmp_path / "decisions.jsonl"
    log.write_text("".join(to_json(record_of(event.question, event.answer)) + "\n" for event in events))
    replayed = decisions(run(config, ScriptedUser(log)))
    assert [event.chosen.id for event in replayed] == [event.chosen.id for event in events]


def test_a_run_that_was_broken_off_between_two_answers_goes_on_with_the_second(config, tmp_path):
    whole = train(tmp_path / "whole", config, user=Errs(config, corrects=False))
    records = read_run(whole).decisions
    again = next(place for place, record in enumerate(records) if record.again)
    place = 1 + records[again].generation + again  # after so many events: the start, generations, answers
    path = train(tmp_path / "broken", config, user=Errs(config, corrects=False), events=place)
    left = read_run(path).decisions
    assert left == records[:again] and left[-1].policy == records[again].policy

    user = Errs(config, corrects=False)
    user.asked, user.wrong = [()] * 3, records[again].policy
    go_on(path, user=user)
    assert outcome(path) == outcome(whole)


def test_where_nothing_reaches_the_limits_the_user_is_asked(growing):
    """However often they have answered: what they want is not there."""

    def says(question):
        return Answer(question.front[0].id, limits=(1e6, -np.inf))

    user = Says(says)
    decided, _ = live(StandIn(user, 1), growing(8))
    assert len(user.questions) >= 8 and not any(answer.stand_in for _, answer in decided)


def test_another_user_of_a_branch_is_not_taken_for_the_first_one(whole, config, tmp_path):
    """Neither are earlier answers theirs, nor after the branch was broken off and resumed."""
    first = next(record for record in read_run(whole).decisions if record.stand_in)
    answered = []
    for name, spec in (("same", None), ("other", "weights=0,0,1")):
        with branch(whole, first.generation - 1, tmp_path / name, spec).folder:
            pass
        continued = resume(tmp_path / name)
        with continued.folder:
            answered.append(next(event.answer for event in continued.events() if isinstance(event, Decided)))
    assert [answer.stand_in for answer in answered] == [True, False]

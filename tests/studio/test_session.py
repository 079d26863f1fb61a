"""A run driven beside a page: what is answered, left, taken up and branched off, without any page."""

import json
import shutil

import numpy as np
import pytest

import envs
from jmorl.decision.answers import Answer, Choose
from jmorl.decision.scripted import ScriptedUser
from jmorl.search.policy import values_of
from jmorl.storage.afterwards import choose_afterwards
from jmorl.storage.lock import check_unlocked
from jmorl.storage.notes_file import Note
from jmorl.storage.resume import Continued, branch, resume
from jmorl.storage.run_folder import RunFolder
from jmorl.storage.stored_run import read_run
from tests.resuming import follow, outcome, train


def best(question, objective):
    return max(question.front, key=lambda policy: policy.values[objective]).id


def answer_all(session, objective=0):
    """Answer every question until the run ends. Return the answers."""
    return answer_all_from(session, session.question(), objective)


def answer_all_from(session, question, objective=0):
    """Answer a question, and every later one."""
    answers = []
    while True:
        answers.append(best(question, objective))
        assert session.answer(question, Answer(answers[-1]))
        if question.purpose == "final":
            session.ended()
            return answers
        question = session.question()


@pytest.fixture
def second(whole, tmp_path):
    """Copy a run that has ended, and make a branch of it in which a person decides; nobody has it open."""
    ended, waiting = shutil.copytree(whole, tmp_path / "more" / "ended"), tmp_path / "more" / "waiting"
    branch(ended, 2, waiting, user="terminal").folder.close()
    return waiting


def test_a_session_may_have_no_run_open(make_session, second):
    session = make_session()
    assert not session.is_open and session.history() == () and session.policy_file("any", 1) is None
    with pytest.raises(ValueError, match="no run is open"):
        _ = session.view
    with pytest.raises(ValueError, match="no run is open"):
        session.train_on(1)
    session.leave()
    session.open(second)
    assert session.is_open and session.question().generation == 3


def test_another_run_takes_the_place_of_the_open_one_which_can_be_taken_up(session, second):
    question, path = session.question(), session.view.path
    session.open(second)
    assert session.question().generation == 3 and session.open_folder == second
    assert not session.answer(question, Answer(question.front[0].id))
    check_unlocked(path)
    session.open(second.parent / "ended")
    assert session.view.result and session.view.question is None
    session.open(path)
    assert session.question().generation == question.generation


def test_a_run_that_cannot_be_opened_leaves_the_open_one_as_it_is(session, second):
    question = session.question()
    (second / "config.toml").unlink()
    with pytest.raises(ValueError, match=r"has lost its config.toml"):
        session.open(second)
    ended = second.parent / "ended"
    (ended / "policies.csv").unlink()
    with pytest.raises(ValueError, match=r"policies.csv"):
        session.open(ended)
    assert session.view.question is question and session.answer(question, Answer(question.front[0].id))


def test_a_run_that_cannot_be_shown_is_not_held(make_session, second, monkeypatch):
    def broken(path):
        raise ValueError("cannot be shown")

    monkeypatch.setattr("jmorl.studio.session.stored_view", broken)
    with pytest.raises(ValueError, match="cannot be shown"):
        make_session().open(second)
    check_unlocked(second)


def test_to_open_the_run_that_goes_on_changes_nothing(session):
    question = session.question()
    session.open(session.view.path)
    assert session.view.question is question


def test_what_is_being_opened_is_told_until_the_open_run_is_left(session, second, monkeypatch):
    session.question()
    leave, told, path = session.leave, [], session.view.path

    def leaving():
        told.append((session.opening, session.open_folder, session.held_folders))
        leave()

    monkeypatch.setattr(session, "leave", leaving)
    session.open(second)
    assert told == [("waiting", path, (path, second))]
    assert session.opening == "" and session.held_folders == (second,)


def test_a_new_run_takes_the_place_of_the_open_one_unless_it_cannot_begin(session, person_config, tmp_path):
    question = session.question()

    def wrong():
        raise ValueError("is wrong")

    with pytest.raises(ValueError, match="is wrong"):
        session.begin("new", wrong)
    assert session.view.question is question
    environment = envs.make(person_config.env)
    session.begin("new", lambda: Continued(RunFolder.create(tmp_path / "new", person_config, environment), None))
    assert session.question().generation == 1 and session.view.path == tmp_path / "new"


def test_nothing_is_opened_any_more_when_the_studio_is_closed(make_session, second):
    session = make_session()
    session.close()
    with pytest.raises(ValueError, match="being closed"):
        session.open(second)
    assert not session.is_open
    check_unlocked(second)


def test_a_run_steered_on_the_page_replays_from_its_log_to_the_same_result(session, person_config, tmp_path):
    answers = answer_all(session)
    view = session.view
    assert view.result.id == answers[-1] and view.timeline is None and view.question is None
    assert view.reason == "the budget of environment steps is used up"
    config = person_config.replace(user=f"script={view.path / 'decisions.jsonl'}")
    folder = RunFolder.create(tmp_path / "replayed", config, envs.make(config.env))
    replayed = outcome(follow(Continued(folder, None)))
    played = outcome(view.path)
    assert replayed[4] == played[4] and replayed[2][2] == played[2][2]
    assert (view.path / "plots").is_dir()


def test_early_agents_can_be_looked_at_in_the_warm_up_and_leave_nothing_behind(person_config, make_session, tmp_path):
    session, seen = make_session(), []
    show = session._show_early

    def show_early(agents):
        """Look around in the middle of the warm-up, as a page does."""
        show(agents)
        view = session.view
        with pytest.raises(ValueError, match="warm-up is still going on"):
            session.begin_dialogue(3, 3)
        seen.append((view, session.early_policy(view.run, 0), session.early_policy("another", 0)))

    session._show_early = show_early
    folder = RunFolder.create(tmp_path / "run", person_config, envs.make(person_config.env))
    session.drive(Continued(folder, None))
    session.question()
    [(view, agent, nobody)] = seen
    assert view.early and len(view.front) == person_config.population.agents and not view.choosable(0)
    np.testing.assert_allclose(agent.header["values"], view.front[0].values)
    assert nobody is None and not session.view.early and session.early_policy(view.run, 0) is None
    assert len(read_run(folder.path).policies) == person_config.population.agents


def test_the_first_answer_counts_and_the_second_is_told(session):
    question = session.question()
    first, second = question.front[0].id, question.front[-1].id
    assert session.answer(question, Answer(first))
    assert not session.answer(question, Answer(second))
    session.question()
    assert not session.answer(question, Answer(second))  # nor does it answer the next question
    line = json.loads((session.view.path / "decisions.jsonl").read_text())
    assert line["policy"] == first and session.view.previous.id == first


def test_a_policy_that_is_not_shown_is_no_answer_and_the_question_stays_open(session):
    question = session.question()
    with pytest.raises(ValueError, match="policy 99 is not among"):
        session.answer(question, Answer(99))
    assert session.view.question is question and session.answer(question, Answer(question.front[0].id))


def test_the_view_follows_the_run(session):
    question = session.question()
    first = session.view
    assert first.front == question.front == first.state.archive.members
    assert [generation.number for generation in first.generations] == [0]
    assert np.isneginf(first.bounds).all() and first.previous is None
    chosen = question.front[0]
    session.answer(question, Answer(chosen.id))
    question = session.question()
    second = session.view
    assert [generation.number for generation in second.generations] == [0, 1]
    np.testing.assert_array_equal(second.bounds, question.bounds)
    assert np.isfinite(second.bounds).all() and second.previous is chosen
    assert [generation for generation, _ in second.choices] == [1]
    np.testing.assert_array_equal(second.choices[0][1], chosen.values)
    np.testing.assert_array_equal(second.generations[-1].front, values_of(second.front))
    assert first.question is not None  # a record is never changed


def test_a_run_that_is_left_asks_its_open_question_again_and_no_other(session, make_session):
    first = session.question()
    session.answer(first, Answer(first.front[0].id))
    open_question = session.question()
    session.close()
    assert not session.answer(open_question, Answer(open_question.front[0].id))
    later = make_session()
    later.open(session.view.path)
    again = later.question()
    assert (again.generation, again.purpose) == (2, "steer")
    assert [policy.id for policy in again.front] == [policy.id for policy in open_question.front]
    assert later.view.previous.id == first.front[0].id
    assert [generation.number for generation in later.view.generations] == [0, 1]
    assert [generation for generation, _ in later.view.choices] == [1]


def test_stepping_back_begins_a_branch_and_the_run_left_behind_can_be_taken_up(session):
    for _ in range(2):
        question = session.question()
        session.answer(question, Answer(best(question, 0)))
    left = session.question()
    path, run = session.view.path, session.view.run
    session.step_back(run, 1)
    again = session.question()
    assert "another_user" not in json.loads((session.view.path / "manifest.json").read_text())["parent"]
    assert again.generation == 1 and session.view.path == path.with_name("run-2")
    assert session.view.previous is None and not session.view.choices
    session.answer(again, Answer(best(again, 2)))
    session.question()
    tree = session.history()
    assert [(each.name, each.depth, each.leaves_after) for each in tree] == [("run", 0, -1), ("run-2", 1, 0)]
    assert [[step.generation for step in each.steps] for each in tree] == [[1, 2], [1]]
    assert tree[0].steps[0].policy != tree[1].steps[0].policy
    assert 0 in tree[1].checkpoints
    session.switch(run)
    back = session.question()
    assert back.generation == 3 and [p.id for p in back.front] == [p.id for p in left.front]
    assert session.view.path == path
    session.step_back(run, 3)
    assert session.question().generation == 3 and session.view.path == path.with_name("run-3")


def test_of_two_that_step_back_at_once_the_second_is_told(session, monkeypatch):
    question, told = session.question(), []
    leave = session.leave

    def meanwhile():
        with pytest.raises(ValueError, match="run-2 is just being opened"):
            session.step_back(session.view.run, 1)
        told.append(True)
        leave()

    monkeypatch.setattr(session, "leave", meanwhile)
    session.step_back(session.view.run, question.generation)
    assert told and session.question().generation == 1
    monkeypatch.undo()
    assert [branch.name for branch in session.history()] == ["run", "run-2"]


def test_only_runs_of_the_history_can_be_opened(session):
    session.question()
    with pytest.raises(ValueError, match="no run of this history"):
        session.switch("../elsewhere")
    with pytest.raises(ValueError, match="no run of this history"):
        session.step_back("another", 1)
    assert session.view.question is not None  # and nothing was left


def test_files_are_found_by_run_and_number_alone(session):
    question = session.question()
    policy = question.front[0].id
    assert session.policy_file(session.view.run, policy).name == f"{policy:05d}.npz"
    assert session.policy_file(session.view.run, 9999) is None
    assert session.policy_file("..", policy) is None


def test_going_on_in_silence_and_stopping(session):
    question = session.question()
    session.answer(question, Answer(question.front[0].id, generations=2))
    question = session.question()
    assert question.generation == 3
    session.answer(question, Answer(question.front[0].id, stop=True))
    session.ended()
    assert session.view.reason == "the user ended it" and session.view.result.id == question.front[0].id


def test_a_finished_run_is_shown_and_can_be_branched_off(session, make_session):
    answer_all(session)
    path = session.view.path
    session.close()
    later = make_session()
    later.open(path)
    assert later.view.timeline is None and later.view.result.id == session.view.result.id
    np.testing.assert_allclose(values_of(later.view.front), values_of(session.view.front))
    for shown, lived in zip(later.view.generations, session.view.generations, strict=True):
        np.testing.assert_allclose(np.sort(shown.front, axis=0), np.sort(lived.front, axis=0))
        np.testing.assert_allclose(shown.hypervolume, lived.hypervolume)
    later.step_back(later.view.run, 2)
    assert later.question().generation == 2
    assert read_run(path).result is not None  # it stays as it was


def test_a_finished_run_whose_script_is_gone_is_shown_and_stepped_back_in(whole, small_config, make_session, tmp_path):
    script = shutil.copyfile(whole / "decisions.jsonl", tmp_path / "script.jsonl")
    path = train(tmp_path / "run", small_config.replace(user=f"script={script}"))
    script.unlink()
    session = make_session()
    session.open(path)
    assert session.view.result
    session.step_back(session.view.run, 2)
    assert session.question().generation == 2


def test_a_run_with_an_artificial_user_is_watched(small_config, make_session, tmp_path):
    session = make_session()
    folder = RunFolder.create(tmp_path / "run", small_config, envs.make(small_config.env))
    session.drive(Continued(folder, None))
    session.ended()
    assert session.view.result and session.asked.empty()
    assert all(generation.utility is not None for generation in session.view.generations)


def test_what_a_choice_would_mean_is_worked_out_once_for_each_question(session):
    question = session.question()
    chosen = question.front[-1]
    for policy in (chosen.id, chosen.id, 12345):  # there is no such policy
        session.work_out(policy)
    session.thought()
    prospects = session.prospects
    assert set(prospects) == {chosen.id}
    session.work_out(chosen.id)
    session.thought()
    assert session.prospects is prospects
    session.answer(question, Answer(chosen.id))
    session.question()
    assert not session.prospects
    np.testing.assert_array_equal(session.view.bounds, prospects[chosen.id].bounds)


def test_who_wants_to_be_asked_is_asked_before_the_next_generation_and_it_replays(session, person_config, tmp_path):
    question = session.question()
    session.ask_now()
    assert session.view.asking == "question" and session.view.rounds_to_question == 1
    session.answer(question, Answer(best(question, 0), generations=3))
    question = session.question()
    assert (question.generation, question.purpose, session.view.asking) == (2, "steer", None)
    answers = [best(question, 2)]
    session.answer(question, Answer(answers[0]))
    answers += answer_all(session, objective=2)
    config = person_config.replace(user=f"script={session.view.path / 'decisions.jsonl'}")
    folder = RunFolder.create(tmp_path / "replayed", config, envs.make(config.env))
    replayed = outcome(follow(Continued(folder, None)))
    assert replayed[4] == outcome(session.view.path)[4]


def test_a_run_is_ended_between_two_questions(session):
    question = session.question()
    policy = best(question, 0)
    session.end_with(policy)
    assert session.view.asking == "end"
    session.answer(question, Answer(policy, generations=3))
    session.ended()
    assert session.view.result.id == policy and session.view.reason == "the user ended it"
    assert session.view.generations[-1].number == 1


def test_a_paused_run_goes_on(session):
    question = session.question()
    session.answer(question, Answer(best(question, 0), generations=3))
    session.leave()
    assert session.view.timeline is None and session.view.result is None and not session.leaving
    session.switch(session.view.run)
    question = session.question()
    assert question.generation in (2, 3, 4)


def test_a_run_that_has_ended_is_trained_on_in_a_branch(session):
    answer_all(session)
    path, last = session.view.path, session.view.generations[-1]
    session.train_on(2)
    question = session.question()
    assert session.view.path == path.with_name("run-2")
    assert (question.purpose, question.generation) == ("steer", last.number + 1)
    assert session.view.timeline.left == 2
    answer_all_from(session, question)
    assert session.view.generations[-1].number == last.number + 2
    assert read_run(path).result is not None  # it stays as it was


def test_a_run_that_goes_on_is_not_trained_on(session):
    question = session.question()
    with pytest.raises(ValueError, match="has not ended"):
        session.train_on(1)
    assert session.view.question is question


def test_enautilus_in_a_finished_run_is_what_the_command_would_have_been_led_to(session):
    answer_all(session)
    session.begin_dialogue(3, 2)
    while not session.dialogue.chosen:
        at = session.dialogue
        assert session.reply(at, Choose(len(at.question.points) - 1))
        assert not session.reply(at, Choose(0))  # another tab was first
    chosen, path = session.dialogue.chosen, session.view.path
    assert json.loads((path / "enautilus.json").read_text())["policy"] == chosen.id
    stored = read_run(path)
    assert choose_afterwards(stored, ScriptedUser(path / "enautilus.jsonl"), 3, 2).id == chosen.id


def test_the_last_answer_of_enautilus_can_be_taken_back_at_its_end(session):
    answer_all(session)
    session.begin_dialogue(1, 2)
    before = session.dialogue
    session.reply(before, Choose(0))
    assert session.dialogue.chosen
    session.undo_reply()
    assert session.dialogue is before
    session.close_dialogue()
    assert session.dialogue is None


def test_what_breaks_a_run_off_is_said(person_config, make_session, tmp_path, monkeypatch):
    session = make_session()
    folder = RunFolder.create(tmp_path / "run", person_config, envs.make(person_config.env))

    def full(event):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(folder, "record", full)
    session.drive(Continued(folder, None))
    session.ended()
    assert "No space left on device" in session.view.problem and session.view.timeline is None
    continued = resume(session.view.path)
    continued.folder.close()
    assert continued.state is None


def test_notes_are_kept_while_the_run_goes_on_and_no_change_of_either_is_lost(session):
    question = session.question()
    run, policies = session.view.run, [policy.id for policy in question.front]
    session.answer(question, Answer(policies[0], generations=3))
    for name in map(str, range(20)):
        for policy in policies:
            session.note(run, policy, name=name, favourite=True)
    question = session.question()
    assert [generation.number for generation in session.view.generations] == [0, 1, 2, 3]
    assert session.view.question is question
    assert {policy: note.name for policy, note in session.view.noted.policies.items()} == dict.fromkeys(policies, "19")
    assert session.view.noted == read_run(session.view.path).notes


def test_a_run_that_has_ended_can_be_noted_and_stays_as_it_is(session, make_session):
    answer_all(session)
    path, before = session.view.path, outcome(session.view.path)
    session.note(session.view.run, session.view.result.id, name="the one", favourite=True)
    assert session.view.result and session.view.noted.policy(session.view.result.id).name == "the one"
    session.close()
    later = make_session()
    later.open(path)
    assert later.view.noted == session.view.noted and later.view.result.id == session.view.result.id
    after = outcome(path)
    assert after[0] - before[0] == {"notes.json"} and after[1:] == before[1:]


def test_only_what_is_in_the_history_can_be_noted(session):
    question = session.question()
    for run, policy, message in (
        ("../elsewhere", None, "no run of this history"),
        (session.view.run, 9999, "there is no policy 9999"),
        (session.view.run, -1, "there is no policy -1"),
    ):
        with pytest.raises(ValueError, match=message):
            session.note(run, policy, name="x")
    assert not (session.view.path / "notes.json").exists() and session.view.question is question


def test_a_branch_begins_with_the_notes_about_what_it_shares(session):
    question = session.question()
    first, run = question.front[0].id, session.view.run
    session.note(run, first, name="careful one", favourite=True)
    session.note(run, None, name="the first way")
    session.answer(question, Answer(first))
    question = session.question()
    later = next(policy.id for policy in question.front if policy.generation == 1)
    session.note(run, later, favourite=True)
    session.step_back(run, 1)
    session.question()
    assert session.view.noted.policies == {first: Note("careful one", favourite=True)}
    assert not session.view.noted.run.name
    session.note(session.view.run, first, name="slow one")
    session.switch(run)
    session.question()
    assert session.view.noted.policy(first).name == "careful one" and session.view.noted.favourites == [first, later]

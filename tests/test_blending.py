"""Blending the front of a run: what joins it, what it leaves behind, and where it is taken up again."""

import csv
import json
import shutil
from dataclasses import replace

import jax
import numpy as np
import pytest

import envs
from jmorl import blending
from jmorl.cli import main
from jmorl.config import ConfigError
from jmorl.decision.users import make_user
from jmorl.evaluation import evaluate_stored, export_blend
from jmorl.events import Blended, Decided, GenerationFinished, RunFinished
from jmorl.learning.population import Population
from jmorl.loop import run
from jmorl.report.families_plot import families_figure
from jmorl.report.plots import draw_run
from jmorl.report.progress import watcher
from jmorl.search.pareto import non_dominated
from jmorl.search.policy import Blend
from jmorl.storage import resume as resuming
from jmorl.storage.afterwards import choose_afterwards
from jmorl.storage.layout import Layout
from jmorl.storage.policy_file import PolicyFileError, load_policy
from jmorl.storage.resume import CannotContinue, blend, branch
from jmorl.storage.stored_run import StoredRunError, read_run
from tests.resuming import follow, go_on, outcome, train

MOST = 3


@pytest.fixture(scope="module")
def plain(small_config):
    """A run that trains long enough for a front with something between its policies."""
    return small_config.replace(
        population={"warmup_iterations": 20, "iterations": 20},
        ppo={"rollout_steps": 32},
        evaluation={"episodes": 32},
        search={"least_within": 3},  # so that the last question is about the whole front
        steps=4 * 3 * 32 * 79,
    )


@pytest.fixture(scope="module")
def config(plain):
    """The same, but its front is blended before the last question."""
    return plain.replace(search={"final_blends": MOST})


@pytest.fixture(scope="module")
def whole(plain, tmp_path_factory):
    """The folder of the run that blends nothing."""
    return train(tmp_path_factory.mktemp("runs") / "whole", plain)


@pytest.fixture(scope="module")
def events(config):
    return list(run(config))


@pytest.fixture(scope="module")
def blended(whole, tmp_path_factory):
    """A run whose front was blended after its end, and what that found."""
    path = shutil.copytree(whole, tmp_path_factory.mktemp("runs") / "blended")
    return path, blend(path)


def test_blends_join_the_front_with_scores_of_fresh_episodes(blended):
    path, event = blended
    assert event.blending.blends and event.offspring == event.blending.blends
    front = event.state.archive
    assert non_dominated(front.values).all() and set(event.offspring) <= set(front.members)
    for policy in event.offspring:
        assert policy.parent is None and policy.confirmation.episodes >= 100
        assert sum(policy.blend.coefficients) == pytest.approx(1) and min(policy.blend.coefficients) >= -1
        assert {*policy.blend.parents} <= {each.id for each in event.blending.front}
        assert policy.weights.sum() == pytest.approx(1) and (policy.weights >= 0).all()
    assert event.front.hypervolume > event.before.hypervolume
    assert event.steps == read_run(path).metrics["steps"][-2]  # nothing was trained


def test_the_file_of_a_blend_scores_what_it_claims(blended):
    path, event = blended
    for policy in event.offspring:
        stored = load_policy(Layout(path).policy(policy.id))
        assert stored.header["blend"]["parents"] == list(policy.blend.parents)
        assert stored.header["values"] == policy.values.tolist()
        returns = np.asarray(evaluate_stored(stored, jax.random.split(jax.random.key(9), 200)).undiscounted, float)
        error = returns.std(axis=0) / np.sqrt(200) + policy.std / np.sqrt(policy.confirmation.episodes)
        assert (np.abs(returns.mean(axis=0) - policy.values) <= 4 * error + 1e-4).all()


def test_links_are_half_way_between_neighbours(blended):
    _, event = blended
    blending = event.blending
    families = [set(family) for family in blending.families]
    assert sorted(id for family in families for id in family) == sorted(policy.id for policy in blending.front)
    assert blending.links
    for link in blending.links:
        together = any({*link.ends} <= family for family in families)
        assert together or not link.holds


def test_the_run_folder_has_another_generation_and_the_result_as_it_was(blended, whole):
    path, event = blended
    before, after = read_run(whole), read_run(path)
    assert after.result == before.result and len(after.metrics["steps"]) == len(before.metrics["steps"]) + 1
    assert len(after.policies) == len(before.policies) + len(event.offspring)
    assert [str(policy.blend) for policy in after.policies[len(before.policies) :]] == [
        str(policy.blend) for policy in event.offspring
    ]
    assert [policy.id for policy in after.front] == [policy.id for policy in event.state.archive.members]
    families = json.loads(Layout(path).families.read_text())
    assert families["families"] == event.blending.families and len(families["links"]) == len(event.blending.links)
    with Layout(path).policies.open() as file:
        assert all(bool(row["blend"]) == (row["generation"] == "4") for row in csv.DictReader(file))


def test_the_same_run_blends_the_same(blended, whole, tmp_path):
    path = shutil.copytree(whole, tmp_path / "again")
    event = blend(path)
    assert [vars(policy)["blend"] for policy in event.offspring] == [policy.blend for policy in blended[1].offspring]
    np.testing.assert_array_equal(event.state.archive.values, blended[1].state.archive.values)


@pytest.mark.parametrize("done", ["policies", "metrics", "front"])
def test_a_process_that_was_killed_while_it_blended_leaves_a_run_that_can_be_read_and_blended(
    blended, whole, tmp_path, done
):
    """Files are written one after the other, the checkpoint last."""
    path = shutil.copytree(whole, tmp_path / "killed")
    source = Layout(blended[0])
    names = ["policies.csv", "metrics.csv", "front.csv"]
    for name in names[: ["policies", "metrics", "front"].index(done) + 1]:
        shutil.copyfile(source.root / name, path / name)
    assert read_run(path).result
    blend(path)
    assert outcome(path)[:4] == outcome(blended[0])[:4]


def test_a_blended_front_is_blended_further_and_branched_off(blended, tmp_path):
    path = shutil.copytree(blended[0], tmp_path / "twice")
    further = blend(path, 2)
    assert len(further.offspring) <= 2 and further.state.blendings == 2
    assert read_run(path).metrics["generation"][-1] == 5
    continued = branch(path, 4, tmp_path / "branch")
    members = {policy.id: policy for policy in continued.state.archive.members}
    for policy in blended[1].offspring:
        assert members[policy.id].blend == policy.blend
        for name, value in vars(policy.confirmation).items():
            np.testing.assert_array_equal(getattr(members[policy.id].confirmation, name), value)
    assert follow(continued).exists() and read_run(tmp_path / "branch").result


def test_blends_are_among_what_e_nautilus_leads_to(blended):
    path, event = blended
    stored = read_run(path)
    chosen = choose_afterwards(stored, make_user(stored.config.user, stored.objectives), 3, 3)
    assert {policy.id for policy in event.offspring} <= {policy.id for policy in stored.front}
    assert chosen in stored.front and Layout(path).policy(chosen.id).exists()


def test_a_run_blends_before_its_last_question(events, plain):
    kinds = [type(event) for event in events]
    assert kinds.count(Blended) == 1 and kinds[-3:] == [Blended, Decided, RunFinished]
    found = events[-3]
    assert len(found.offspring) <= MOST and found.state.generation == 4 and found.training["policy_loss"] is None
    ids = {policy.id for policy in events[-2].question.front}
    assert {policy.id for policy in found.offspring} <= ids
    unblended = [each for each in run(plain) if isinstance(each, GenerationFinished)]
    trained = [each for each in events if isinstance(each, GenerationFinished)][:-1]
    for one, other in zip(unblended, trained, strict=True):
        np.testing.assert_array_equal(one.state.archive.values, other.state.archive.values)


@pytest.fixture(scope="module")
def ended(config, tmp_path_factory):
    """The folder of the run that blends before its last question."""
    return train(tmp_path_factory.mktemp("runs") / "ended", config)


@pytest.mark.parametrize("events_before", [8, 9, 10])  # before the blending, after it, and after the last answer
def test_a_run_that_blends_ends_the_same_wherever_it_is_broken_off(config, ended, tmp_path, events_before):
    path = train(tmp_path / "run", config, events=events_before)
    go_on(path)
    assert outcome(path) == outcome(ended)


def test_where_no_blend_is_confirmed_the_front_stays(whole, tmp_path, monkeypatch):
    def much_worse(policies, *_, **__):
        return [replace(policy, values=policy.values - 1e6) for policy in policies], 1

    monkeypatch.setattr(blending, "confirmed", much_worse)
    path = shutil.copytree(whole, tmp_path / "run")
    event, before, after = blend(path), read_run(whole), read_run(path)
    assert event.offspring == () and [each.id for each in after.front] == [each.id for each in before.front]
    assert len(after.policies) == len(before.policies)
    assert len(after.metrics["steps"]) == len(before.metrics["steps"]) + 1


@pytest.mark.parametrize("kind", ["lines", "json"])
def test_watchers_tell_of_it(config, events, kind, capsys):
    from jmorl.display.console import PlainConsole

    with watcher(kind, config, envs.make(config.env).objectives, PlainConsole()) as watching:
        for event in events:
            watching.show(event)
    said = capsys.readouterr().out
    if kind == "lines":
        assert f"{len(events[-3].offspring)} of {events[-3].blending.tried} blends joined the front" in said
    else:
        [fields] = [json.loads(line) for line in said.splitlines() if json.loads(line)["event"] == "blended"]
        assert fields["families"] == events[-3].blending.families and fields["policy_loss"] is None
        assert len(fields["blends"]) == len(events[-3].offspring)


def test_on_the_command_line(whole, tmp_path, capsys):
    path = shutil.copytree(whole, tmp_path / "run")
    assert main(["blend", str(path), "--blends", "2"]) == 0
    said = capsys.readouterr().out
    assert "largest gap between the ends" in said and "Families" in said and "Blends that joined" in said
    assert main(["blend", str(path), "--blends", "1", "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)) == {"tried", "families", "links", "blends"}
    assert main(["show", str(path)]) == 0
    assert "blend " in capsys.readouterr().out


def test_a_run_that_has_not_ended_is_not_blended(whole, tmp_path, capsys):
    path = shutil.copytree(whole, tmp_path / "run")
    Layout(path).result.unlink()
    assert main(["blend", str(path)]) == 2
    assert f"has not ended; first go on with it: jmorl resume {path}" in capsys.readouterr().err


@pytest.fixture
def front_of(monkeypatch):
    """Have the state that is found in a folder so many policies in its front."""

    def cut(count):
        original = resuming.last_good

        def few(*arguments):
            found, notes = original(*arguments)
            assert found is not None
            checkpoint, state = found
            members = state.archive.members[:count]
            return (checkpoint, replace(state, archive=replace(state.archive, members=members))), notes

        monkeypatch.setattr(resuming, "last_good", few)

    return cut


def test_a_front_of_one_policy_is_not_blended(whole, tmp_path, front_of):
    path = shutil.copytree(whole, tmp_path / "run")
    front_of(1)
    with pytest.raises(CannotContinue, match="has one policy, and so nothing to blend it with"):
        blend(path)
    assert outcome(path) == outcome(whole)


def test_a_run_whose_last_checkpoint_is_damaged_is_not_cut_back(whole, tmp_path):
    path = shutil.copytree(whole, tmp_path / "run")
    document = path / "checkpoints" / "00003" / "checkpoint.json"
    document.write_bytes(document.read_bytes() + b"x")
    with pytest.raises(CannotContinue, match="no whole checkpoint of its end.*checkpoint.json is damaged"):
        blend(path)
    assert outcome(path)[1:] == outcome(whole)[1:]


def test_a_front_of_two_grows_beyond_its_ends(whole, tmp_path, monkeypatch, front_of):
    path = shutil.copytree(whole, tmp_path / "run")
    front_of(2)
    monkeypatch.setattr(resuming, "_restore", lambda _, found, __: found[1])
    event = blend(path)
    assert event.blending.tried > 3


@pytest.mark.parametrize("call", [0, -1])
def test_a_blend_whose_numbers_are_not_finite_stops_nothing(whole, tmp_path, monkeypatch, call):
    """Neither where it is tried, nor where it is scored again."""
    calls = []
    original = Population.try_out

    def broken(self, train_states, keys):
        returns = original(self, train_states, keys)
        calls.append(keys)
        if call == 0 or len(calls) > 20:  # by then blends are confirmed
            undiscounted = np.array(returns.undiscounted)
            undiscounted[0] = np.nan
            returns = returns._replace(undiscounted=undiscounted)
        return returns

    monkeypatch.setattr(Population, "try_out", broken)
    event = blend(shutil.copytree(whole, tmp_path / "run"))
    assert len(calls) > 20
    assert all(np.isfinite(policy.values).all() for policy in event.offspring)


@pytest.mark.parametrize("coefficients", [(0.5, 0.1), ()])
def test_shares_that_are_no_blend_are_refused_in_python_too(blended, tmp_path, coefficients):
    path, event = blended
    ids = tuple(policy.id for policy in event.blending.front[:2])[: len(coefficients)]
    with pytest.raises(PolicyFileError, match="add up to one"):
        export_blend(str(path), Blend(ids, coefficients), str(tmp_path / "x.npz"))


def test_at_least_one_blend_must_be_allowed(whole):
    with pytest.raises(ValueError, match="at least one blend"):
        blend(whole, 0)


def test_there_are_no_blends_in_paper_units(small_config):
    with pytest.raises(ConfigError, match="search: final_blends must be 0 in paper units"):
        small_config.replace(evaluation={"units": "paper"}, search={"final_blends": 1})


def test_any_blend_is_exported_with_a_score_of_its_own(blended, tmp_path, capsys):
    path, event = blended
    ids = sorted(policy.id for policy in event.blending.front)[:2]
    target = tmp_path / "out.npz"
    assert main(["export", str(path), "--blend", f"{ids[1]}:3,{ids[0]}:1", "--to", str(target)]) == 0
    said = capsys.readouterr().out
    assert f"blend {ids[0]}:0.25 {ids[1]}:0.75" in said
    stored = load_policy(target)
    assert stored.header["id"] is None and stored.header["evaluation_episodes"] == 100
    returns = np.asarray(evaluate_stored(stored, jax.random.split(jax.random.key(5), 200)).undiscounted, float)
    error = returns.std(axis=0) / 10 + 1e-4
    assert (np.abs(returns.mean(axis=0) - stored.header["values"]) <= 4 * error).all()
    assert main(["evaluate", str(target), "--episodes", "2"]) == 0
    assert "Blend " in capsys.readouterr().out


def test_the_end_of_a_blend_is_its_policy(blended, tmp_path):
    path, event = blended
    policy = event.blending.front[0]
    target = tmp_path / "out.npz"
    assert main(["export", str(path), "--blend", f"{policy.id}:1", "--to", str(target)]) == 0
    one, other = load_policy(target), load_policy(Layout(path).policy(policy.id))
    for ours, theirs in zip(one.layers, other.layers, strict=True):
        np.testing.assert_array_equal(ours[0], theirs[0])
    np.testing.assert_array_equal(one.observation_mean, other.observation_mean)


@pytest.mark.parametrize("written", ["", "12", "12:x", "12:1,12:2", "1:1,2:-1", "1:nan,2:1"])
def test_a_blend_that_makes_no_sense_is_refused(whole, tmp_path, written, capsys):
    with pytest.raises(SystemExit):
        main(["export", str(whole), "--blend", written, "--to", str(tmp_path / "x.npz")])
    assert "is no blend: give ids with shares, such as 12:0.4,15:0.6" in capsys.readouterr().err


def test_a_blend_of_a_policy_that_is_not_there_says_so(whole, tmp_path, capsys):
    assert main(["export", str(whole), "--blend", "99:1,0:1", "--to", str(tmp_path / "x.npz")]) == 2
    assert "has no policy" in capsys.readouterr().err and not (tmp_path / "x.npz").exists()


def test_policies_that_do_not_fit_are_not_mixed(blended):
    from jmorl.storage.blend_file import mix

    path, event = blended
    first, second = (load_policy(Layout(path).policy(policy.id)) for policy in event.blending.front[:2])
    second = replace(second, header=second.header | {"environment": "mo-halfcheetah-v5"})
    with pytest.raises(PolicyFileError, match="cannot be blended"):
        mix([first, second], Blend((0, 1), (0.5, 0.5)))


def test_families_are_drawn(blended, whole, tmp_path):
    """A line for each link, by way of the blend half-way where it holds; a ring for each blend that joined."""
    path, event = blended
    run, before = read_run(path), read_run(whole)
    assert families_figure(before, "title") is None
    figure = families_figure(run, "title")
    assert figure is not None
    first = figure.axes[0]
    solid = [line for line in first.get_lines() if line.get_linestyle() == "-"]
    dotted = [line for line in first.get_lines() if line.get_linestyle() == ":"]
    links = event.blending.links
    assert (len(solid), len(dotted)) == (sum(link.holds for link in links), sum(not link.holds for link in links))
    assert len(figure.axes) == 3  # pairs of objectives
    rings, dots = first.collections
    assert len(np.asarray(rings.get_offsets())) == len(event.offspring)
    assert len(np.asarray(dots.get_offsets())) == len(event.blending.front)
    assert tmp_path / "families.png" in draw_run(run, tmp_path)


def test_a_file_of_families_that_does_not_fit_is_named(blended, tmp_path):
    path = shutil.copytree(blended[0], tmp_path / "run")
    file = Layout(path).families
    document = json.loads(file.read_text())
    document["links"][0]["ends"] = [0, 999]
    file.write_text(json.dumps(document))
    with pytest.raises(StoredRunError, match="families.json speaks of what .*policies.csv does not have"):
        read_run(path)
    file.write_text("{}")
    with pytest.raises(StoredRunError, match="families.json"):
        read_run(path)

"""What is kept of a run: all of it comes back, and who was where in each generation is as the run had it."""

import json
import shutil

import numpy as np
import pytest

import envs
from jmorl.events import GenerationFinished
from jmorl.experiments.record import (
    RecordError,
    broken_record,
    is_record_of,
    memberships,
    read_record,
    record_of,
    write_record,
)
from jmorl.storage.resume import Continued
from jmorl.storage.run_folder import RunFolder
from jmorl.storage.stored_run import read_run

VARIANTS = {
    "raw": {},
    "paper": {
        "evaluation": {"units": "paper", "actions": "sampled"},
        "search": {"value_scale": "none", "bounds_scale": "one", "gain_within": "front"},
        "reference_point": (-110.0, -110.0, -110.0),
    },
    "reference": {"search": {"value_scale": "none", "buffer_size": 1, "buffer_bins": 6}},
}


@pytest.fixture(scope="module", params=VARIANTS)
def run(request, small_config, tmp_path_factory):
    """A run's folder, its config and its generations."""
    config = small_config.replace(**VARIANTS[request.param])
    path = tmp_path_factory.mktemp("runs") / request.param
    continued = Continued(RunFolder.create(path, config, envs.make(config.env)), None)
    with continued.folder:
        events = list(continued.events())
    return path, config, [event for event in events if isinstance(event, GenerationFinished)]


def test_archive_and_buffer_of_every_generation_are_reconstructed(run):
    path, _, generations = run
    expected = [
        (
            tuple(policy.id for policy in event.state.archive.members),
            tuple(policy.id for policy in event.state.search.buffer.members),
        )
        for event in generations
    ]
    assert list(memberships(read_run(path))) == expected
    assert len(set(expected)) > 1


def test_a_record_says_what_the_run_did(run):
    path, config, generations = run
    record = record_of(read_run(path))
    assert record.steps.tolist() == [event.steps for event in generations]
    assert [each.candidates for each in record.generations] == [event.candidates for event in generations]
    policies = [policy for event in generations for policy in event.offspring]
    np.testing.assert_allclose(record.values, [policy.values for policy in policies], rtol=1e-6)
    raw = [policy.values if policy.raw is None else policy.raw for policy in policies]
    np.testing.assert_allclose(record.raw, raw, rtol=1e-6)
    assert [question.generation for question in record.questions] == [1, 2, 3, 4]
    np.testing.assert_allclose(record.bounds(3), generations[3].bounds, rtol=1e-6)
    units = generations[-1].state.units
    expected = [None] * 3 if units is None else pytest.approx(units.deviation.tolist(), rel=1e-6)
    assert list(record.generations[-1].sigma) == expected
    assert record.fault is None
    for policy, kept in zip(policies, record.policies, strict=True):
        assert kept.discounted == (None if units is None else pytest.approx(policy.discounted.tolist(), rel=1e-6))


def test_a_record_comes_back_from_its_file(run, tmp_path):
    path, config, _ = run
    record = record_of(read_run(path))
    file = tmp_path / "deeper" / "record.json"
    write_record(file, record)
    assert read_record(file) == record
    assert is_record_of(file, config)
    assert not is_record_of(file, config.replace(seed=9))
    assert not is_record_of(tmp_path / "nothing.json", config)
    assert file.stat().st_size < 20_000


def test_what_is_no_record_is_named(run, tmp_path):
    path, _, _ = run
    file = tmp_path / "record.json"
    write_record(file, record_of(read_run(path)))
    text = file.read_text()
    file.write_text(text[: len(text) // 2])
    with pytest.raises(RecordError, match="record.json is not the record of a run"):
        read_record(file)
    file.write_text(text.replace('"format": 1', '"format": 2'))
    with pytest.raises(RecordError, match="format 2, not 1"):
        read_record(file)


def test_a_record_from_before_later_fields_is_read(run, tmp_path):
    path, _, _ = run
    file = tmp_path / "record.json"
    write_record(file, record_of(read_run(path)))
    fields = json.loads(file.read_text())
    del fields["fault"]
    for policy in fields["policies"]:
        del policy["discounted"]
    file.write_text(json.dumps(fields))
    record = read_record(file)
    assert record.fault is None and {policy.discounted for policy in record.policies} == {None}


def test_what_a_run_had_when_it_broke_down_is_kept(run, tmp_path):
    path, config, generations = run
    copy = shutil.copytree(path, tmp_path / "copy")
    (copy / "result.json").unlink()
    record = broken_record(copy, config, "agent 1: loss is not finite")
    assert (record.reason, record.chosen, record.fault) == ("broke down", None, "agent 1: loss is not finite")
    assert record.total_steps == generations[-1].steps and record.digest == config.identity()
    (copy / "metrics.csv").unlink()
    nothing = broken_record(copy, config, "agent 1: loss is not finite")
    assert (nothing.total_steps, nothing.total_seconds, nothing.objectives) == (0, 0.0, record.objectives)
    write_record(tmp_path / "record.json", nothing)
    assert read_record(tmp_path / "record.json") == nothing


def test_an_unfinished_run_has_no_record(run, tmp_path):
    copy = shutil.copytree(run[0], tmp_path / "copy")
    (copy / "result.json").unlink()
    with pytest.raises(RecordError, match="has not ended"):
        record_of(read_run(copy))

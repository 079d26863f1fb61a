"""Runs are made, interrupted, taken up again and made together; each leaves the record that it leaves alone."""

import threading

import numpy as np
import pytest

from jmorl.events import GenerationFinished
from jmorl.experiments.cells import Cell, Places, distinct, groups, known, missing
from jmorl.experiments.record import RecordError, read_record
from jmorl.experiments.runner import make

VARIANTS = {
    "raw": {},
    "paper": {"evaluation": {"units": "paper", "actions": "sampled"}, "search": {"value_scale": "none"}},
}


def places(folder):
    return Places(folder / "records", folder / "work")


def ignore(*_):
    pass


@pytest.fixture(scope="module")
def cells(small_config):
    """Two short runs in each kind of units."""
    short = small_config.replace(steps=4 * 3 * 16 * 6)  # a warm-up and two generations
    return {
        units: [Cell(f"{units}-seed-{seed}", short.replace(seed=seed, **changes)) for seed in (1, 2)]
        for units, changes in VARIANTS.items()
    }


@pytest.fixture(scope="module")
def alone(cells, tmp_path_factory):
    """The places of the runs, each made alone."""
    made = places(tmp_path_factory.mktemp("alone"))
    for cell in (cell for some in cells.values() for cell in some):
        make([cell], made, ignore)
    return made


def test_what_is_made_is_known_and_no_longer_missing(cells, alone, tmp_path):
    one, other = cells["raw"]
    assert missing([one, other], alone) == []
    assert known([one, other], alone) == {cell.key: read_record(alone.record(cell)) for cell in (one, other)}
    changed = Cell(one.key, one.config.replace(seed=9))
    assert missing([changed, other], alone) == [changed] and list(known([changed, other], alone)) == [other.key]
    assert missing([one], places(tmp_path)) == [one] and known([one], places(tmp_path)) == {}


def test_a_file_that_is_no_record_is_named_and_not_replaced(cells, tmp_path):
    here = places(tmp_path)
    here.records.mkdir()
    here.record(cells["raw"][0]).write_text("[]")
    with pytest.raises(RecordError, match="raw-seed-1.json is not the record of a run"):
        missing(cells["raw"], here)


@pytest.mark.parametrize("units", VARIANTS)
def test_an_interrupted_run_goes_on_to_the_same_record(cells, alone, tmp_path, units):
    cell, here = cells[units][0], places(tmp_path)

    class Enough(Exception):
        pass

    def stop(_, event):
        if isinstance(event, GenerationFinished) and event.state.generation == 1:
            raise Enough

    with pytest.raises(Enough):
        make([cell], here, stop)
    assert missing([cell], here) == [cell]
    generations = []
    (resumed,) = make(
        [cell], here, lambda _, e: isinstance(e, GenerationFinished) and generations.append(e.state.generation)
    )
    assert generations == [2]
    expected = read_record(alone.record(cell))
    assert resumed.policies == expected.policies and resumed.questions == expected.questions
    assert [each.front for each in resumed.generations] == [each.front for each in expected.generations]
    assert [each.buffer for each in resumed.generations] == [each.buffer for each in expected.generations]


def test_a_lost_record_comes_from_the_run_folder_without_training(cells, alone):
    cell = cells["raw"][0]
    before = alone.record(cell).read_bytes()
    alone.record(cell).unlink()
    events = []
    make([cell], alone, lambda _, event: events.append(event))
    assert not events and alone.record(cell).read_bytes() == before


def test_a_run_folder_of_other_settings_is_started_anew(cells, tmp_path):
    (first, other), here = cells["raw"], places(tmp_path)
    make([first], here, ignore)
    here.folder(first).rename(here.folder(other))
    assert make([other], here, ignore)[0].digest == other.config.identity()


def test_runs_that_share_a_program_find_what_each_finds_alone(cells, alone, tmp_path):
    here = places(tmp_path)
    together = make(cells["raw"], here, ignore)
    assert [read_record(here.record(cell)) for cell in cells["raw"]] == together
    for cell, record in zip(cells["raw"], together, strict=True):
        expected = read_record(alone.record(cell))
        np.testing.assert_allclose(record.values, expected.values, rtol=1e-3)
        assert (record.reason, record.questions) == (expected.reason, expected.questions)
        assert record.together == ("raw-seed-1", "raw-seed-2") and expected.together == ()
        assert np.isnan(record.seconds).all() and np.isfinite(expected.seconds).all()


def test_a_run_that_is_broken_off_leaves_those_beside_it_alone(cells, tmp_path):
    some, here = cells["raw"], places(tmp_path)

    def stop(cell, event):
        if cell == some[0]:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make(some, here, stop)
    assert missing(some, here) == [some[0]]


def test_a_run_alone_is_made_in_the_callers_thread(cells, tmp_path):
    """So an interruption reaches it, and somebody's own decision maker need not know of threads."""
    threads = set()
    make(cells["raw"][:1], places(tmp_path), lambda *_: threads.add(threading.current_thread()))
    assert threads == {threading.current_thread()}


def test_only_runs_of_one_shape_share_a_program(cells):
    raw, paper = cells["raw"], cells["paper"]
    assert list(groups([*raw, *paper[:1], raw[0]], 3)) == [raw, paper[:1], raw[:1]]
    assert list(groups(raw, 1)) == [[cell] for cell in raw]


def test_a_cell_that_two_need_is_one(cells):
    one, other = cells["raw"]
    assert distinct([one, other, Cell(one.key, one.config)]) == [one, other]

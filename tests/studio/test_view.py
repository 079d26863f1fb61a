"""What a view remembers of policies that are no longer in the front."""

import csv
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np

from jmorl.config import resolve
from jmorl.events import GenerationFinished
from jmorl.report.timeline import Timeline
from jmorl.storage.csv_log import csv_text
from jmorl.storage.notes_file import change_note
from jmorl.studio.view import View, after, stored_view
from tests.report.conftest import OBJECTIVES, events_of


def test_policies_that_are_replaced_can_still_be_looked_at_but_their_networks_are_not_kept():
    config = resolve()
    nothing = (), (), np.full(2, -np.inf), None, (), Timeline(config, since=0.0)
    view, once = View(Path("run"), "id", config, OBJECTIVES[:2], *nothing), {}
    for event in events_of():
        if isinstance(event, GenerationFinished):
            members = [replace(policy, snapshot="a network") for policy in event.state.archive.members]
            archive = replace(event.state.archive, members=tuple(members))
            event = replace(event, state=replace(event.state, archive=archive))
            once |= {policy.id: policy for policy in members}
        view = after(view, event, 0.0)
    gone = set(once) - {policy.id for policy in view.front}
    assert gone and set(view.replaced) == gone
    for policy in gone:
        assert view.policy(policy).values is once[policy].values and view.replaced[policy].snapshot is None
    assert view.policy(max(once) + 1) is None


def test_a_stored_run_tells_which_policies_were_in_its_front_once(whole, tmp_path):
    path = shutil.copytree(whole, tmp_path / "run")
    before = stored_view(path)
    assert not before.replaced
    first, last = before.front[0], before.front[-1]
    assert first.generation < last.generation
    for name in ("policies.csv", "front.csv"):  # the last is better in everything than the first
        rows = list(csv.DictReader((path / name).read_text().splitlines()))
        for row in rows:
            if int(row["policy"]) == first.id:
                row |= {f"value_{each.name}": last.values[i] - 1e-6 for i, each in enumerate(before.objectives)}
        kept = [row for row in rows if name != "front.csv" or int(row["policy"]) != first.id]
        (path / name).write_text(csv_text(kept, list(rows[0])))
    change_note(path, first.id, name="the old one", favourite=True)
    change_note(path, 9999, favourite=True)  # there is no such policy
    view = stored_view(path)
    assert set(view.replaced) == {first.id} and [policy.id for policy in view.favourites] == [first.id]
    np.testing.assert_allclose(view.policy(first.id).values, last.values - 1e-6)

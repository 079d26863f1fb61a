"""E-NAUTILUS on a run's front, with the dialogue kept in the run folder.

enautilus.jsonl  every question and answer of the last dialogue; `--user script=FILE` replays it
enautilus.json   the policy it ended on; policies/ has its file
"""

from collections.abc import Sequence
from pathlib import Path

from jmorl.decision.navigation import NavigationFinished, PointDecided, navigate
from jmorl.decision.protocol import DecisionMaker
from jmorl.decision.records import PointRecord, point_record, to_json
from jmorl.search.policy import Policy
from jmorl.storage.files import write_json, write_text
from jmorl.storage.layout import Layout
from jmorl.storage.stored_run import StoredRun


def choose_afterwards(run: StoredRun, user: DecisionMaker, iterations: int, points: int) -> Policy:
    """Lead the user from the nadir of the run's front to one of its policies.

    The dialogue replaces an earlier one only when it has come to its end.
    """
    generation = int(run.metrics["generation"][-1])
    records = []
    for event in navigate(run.front, run.objectives, user.choose_point, iterations, points, generation):
        match event:
            case PointDecided(question, answer):
                records.append(point_record(question, answer))
            case NavigationFinished(chosen):
                keep_dialogue(run.path, records, chosen)
    return chosen


def keep_dialogue(path: Path, records: Sequence[PointRecord], chosen: Policy) -> None:
    """Write a dialogue that has come to its end into the run folder, in place of an earlier one."""
    write_text(Layout(path).enautilus_log, "".join(to_json(record) + "\n" for record in records))
    write_json(Layout(path).enautilus, {"policy": chosen.id, "values": chosen.values.tolist()})

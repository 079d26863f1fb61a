"""E-NAUTILUS on a finished run's front, with the dialogue kept in the run folder.

enautilus.jsonl  every question and answer of the last dialogue; `--user script=FILE` replays it
enautilus.json   the policy it ended on; policies/ has its file
"""

from jmorl.decision.navigation import run_enautilus
from jmorl.decision.protocol import DecisionMaker, PointAnswer, PointQuestion
from jmorl.decision.records import point_record, to_json
from jmorl.search.policy import Policy
from jmorl.storage.files import write_json, written_whole
from jmorl.storage.stored_run import StoredRun


def choose_afterwards(run: StoredRun, user: DecisionMaker, iterations: int, points: int) -> Policy:
    """Lead the user from the nadir of the run's front to one of its policies.

    The dialogue replaces an earlier one only when it has come to its end.
    """
    with written_whole(run.path / "enautilus.jsonl") as log:

        def asked(question: PointQuestion) -> PointAnswer:
            answer = user.choose_point(question)
            with log.open("a", encoding="utf-8") as file:
                file.write(to_json(point_record(question, answer)) + "\n")
            return answer

        generation = int(run.metrics["generation"][-1])
        chosen = run_enautilus(run.front, run.objectives, asked, iterations, points, generation)
        log.touch()  # a front of one policy asks nothing
    write_json(run.path / "enautilus.json", {"policy": chosen.id, "values": chosen.values.tolist()})
    return chosen

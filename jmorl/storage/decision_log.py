"""The decision log of a run folder, where an answer is on the disk before the run goes on."""

from pathlib import Path
from typing import Any

from jmorl.decision.protocol import AnyQuestion
from jmorl.decision.records import PointRecord, ScriptError, from_json, record_of, to_json
from jmorl.decision.remembered import RunRecord, answer_in, is_of
from jmorl.storage.files import append_text, write_text


class DecisionLog:
    """`decisions.jsonl`: the answers that the run is past, and behind them those it will come to again.

    A run that goes on from a checkpoint may have been answered after that was written. Those answers stay where they
    are, `ahead`, until the run gives them again, or another one in their place.
    """

    def __init__(self, path: Path, past: str = ""):
        """Open the log of a run whose log was `past` when its checkpoint was written.

        A half-written last line is cut off. If the file does not begin with `past`, that is restored, and what the
        file has is not trusted.
        """
        self.path = path
        self.past = past
        text = path.read_bytes().decode(errors="replace") if path.exists() else ""
        self.ahead = _answers(text.removeprefix(past)) if text.startswith(past) else []
        self.restored = not text.startswith(past)
        if text != self._text():
            write_text(path, self._text())

    @property
    def answered(self) -> list[RunRecord]:
        """The answers that the run is past."""
        return _answers(self.past)

    def add(self, question: AnyQuestion, answer: Any) -> None:
        """Note an answer. One that was ahead is not written again."""
        record = record_of(question, answer)
        expected = self.ahead.pop(0) if self.ahead else None
        self.past += to_json(record) + "\n"
        if expected is None:
            append_text(self.path, to_json(record) + "\n")
        elif expected != record:
            if not is_of(expected, question) or answer != answer_in(expected, question):
                self.ahead.clear()
            write_text(self.path, self._text())

    def _text(self) -> str:
        return self.past + "".join(to_json(record) + "\n" for record in self.ahead)


def _answers(text: str) -> list[RunRecord]:
    """Return the records of whole lines, up to the first that is none."""
    answers: list[RunRecord] = []
    for line in text.splitlines(keepends=True):
        record = _answer(line)
        if record is None:
            break
        answers.append(record)
    return answers


def _answer(line: str) -> RunRecord | None:
    try:
        record = from_json(line)
    except ScriptError:
        return None
    return None if isinstance(record, PointRecord) or not line.endswith("\n") else record

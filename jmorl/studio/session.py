"""A run beside a page: driven in a thread of its own, shown as immutable records, steered by commands.

The run never waits for anybody but the person who is asked. Whoever shows it reads `view`, `selection` and `dialogue`,
each replaced as a whole, and compares them by identity with what was shown last. Some commands wait for the generation
that is going on, and say so.
"""

import threading
import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

import envs
from jmorl.decision.answers import Answer, PointAnswer
from jmorl.decision.protocol import Question
from jmorl.events import RunFinished
from jmorl.loop import make_method
from jmorl.report.plots import draw_run
from jmorl.report.timeline import Timeline
from jmorl.state import RunState
from jmorl.storage.afterwards import keep_dialogue
from jmorl.storage.layout import Layout
from jmorl.storage.policy_file import PolicyFileError, load_policy
from jmorl.storage.resume import AlreadyFinished, Continued, branch, resume
from jmorl.storage.stored_run import read_run
from jmorl.studio import dialogue as dialogues
from jmorl.studio.between import BlendScore, score
from jmorl.studio.dialogue import Dialogue
from jmorl.studio.history import Branch, free_folder, read_tree
from jmorl.studio.person import LeftOff, Person
from jmorl.studio.selection import Selection
from jmorl.studio.view import PERSON, View, after, stored_view


class Session:
    """The run that is open, and what is laid out of it.

    `background` works out what choosing a policy would mean, one policy after the other; it ends with the session.
    """

    view: View

    def __init__(self, clock: Callable[[], float] = time.monotonic, background: Executor | None = None):
        self.clock = clock
        self.selection = Selection()
        self.dialogue: Dialogue | None = None
        self.leaving = False  # the run is about to be left, after its generation
        self._lock = threading.Lock()  # of the selection, which a thread adds to
        self._moving = threading.Lock()  # while one run is left for another
        self._person: Person | None = None
        self._thread: threading.Thread | None = None
        self._background = background or ThreadPoolExecutor(1, "prospects")

    def open(self, path: Path) -> None:
        """Show the run in a folder, and go on with it if it has not ended. Raises as `resume` and `read_run` do."""
        try:
            self.drive(resume(path))
        except AlreadyFinished:
            self._show(path)

    def drive(self, continued: Continued) -> None:
        """Go on with a run, in a thread. No other may be going on."""
        folder = continued.folder
        self._show(folder.path)
        timeline = Timeline(folder.config, self.clock())
        self.view = replace(self.view, timeline=timeline, notes=continued.notes, result=None, reason="")
        self.leaving = False
        self._person = Person(self.ask) if folder.config.user == PERSON else None
        self._thread = threading.Thread(target=self._run, args=(continued, self._person), name="run")
        self._thread.start()

    def ask(self, question: Question) -> None:
        """Open a question of the run, and see what is laid out in its light."""
        self.view = replace(self.view, question=question, bounds=question.bounds)
        self._rearrange(lambda selection: replace(selection, prospects={}))
        for policy in self.selection.letters:
            if self.view.policy(policy):
                self._think(question, policy)
            else:
                self.put_away(policy)

    def answer(self, question: Question, answer: Answer) -> bool:
        """Answer the open question. Return False if it is open no more. Raises ValueError if it has no such policy."""
        return self._person is not None and self._person.reply(question, answer)

    def look_at(self, policy: int) -> None:
        """Lay a policy out and put it in focus; do nothing if there is none."""
        if self.view.policy(policy):
            self._rearrange(lambda selection: selection.with_policy(policy))
            self._think(self.view.question, policy)

    def put_away(self, policy: int) -> None:
        """Lay a policy out no longer."""
        self._rearrange(lambda selection: selection.without(policy))

    def more_of(self, objective: int | None) -> None:
        """Ask for more of an objective than the policy in focus, or else the last choice, has; None: no longer."""
        previous = self.view.previous.id if self.view.previous else None
        than = self.selection.focus if self.selection.focus is not None else previous
        self._rearrange(lambda selection: replace(selection, more_of=objective, than=than))

    def history(self) -> tuple[Branch, ...]:
        """Read the run that is open, and its branches."""
        return read_tree(self.view.path)

    def step_back(self, run: str, generation: int) -> None:
        """Ask the question before `generation` of a run in the history again: a branch begins there, and is driven.

        Waits for the generation that is going on. Raises as `branch` does.
        """
        path = self._in_history(run).path
        with self._move():
            self.leave()
            try:
                self.drive(branch(path, generation - 1, free_folder(path), PERSON))
            except Exception:
                self._show(self.view.path)
                raise

    def switch(self, run: str) -> None:
        """Open another run of the history. Waits for the generation that is going on; raises as `open` does."""
        path = self._in_history(run).path
        with self._move():
            self.leave()
            self.open(path)

    def begin_dialogue(self, iterations: int, points: int) -> None:
        """Begin E-NAUTILUS on the front. Raises ValueError if there is none, or for numbers below 1."""
        view = self.view
        generation = view.generations[-1].number if view.generations else 0
        self._move_to(dialogues.begin(view.front, view.objectives, generation, iterations, points))

    def reply(self, at: Dialogue, answer: PointAnswer) -> bool:
        """Answer in E-NAUTILUS. Return False if the dialogue has moved on. Raises ValueError for a wrong answer."""
        if at is not self.dialogue:
            return False
        self._move_to(dialogues.reply(at, answer))
        return True

    def undo_reply(self) -> None:
        """Take the last answer in E-NAUTILUS back, at its end, too."""
        if self.dialogue and self.dialogue.before:
            self.dialogue = self.dialogue.before

    def close_dialogue(self) -> None:
        """Leave E-NAUTILUS."""
        self.dialogue = None

    def policy_file(self, run: str, policy: int) -> Path | None:
        """Return the file of an archived policy of a run in the history, the result's with its confirmed score.

        None if there is none.
        """
        member = next((each for each in self.history() if each.run == run), None)
        if member is None:
            return None
        layout = Layout(member.path)
        if layout.result.exists():
            with suppress(PolicyFileError):
                if load_policy(layout.chosen).header["id"] == policy:
                    return layout.chosen
        path = layout.policy(policy)
        return path if path.is_file() else None

    def files_of_pair(self, run: str, first: int, second: int) -> tuple[Path, Path]:
        """Return the files of two archived policies. Raises ValueError if there are none."""
        files = [(policy, self.policy_file(run, policy)) for policy in (first, second)]
        missing = [policy for policy, file in files if file is None]
        if missing:
            raise ValueError(f"there is no file of policy {' and '.join(map(str, missing))}")
        one, other = (file for _, file in files if file)
        return one, other

    def score_between(self, run: str, first: int, second: int, per_cent: int) -> BlendScore:
        """Return what the blend of two policies returns. Raises ValueError, and ComputationFailed."""
        return score(*self.files_of_pair(run, first, second), per_cent)

    def leave(self) -> None:
        """Leave the run after the generation that is going on, at once if it waits for an answer; it can be resumed."""
        self.leaving = True
        if self._person:
            self._person.leave()
        self.wait()
        self.leaving = False

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the run has ended or was left. Return False if that takes longer than `timeout` seconds."""
        thread = self._thread
        if thread:
            thread.join(timeout)
        return thread is None or not thread.is_alive()

    def close(self) -> None:
        """Leave the run, and do nothing any more."""
        self.leave()
        self._background.shutdown(cancel_futures=True)

    @contextmanager
    def _move(self) -> Iterator[None]:
        """Allow one move from run to run at a time. Raises ValueError for a second one."""
        if not self._moving.acquire(blocking=False):
            raise ValueError("another tab is just leaving this run; nothing has changed")
        try:
            yield
        finally:
            self._moving.release()

    def _run(self, continued: Continued, person: Person | None) -> None:
        """Run to the end, or until the run is left, and keep the view up to date; the thread of the run does this."""
        try:
            with continued.folder:
                for event in continued.events(person):
                    self.view = after(self.view, event, self.clock())
                    if self.leaving and not isinstance(event, RunFinished):
                        break
            if self.view.result:
                self.look_at(self.view.result.id)
                draw_run(read_run(self.view.path), Layout(self.view.path).plots)
        except LeftOff:
            pass
        except Exception as error:  # whatever it is, the page says it, and what the run had is kept
            traceback.print_exc()
            self.view = replace(self.view, problem=f"{type(error).__name__}: {error}")
        finally:
            self.view = replace(self.view, timeline=None, question=None)

    def _show(self, path: Path) -> None:
        """Show what the folder has; of a run that has ended, its result is laid out."""
        self.view = stored_view(path)
        self.selection, self.dialogue = Selection(), None
        if self.view.result:
            self.look_at(self.view.result.id)

    def _think(self, question: Question | None, policy: int) -> None:
        """Find out in the background what choosing the policy would mean."""
        state = self.view.state
        if question and question.purpose != "final" and state and policy not in self.selection.prospects:
            self._background.submit(self._note_prospect, question, state, policy)

    def _note_prospect(self, question: Question, state: RunState, policy: int) -> None:
        try:
            chosen = question.policy(policy)
        except ValueError:  # a policy that is looked at, but not to choose from
            return
        config = self.view.config
        found = make_method(config, envs.make(config.env)).prospect(state, chosen)
        if found and self.view.question is question:
            self._rearrange(lambda selection: replace(selection, prospects={**selection.prospects, policy: found}))

    def _rearrange(self, change: Callable[[Selection], Selection]) -> None:
        with self._lock:
            self.selection = change(self.selection)

    def _move_to(self, dialogue: Dialogue) -> None:
        """Show a dialogue when all that is shown of it is known; at its end keep it, and look at what it led to."""
        if dialogue.chosen:
            keep_dialogue(self.view.path, dialogue.records, dialogue.chosen)
            self.look_at(dialogue.chosen.id)
        else:
            dialogue.question  # noqa: B018
        self.dialogue = dialogue

    def _in_history(self, run: str) -> Branch:
        found = next((each for each in self.history() if each.run == run), None)
        if found is None:
            raise ValueError(f"{run!r} is no run of this history")
        return found

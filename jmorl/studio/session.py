"""A run beside a page: driven in a thread of its own, shown as immutable records, steered by commands.

One run is open at a time, or none yet. It never waits for anybody but the person who is asked. Whoever shows it reads
`view`, `prospects` and `dialogue`, each replaced as a whole, and compares them by identity with what was shown last.
Some commands wait for the generation that is going on, and say so.
"""

import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import envs
from jmorl.decision.answers import Answer, AnswerError, Instead, PointAnswer
from jmorl.decision.protocol import Question
from jmorl.events import RunFinished
from jmorl.learning.population import TrainingFault
from jmorl.methods.base import MethodError
from jmorl.report.plots import draw_run
from jmorl.report.timeline import Timeline
from jmorl.search.policy import Policy, rescored
from jmorl.search.prospect import Prospect
from jmorl.storage.afterwards import keep_dialogue
from jmorl.storage.layout import Layout
from jmorl.storage.notes_file import change_note, read_notes
from jmorl.storage.policy_file import PolicyFileError, StoredPolicy, load_policy, save_policy
from jmorl.storage.resume import AlreadyFinished, Continued, branch, resume
from jmorl.storage.run_folder import RUNS
from jmorl.storage.stored_run import read_run
from jmorl.studio import dialogue as dialogues
from jmorl.studio.between import BlendScore, score
from jmorl.studio.comparison import Comparison, read_fronts
from jmorl.studio.dialogue import Dialogue
from jmorl.studio.history import Branch, free_folder, read_tree
from jmorl.studio.person import LeftOff, Person
from jmorl.studio.view import PERSON, View, after, stored_view

LASTING = (TrainingFault, AnswerError, MethodError)  # what breaks a run off again where it is taken up


class Session:
    """The run that is open, if there is one, and what its choices would mean.

    `runs` is the folder of the runs that can be opened, and of new ones. `background` works out what choosing a policy
    would mean, one policy after the other; it ends with the session.
    """

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, background: Executor | None = None, runs: Path = RUNS
    ):
        self.clock = clock
        self.runs = runs
        self._view: View | None = None
        self.prospects: Mapping[int, Prospect] = {}  # policy -> what choosing it now would mean, as far as known
        self.dialogue: Dialogue | None = None
        self._worked_out: set[tuple[int, int]] = set()  # question and policy of prospects that are known, or to come
        self.leaving = False  # the run is about to be left, after its generation
        self.opening = ""  # name of the run that is about to take its place
        self._next: Path | None = None  # its folder, once it is ready
        self._moving = threading.Lock()  # while one run is left for another
        self._changing = threading.Lock()  # while the view makes way for the next one
        self._noting = threading.Lock()  # while a file of notes is read and written
        self._starting, self._closed = threading.Lock(), False
        self._person: Person | None = None
        self._thread: threading.Thread | None = None
        self._background = background or ThreadPoolExecutor(1, "prospects")

    @property
    def is_open(self) -> bool:
        """Whether a run is open; once one is, one always is."""
        return self._view is not None

    @property
    def view(self) -> View:
        """The open run as it is shown. Raises ValueError if none is open."""
        if self._view is None:
            raise ValueError("no run is open")
        return self._view

    @view.setter
    def view(self, view: View) -> None:
        self._view = view

    @property
    def open_folder(self) -> Path | None:
        """Return the folder of the run that is open, resolved; None if none is open."""
        return self._view.path.resolve() if self._view else None

    @property
    def held_folders(self) -> tuple[Path, ...]:
        """Return the folders of the run that is open and of the one that is ready to be, resolved."""
        return tuple(path.resolve() for path in (self.open_folder, self._next) if path)

    def open(self, path: Path) -> None:
        """Show the run in a folder, and go on with it if it has not ended.

        The run that is open is left after the generation that is going on, once this one is known to open: until then
        nothing changes. Raises as `resume` and `read_run` do, and ValueError while another run is being opened.
        """
        if path.resolve() == self.open_folder and self.view.timeline:
            return
        with self._move(path.name):
            try:
                self.drive(resume(path))
            except AlreadyFinished:
                view = stored_view(path)
                self.leave()
                self._show(view)

    def begin(self, name: str, begun: Callable[[], Continued]) -> None:
        """Drive the new run that `begun` makes, called `name`, in place of the one that is open.

        Raises what `begun` does, and then nothing has changed, and ValueError while another run is being opened.
        """
        with self._move(name):
            self.drive(begun())

    def drive(self, continued: Continued) -> None:
        """Go on with a run, in a thread. The one that is open is left after the generation that is going on."""
        folder = continued.folder
        try:
            view = stored_view(folder.path)
            self._next = folder.path
            self.leave()
            with self._starting:
                if self._closed:
                    raise ValueError("the studio is being closed")
                self._start(continued, view)
        except BaseException:
            folder.close()
            raise
        finally:
            self._next = None

    def ask(self, question: Question) -> None:
        """Open a question of the run. Scores that were confirmed for it are those of the front from now on."""
        front = rescored(self.view.front, question.whole.front)
        self.prospects, self._worked_out = {}, set()
        self._change(question=question, bounds=question.bounds, front=front, asking=None)

    def answer(self, question: Question, answer: Answer | Instead) -> bool:
        """Answer the open question, or say what is wanted instead.

        Return False if it is open no more. Raises ValueError if it has no such policy.
        """
        return self._person is not None and self._person.reply(question, answer)

    def ask_now(self) -> None:
        """Have the person asked before the next generation, whatever their last answer was to hold for."""
        if self._person:
            self._person.ask_now()
            self._change(asking="question")

    def end_with(self, policy: int) -> None:
        """End the run after the generation that is going on, with this policy as its result."""
        if self._person:
            self._person.end_with(policy)
            self._change(asking="end")

    def work_out(self, policy: int) -> None:
        """Find out in the background what choosing the policy would mean; `prospects` has it then."""
        question = self.view.question
        if question and (id(question), policy) not in self._worked_out:
            self._worked_out.add((id(question), policy))
            self._background.submit(self._note_prospect, question, policy)

    def history(self) -> tuple[Branch, ...]:
        """Read the run that is open, and its branches; nothing if none is open."""
        return read_tree(self.view.path) if self.is_open else ()

    def fronts(self) -> Comparison:
        """Read the fronts of the run that is open and of its branches."""
        return read_fronts(self.history(), self.view.objectives)

    def note(self, run: str, policy: int | None, **changes: Any) -> bool:
        """Change what is noted about a policy of a run in the history, or about the run; see `change_note`.

        Return True. Raises ValueError where there is no such run or policy, and as `change_note` does.
        """
        path = self._in_history(run).path
        if policy is not None and not Layout(path).policy(policy).is_file():
            raise ValueError(f"there is no policy {policy} in this run")
        with self._noting:
            change_note(path, policy, **changes)
            self._change(noted=read_notes(self.view.path))
        return True

    def step_back(self, run: str, generation: int) -> None:
        """Ask the question before `generation` of a run in the history again: a branch begins there, and is driven.

        Waits for the generation that is going on. Raises as `branch` does.
        """
        path = self._in_history(run).path
        new = free_folder(path)
        with self._move(new.name):
            self.leave()
            try:
                self.drive(branch(path, generation - 1, new, PERSON))
            except Exception:
                self._show(stored_view(self.view.path))
                raise

    def train_on(self, rounds: int) -> None:
        """Go on where the open run ended, for so many generations more: a branch begins there, and is driven.

        Raises ValueError for a run that has not ended, and as `branch` does.
        """
        view = self.view
        if view.result is None or not view.generations:
            raise ValueError("this run has not ended; it can go on as it is")
        new = free_folder(view.path)
        with self._move(new.name):
            last, config = view.generations[-1], view.config
            iterations = round(last.steps / config.steps_per_iteration) + rounds * config.population.iterations
            steps = iterations * config.steps_per_iteration
            self.drive(branch(view.path, last.number, new, PERSON, steps=steps))

    def switch(self, run: str) -> None:
        """Open another run of the history. Waits for the generation that is going on; raises as `open` does."""
        self.open(self._in_history(run).path)

    def begin_dialogue(self, iterations: int, points: int) -> None:
        """Begin E-NAUTILUS on the front. Raises ValueError if there is none, or for numbers below 1."""
        view = self.view
        if not view.generations:
            raise ValueError("there is no front yet: the warm-up is still going on")
        self._move_to(dialogues.begin(view.front, view.objectives, view.generations[-1].number, iterations, points))

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

    def early_policy(self, run: str, policy: int) -> StoredPolicy | None:
        """Return an agent in the middle of the warm-up of the open run; None if there is none."""
        view = self.view
        agent = view.policy(policy) if view.early and view.run == run else None
        if agent is None:
            return None
        with TemporaryDirectory() as folder:
            file = Path(folder) / "agent.npz"
            save_policy(file, agent, envs.make(view.config.env), view.config)
            return load_policy(file)

    def policy_file(self, run: str, policy: int) -> Path | None:
        """Return the file of an archived policy of a run in the history, the result's with its confirmed score.

        None if there is none.
        """
        folder = self.folder(run)
        if folder is None:
            return None
        layout = Layout(folder)
        if layout.result.exists():
            with suppress(PolicyFileError):
                if load_policy(layout.chosen).header["id"] == policy:
                    return layout.chosen
        path = layout.policy(policy)
        return path if path.is_file() else None

    def folder(self, run: str) -> Path | None:
        """Return the folder of a run in the history; None if there is none."""
        return next((member.path for member in self.history() if member.run == run), None)

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
        with self._starting:
            self._closed = True
        self.leave()
        self._background.shutdown(cancel_futures=True)

    @contextmanager
    def _move(self, to: str) -> Iterator[None]:
        """Allow one move from run to run at a time. Raises ValueError for a second one."""
        if not self._moving.acquire(blocking=False):
            raise ValueError(f"{self.opening} is just being opened; nothing has changed")
        self.opening = to
        try:
            yield
        finally:
            self.opening = ""
            self._moving.release()

    def _start(self, continued: Continued, view: View) -> None:
        """Show the view, and go on with its run in a thread."""
        config = continued.folder.config
        timeline = Timeline(config, self.clock())
        self._show(replace(view, timeline=timeline, notes=continued.notes, result=None, reason=""))
        self._person = Person(self.ask) if config.user == PERSON else None
        self._thread = threading.Thread(target=self._run, args=(continued, self._person), name="run")
        self._thread.start()

    def _run(self, continued: Continued, person: Person | None) -> None:
        """Run to the end, or until the run is left, and keep the view up to date; the thread of the run does this."""
        try:
            with continued.folder:
                for event in continued.events(person, early=self._show_early):
                    with self._changing:
                        self.view = after(self.view, event, self.clock())
                    if self.leaving and not isinstance(event, RunFinished):
                        break
            if self.view.result:
                draw_run(read_run(self.view.path), Layout(self.view.path).plots)
        except LeftOff:
            pass
        except Exception as error:  # whatever it is, the page says it, and what the run had is kept
            traceback.print_exc()
            for_good = isinstance(error, LASTING)
            self._change(problem=str(error) or type(error).__name__, for_good=for_good)
        finally:
            self._change(timeline=None, question=None)

    def _show(self, view: View) -> None:
        """Show a run, of which nothing is worked out."""
        self.prospects, self._worked_out, self.dialogue = {}, set(), None
        with self._noting, self._changing:
            self.view = replace(view, noted=read_notes(view.path))  # which may have changed since

    def _change(self, **changes: Any) -> None:
        """Replace the view by one with these changes, and lose none that another thread makes."""
        with self._changing:
            self.view = replace(self.view, **changes)

    def _show_early(self, agents: tuple[Policy, ...]) -> None:
        """Show agents in the middle of the warm-up."""
        self._change(front=agents)

    def _note_prospect(self, question: Question, policy: int) -> None:
        if self.view.question is not question:  # it is answered: the processors train
            return
        try:
            chosen = question.policy(policy)
        except ValueError:  # a policy that is looked at, but not to choose from
            return
        found = question.prospect(chosen)
        if found and self.view.question is question:
            self.prospects = {**self.prospects, policy: found}

    def _move_to(self, dialogue: Dialogue) -> None:
        """Show a dialogue when all that is shown of it is known; keep it at its end."""
        if dialogue.chosen:
            keep_dialogue(self.view.path, dialogue.records, dialogue.chosen)
        else:
            dialogue.question  # noqa: B018
        self.dialogue = dialogue

    def _in_history(self, run: str) -> Branch:
        found = next((each for each in self.history() if each.run == run), None)
        if found is None:
            raise ValueError(f"{run!r} is no run of this history")
        return found

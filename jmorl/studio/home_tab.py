"""One browser tab on the home page: the runs that it lists, the form that is filled in, and the ways to a run.

It knows no panel and no widget.
"""

from collections.abc import Callable, MutableMapping
from dataclasses import replace
from typing import Any

from nicegui import run

from jmorl.config import ConfigError
from jmorl.learning.execution import ComputationFailed
from jmorl.storage.checkpoints import CheckpointError
from jmorl.studio import words
from jmorl.studio.access import STEERS, Access, Tone, steering
from jmorl.studio.form import Form, environments
from jmorl.studio.home import Home, ListedRun
from jmorl.studio.session import Session


class HomeTab:
    """The runs below a folder as a tab lists them, and what somebody who sits at it can do.

    `show` is called when the tab holds something new, `tell` puts a message on the page, and `go` leads to the page of
    the open run. `kept` outlives a reload of the page: the form is kept there. With an `access` for watching, runs are
    listed, and none can be opened or begun.
    """

    def __init__(
        self,
        session: Session,
        home: Home,
        show: Callable[[], None],
        tell: Callable[[str, Tone], None],
        go: Callable[[], None],
        kept: MutableMapping[str, Any] | None = None,
        access: Access = STEERS,
    ):
        self.session, self.home, self.access = session, home, access
        self.show, self.tell, self.go = show, tell, go
        self.kept = {} if kept is None else kept
        self.runs: tuple[ListedRun, ...] | None = None  # None until they are read
        self.environments = environments(session.view.config.env if session.is_open else None)
        self.problems: tuple[str, ...] = ()  # of the form
        self.at_work = False  # a run is being opened or begun from here
        form: Form = self.kept.get("form", Form())
        self.form = form if form.env in self.environments else replace(form, env=Form.env)

    async def follow(self) -> None:
        """Read the runs that there are now, and show them."""
        runs = await run.io_bound(self.home.runs, self.session.held_folders)
        self.runs = self.runs if runs == self.runs else runs
        self.show()

    @steering
    async def open(self, name: str) -> None:
        """Open a run of the list."""
        found = next((each for each in self.runs or () if each.name == name), None)
        if found is None:
            self.tell(words.GONE.format(name=name), "warning")
        elif not self.at_work:
            problems = await self._move(self.session.open, found.path)
            if problems:
                self.tell("; ".join(problems), "failure")

    def fill_in(self, **fields: str) -> None:
        """Fill in fields of the form."""
        self.form = self.kept["form"] = replace(self.form, **fields)
        self.show()

    @steering
    async def begin(self) -> None:
        """Begin the run of the form, or show what is wrong with it."""
        if not self.at_work:
            form, self.problems = self.form, ()
            name = form.name.strip() or words.UNNAMED
            self.problems = await self._move(self.session.begin, name, lambda: form.begin(self.home.folder))
            if not self.problems:
                self.kept["form"] = replace(form, name="")
            self.show()

    async def _move(self, command: Callable[..., None], *arguments: object) -> tuple[str, ...]:
        """Run a command that opens another run, and go to that. Return what has kept it from being opened."""
        self.at_work = True
        self.show()
        try:
            await run.io_bound(command, *arguments)
        except ConfigError as error:
            return tuple(error.problems)
        except (ValueError, OSError, CheckpointError, ComputationFailed) as error:
            return (str(error),)
        finally:
            self.at_work = False
            self.show()
        self.go()
        return ()

"""Make the runs of a comparison in this process: what was interrupted goes on.

Comparisons get their runs from `make` alone. Runs made in another place (on the machines of a cluster, say) are another
module, whose `make` takes the same arguments and leaves the same records.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import jax

import envs
from jmorl.config import ConfigError, resolve
from jmorl.confirmation import confirmed
from jmorl.decision.protocol import DecisionMaker
from jmorl.events import Event, RunFinished
from jmorl.experiments.cells import Cell, Places
from jmorl.experiments.record import FreshScore, RunRecord, broken_record, record_of, write_record
from jmorl.learning.population import Population, TrainingFault
from jmorl.learning.stack import Stack, StackedPopulation
from jmorl.search.policy import Policy
from jmorl.storage.resume import AlreadyFinished, Continued, resume
from jmorl.storage.run_folder import RunFolder
from jmorl.storage.stored_run import read_run

FRESH = 2_026  # the seed of fresh scores, which are drawn from no run's random numbers

Watch = Callable[[Cell, Event], None]
MakeUser = Callable[[], DecisionMaker]


def make(
    cells: Sequence[Cell], places: Places, watch: Watch, user: MakeUser | None = None, fresh_episodes: int = 0
) -> list[RunRecord]:
    """Make runs of one `shape`, or what is left of them, together in one program, and keep their records.

    Several have a thread each, in which `watch` and the users are called; one alone has the caller's. `user` defaults
    to the one that a run's config names. What `watch` raises breaks a run off; it goes on from its last checkpoint the
    next time. A run that breaks down by itself would do so again: it is kept as it was until then, with its `fault`.
    The result of each is scored on so many `fresh_episodes`, which the run knows nothing of, if there are any.
    """
    keys = tuple(cell.key for cell in cells) if len(cells) > 1 else ()

    def make_one(cell: Cell, population: StackedPopulation | None) -> RunRecord:
        with population or nullcontext():
            made = _made(cell, places.folder(cell), watch, user, population, fresh_episodes)
            record = replace(made, together=keys)
        write_record(places.record(cell), record)
        return record

    if len(cells) == 1:  # an interruption is to reach it at once, and somebody's own user need not know of threads
        return [make_one(cells[0], None)]
    config = cells[0].config
    stack = Stack(envs.make(config.env), config.learning, len(cells))
    with ThreadPoolExecutor(len(cells)) as pool:
        return list(pool.map(make_one, cells, stack.populations))


def _made(
    cell: Cell,
    folder: Path,
    watch: Watch,
    user: MakeUser | None,
    population: StackedPopulation | None,
    fresh_episodes: int,
) -> RunRecord:
    """Make one run, or what is left of it, and return its record."""
    try:
        continued = _begun(cell, folder)
    except AlreadyFinished:
        return record_of(read_run(folder))
    fresh = None
    try:
        with continued.folder:
            for event in continued.events(user() if user else None, population=population):
                watch(cell, event)
                if fresh_episodes and isinstance(event, RunFinished):
                    fresh = _fresh_score(event.chosen, cell, fresh_episodes)
    except TrainingFault as fault:
        return broken_record(folder, cell.config, str(fault))
    return replace(record_of(read_run(folder)), fresh=fresh)


def _fresh_score(policy: Policy, cell: Cell, episodes: int) -> FreshScore:
    """Return the score of a policy on episodes of its own, from starts that no run has."""
    config = cell.config
    alone = replace(config.learning, agents=1, evaluation=config.evaluation.model_copy(update={"episodes": episodes}))
    population = Population(envs.make(config.env), alone)
    key = jax.random.fold_in(jax.random.key(FRESH), config.seed)
    [scored], _ = confirmed([policy], population, key, episodes, episodes)
    assert scored.confirmation is not None
    values, errors = (tuple(float(each) for each in some) for some in (scored.values, scored.confirmation.error))
    return FreshScore(episodes, values, errors)


def _begun(cell: Cell, folder: Path) -> Continued:
    """Open the run as far as it is; begin it anew if what is there was made with other settings."""
    try:
        begun = resolve(file=folder / "config.toml").identity() == cell.config.identity()
    except ConfigError:
        begun = False
    if begun:
        return resume(folder)
    return Continued(RunFolder.create(folder, cell.config, envs.make(cell.config.env), force=True), None)

"""What blending does to the fronts of PGMORL, and what as many steps of training do instead.

    python -m benchmarks.continuum                  all environments and seeds; goes on where it was interrupted
    python -m benchmarks.continuum --table          only the tables, of what is there

A run of PGMORL each, with the default preset; then its front is blended, and, from the same state, trained on for at
least as many environment steps as blending evaluated. Families by evidence are compared with those by the recipe of
PGMORL's authors (Xu et al. 2020): k-means clusters of a t-SNE embedding of the actors' parameters, as many as there are
families. Needs `jmorl[benchmarks]`.
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from itertools import product
from math import ceil
from pathlib import Path
from typing import Any

import jax
import numpy as np

import envs
from benchmarks.arms import SEEDS
from jmorl.config import Config, resolve
from jmorl.display.console import PlainConsole
from jmorl.display.tables import PlainTable
from jmorl.events import Blended, GenerationFinished
from jmorl.learning.devices import use_all_cpu_cores
from jmorl.loop import blend, run
from jmorl.search.families import largest_gap
from jmorl.search.metrics import FrontMetrics
from jmorl.search.policy import Policy
from jmorl.search.scaling import Scale, range_scale
from jmorl.state import RunState
from jmorl.storage.files import write_json
from jmorl.storage.resume import BLENDS

CAR = "mo-mountaincarcontinuous-v0"
ENVIRONMENTS = CAR, "mo-halfcheetah-v5", "mo-hopper-v5"
EXACT, RESULT = (Path(__file__).with_name(name) for name in ("exact_front.json", "continuum.json"))


def main() -> None:
    """Make the runs that are missing, one after the other, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=ENVIRONMENTS, default=ENVIRONMENTS, metavar="ENV")
    parser.add_argument("--seeds", nargs="+", type=int, default=SEEDS)
    parser.add_argument("--table", action="store_true", help="make no runs")
    parser.add_argument("--out", type=Path, default=RESULT)
    options = parser.parse_args()
    use_all_cpu_cores()
    rows: list[dict[str, Any]] = json.loads(options.out.read_text(encoding="utf-8")) if options.out.exists() else []
    known = {(row["env"], row["seed"]) for row in rows}
    for env, seed in product(options.only, options.seeds):
        if not options.table and (env, seed) not in known:
            rows.append(_row(resolve(overrides={"env": env, "method": "pgmorl", "seed": seed})))
            write_json(options.out, sorted(rows, key=lambda row: (row["env"], row["seed"])))
    console = PlainConsole()
    for env in options.only:
        for table in _tables(env, [row for row in rows if row["env"] == env]):
            console.print(table)


def _row(config: Config) -> dict[str, Any]:
    """Train, blend and train on."""
    environment = envs.make(config.env)
    trained = _trained(config, None)
    blended = blend(config, environment, trained.state, BLENDS * config.population.agents)
    more = _longer(config, trained.state, blended.blending.evaluation_steps)
    scale = range_scale(trained.state.archive.values)
    links = blended.blending.links
    return {
        "env": config.env,
        "seed": config.seed,
        "config": config.identity(),
        "steps": trained.steps,
        "before": _measures(config, blended.before, trained.state, scale),
        "after": _measures(config, blended.front, blended.state, scale),
        "trained_on": _measures(config, more.front, more.state, scale),
        "trained_on_steps": more.steps - trained.steps,
        "evaluation_steps": blended.blending.evaluation_steps,
        "seconds": blended.seconds.total,
        "seconds_of_a_generation": trained.seconds.total,
        "tried": blended.blending.tried,
        "joined": len(blended.offspring),
        "beyond": sum(min(policy.blend.coefficients) < 0 for policy in blended.offspring if policy.blend),
        "links": len(links),
        "links_that_hold": sum(link.holds for link in links),
        "families": [len(family) for family in blended.blending.families],
        "links_told_by_recipe": _told_by_recipe(blended),
    }


def _trained(config: Config, state: RunState | None) -> GenerationFinished:
    """Return the last generation of a run."""
    *_, last = (event for event in run(config, state=state) if isinstance(event, GenerationFinished))
    return last


def _longer(config: Config, state: RunState, steps: int) -> GenerationFinished:
    """Return the last generation of the run that goes on for at least so many steps."""
    generation = config.population.iterations * config.steps_per_iteration
    done = state.iterations * config.steps_per_iteration
    return _trained(config.replace(steps=done + ceil(steps / generation) * generation), state)


def _measures(config: Config, front: FrontMetrics, state: RunState, scale: Scale) -> dict[str, float]:
    """Return how good and how dense a front is; on the car how far below the exact one, in per cent of it."""
    scaled = scale.apply(state.archive.values)
    found = {
        "front": front.front_size,
        "hypervolume": front.hypervolume,
        "expected_utility": front.expected_utility,
        "largest_gap": largest_gap(np.clip(scaled, 0, 1)),
    }
    if config.env == CAR:
        found["below_exact_front"] = float(np.mean(list(_shortfalls(state.archive.values))))
    return found


def _shortfalls(values: np.ndarray) -> Iterator[float]:
    """Yield how far the best weighted sum lies below the exact front's, in per cent, for each of its weights."""
    for point in json.loads(EXACT.read_text(encoding="utf-8"))["front"]:
        weights = np.array([point["weight_on_time"], 1 - point["weight_on_time"]])
        yield 100 * (1 - point["utility"] / float((values @ weights).max()))


def _told_by_recipe(event: Blended) -> int:
    """Return of how many links clusters of parameters tell whether they hold."""
    from sklearn.cluster import KMeans
    from sklearn.manifold import TSNE

    front, families = event.blending.front, event.blending.families
    if len(families) == 1 or len(front) < 4:
        return sum(link.holds for link in event.blending.links)
    parameters = np.stack([_parameters(policy) for policy in front])
    perplexity = min(30.0, (len(front) - 1) / 3)
    embedded = TSNE(perplexity=perplexity, random_state=0).fit_transform(parameters)
    clusters = KMeans(len(families), n_init=10, random_state=0).fit_predict(embedded)
    of = {policy.id: int(cluster) for policy, cluster in zip(front, clusters, strict=True)}
    return sum((of[link.ends[0]] == of[link.ends[1]]) == link.holds for link in event.blending.links)


def _parameters(policy: Policy) -> np.ndarray:
    leaves = jax.tree.leaves(policy.snapshot.parameters["actor"])
    return np.concatenate([np.ravel(leaf) for leaf in leaves]).astype(np.float64)


def _tables(env: str, rows: Sequence[dict[str, Any]]) -> list[PlainTable]:
    """Return what blending did seed by seed, and what families there are."""
    if not rows:
        return []
    fronts = PlainTable(
        "seed", "front", "policies", "hypervolume", "utility", "largest gap", "below exact", words=["front"]
    )
    fronts.title = env
    names = {"before": "trained", "after": "blended", "trained_on": "trained on"}
    for row in rows:
        for name, title in names.items():
            found = row[name]
            exact = f"{found['below_exact_front']:.2f} %" if "below_exact_front" in found else ""
            gap = f"{found['largest_gap']:.1%}"
            numbers = f"{found['hypervolume']:.6g}", f"{found['expected_utility']:.5g}"
            fronts.add_row(str(row["seed"]), title, str(found["front"]), *numbers, gap, exact)
    costs = PlainTable(
        *("seed", "tried", "joined", "beyond", "links", "hold", "told by recipe", "families", "seconds"),
        *("evaluated", "trained on"),
    )
    for row in rows:
        cells = [row[name] for name in ("seed", "tried", "joined", "beyond", "links", "links_that_hold")]
        families = str(len(row["families"]))
        steps = [f"{row[name] / 1e6:.2f} M" for name in ("evaluation_steps", "trained_on_steps")]
        costs.add_row(*map(str, cells), str(row["links_told_by_recipe"]), families, f"{row['seconds']:.1f}", *steps)
    return [fronts, costs]


if __name__ == "__main__":
    main()

"""The tables that `jmorl blend` prints: what it did to the front, its families, and the blends that joined."""

from collections.abc import Sequence

import numpy as np
from rich.console import RenderableType

from envs.core import Objective
from jmorl.display.fronts import front_table, stacked_label
from jmorl.display.readings import writers_for
from jmorl.display.tables import PlainTable
from jmorl.display.text import duration, number, plural, short_count
from jmorl.events import Blended
from jmorl.search.families import Blending, largest_gap
from jmorl.search.policy import values_of
from jmorl.search.scaling import range_scale


def blending_tables(event: Blended, objectives: tuple[Objective, ...]) -> list[RenderableType]:
    """Return the tables of a blending, to be printed one after the other."""
    tables = [_front(event), _families(event.blending, objectives)]
    if event.blending.blends:
        joined = front_table(event.blending.blends, objectives)
        joined.title = "Blends that joined the front"
        tables.append(joined)
    return [part for table in tables for part in (table, "")]


def _front(event: Blended) -> PlainTable:
    """Return the front before and after."""
    blending = event.blending
    values = values_of(blending.front), event.state.archive.values
    scale = range_scale(values[0])
    # What lies beyond the ends of the front before counts as its end.
    gaps = [f"{largest_gap(np.clip(scale.apply(each), 0, 1)):.1%} of the range" for each in values]
    rows = {
        "policies": [str(len(each)) for each in values],
        "hypervolume": [number(each.hypervolume) for each in (event.before, event.front)],
        "expected utility": [number(each.expected_utility) for each in (event.before, event.front)],
        "largest gap between the ends": gaps,
    }
    table = PlainTable("", "before", "after", title="Front", words=[""])
    for name, cells in rows.items():
        table.add_row(name, *cells)
    steps = f"{short_count(blending.evaluation_steps)} environment steps"
    table.caption = (
        f"{plural(blending.tried, 'blend')} tried by {steps} in {duration(event.seconds.total)}; "
        f"{len(blending.blends)} joined the front."
    )
    return table


def _families(blending: Blending, objectives: Sequence[Objective]) -> PlainTable:
    """Return one row for each family of the front: its policies, and where they lie."""
    by_id = {policy.id: policy for policy in blending.front}
    writers = writers_for(values_of(blending.front), objectives)
    table = PlainTable("policies", *map(stacked_label, objectives), words=["policies"])
    table.title = "Families: half-way between neighbours of one, blends lose next to nothing"
    for family in blending.families:
        values = values_of([by_id[each] for each in family])
        ends = zip(writers, values.min(axis=0), values.max(axis=0), strict=True)
        table.add_row(" ".join(map(str, family)), *(writer.span(worst, best) for writer, worst, best in ends))
    return table

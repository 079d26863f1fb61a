"""Which runs the experiments are made of: the paper's sizes, seeds and targets, and nothing twice."""

import json
from pathlib import Path

import numpy as np
import pytest

from jmorl.arguments import PAPER_ITEMS
from jmorl.experiments.cells import Places, distinct, missing
from jmorl.experiments.record import read_record
from jmorl.paper.claims import CURVE_STATEMENTS, FINALS_STATEMENTS
from jmorl.paper.data import honest, published
from jmorl.paper.pilots import proposals
from jmorl.paper.plan import (
    CAR,
    CHEETAH,
    ITEMS,
    PILOT_SEEDS,
    SHORTER,
    TARGET_SEEDS,
    USER_SEEDS,
    USER_STEPS,
    Plan,
)
from jmorl.presets import PAPER_RULE

UNITS = ("raw", "paper")
FULL, QUICK = Plan(), Plan(quick=True)
EVERYTHING = [(item, units) for item in ITEMS.values() for units in UNITS]


@pytest.mark.parametrize("plan", [FULL, QUICK])
def test_a_key_names_one_config_and_a_config_has_one_key(plan):
    cells = [cell for item, units in EVERYTHING for cell in plan.cells(item, units)]
    configs = {}
    for cell in cells:
        assert configs.setdefault(cell.key, cell.config) == cell.config
    assert len({config.identity() for config in configs.values()}) == len(configs) == len(distinct(cells))


def test_full_and_quick_runs_are_never_taken_for_each_other():
    digests = [
        {cell.config.identity() for item, u in EVERYTHING for cell in plan.cells(item, u)} for plan in (FULL, QUICK)
    ]
    assert not digests[0] & digests[1]


def test_one_run_of_pgmorl_serves_all_targets_users_and_figures():
    for env, names in ((CAR, ("table1", "fig5", "fig6", "fig9", "fig10")), (CHEETAH, ("table2", "fig7", "fig11"))):
        cells = [cell for name in names for cell in FULL.cells(ITEMS[name], "paper") if "pgmorl" in cell.key]
        assert len(distinct(cells)) == 5 and {cell.config.env for cell in cells} == {env}


def test_a_learning_rate_that_falls_over_the_budget_makes_two_runs_of_pgmorl():
    table, figure = (FULL.pgmorl(ITEMS[name], "raw", 1).config for name in ("table1", "fig5"))
    assert (table.steps, figure.steps) == (5_000_000, 2_500_000)
    assert table.ppo.final_learning_rate < table.ppo.learning_rate
    table, figure = (FULL.pgmorl(ITEMS[name], "raw", 1).config for name in ("table2", "fig7"))
    assert table == figure and table.steps == 7_500_000


def test_figures_5_6_and_9_are_of_the_same_runs():
    keys = [{cell.key for cell in FULL.cells(ITEMS[name], "raw")} for name in ("fig5", "fig6", "fig9")]
    assert keys[0] == keys[1] == keys[2] and len(keys[0]) == 3 * 3 + 3


def test_normalising_makes_other_users_in_raw_units_and_the_same_in_paper_units():
    raw, paper = ({cell.config.user for cell in FULL.cells(ITEMS["fig10"], units)} for units in UNITS)
    assert paper == {"A", "B", "C"}
    assert sum(user.startswith("weights=") for user in raw) == 3
    weights = FULL.user_weights(ITEMS["fig10"], "raw")["A"]
    time, fuel = honest(CAR).span
    assert weights[0] * time == pytest.approx(weights[1] * fuel, rel=1e-4)  # 0.5 and 0.5 of normalised objectives


@pytest.mark.parametrize(
    ("name", "gamma_n", "rollout", "budget"), [("table1", 0.995, 1000, 5e6), ("table2", 0.99, 400, 7.5e6)]
)
def test_in_paper_units_the_settings_are_the_authors(name, gamma_n, rollout, budget):
    config = FULL.cells(ITEMS[name], "paper")[0].config
    assert (config.population.agents, config.ppo.environments, config.ppo.rollout_steps) == (6, 4, rollout)
    assert (config.ppo.discount, config.evaluation.scale_discount, config.evaluation.episodes) == (0.995, gamma_n, 5)
    assert (config.evaluation.units, config.evaluation.actions, config.steps) == ("paper", "sampled", budget)
    assert (config.ppo.weights_on, config.search.buffer_size) == ("scaled", 2)
    assert (config.search.bounds_scale, config.search.gain_within, config.search.value_scale) == (
        "one",
        "front",
        "none",
    )
    assert config.user.endswith(",unscaled")


def test_in_raw_units_all_settings_but_the_papers_rule_are_this_programs_own():
    from jmorl.config import resolve

    config = FULL.cells(ITEMS["fig5"], "raw")[0].config
    own = resolve(overrides={"env": CAR, "user": "A", "seed": 1})
    assert config == own.replace(checkpoints={"keep": 2}, steps=2_500_000, **PAPER_RULE)
    assert (config.ppo.weights_on, config.search.buffer_size) == ("raw", 4)


def test_the_committed_records_are_of_the_plans_cells():
    """Their settings are still those of the plan, so that no finished run is made again."""
    places = Places(Path("benchmarks/paper/records"), Path("nowhere"))
    cells = distinct([*(cell for item, u in EVERYTHING for cell in FULL.cells(item, u)), *FULL.pilots(CHEETAH)])
    assert {places.record(cell) for cell in cells} == set(places.records.iterdir())
    assert len(cells) == 145 and missing(cells, places) == []


def test_pgmorl_has_a_second_row_with_the_papers_warm_up_on_halfcheetah_made_last():
    for name, seeds in (("table2", QUICK.seeds_of(ITEMS["table2"])), ("fig7", USER_SEEDS), ("fig8", USER_SEEDS)):
        plan = QUICK if name == "table2" else FULL  # its targets may not be fixed yet
        cells = plan.cells(ITEMS[name], "raw")
        later = plan.later(ITEMS[name], "raw")
        assert cells[-len(later) :] == later and [cell.config.seed for cell in later] == list(seeds)
        assert all(cell.config.method == "pgmorl" and SHORTER in cell.key for cell in later)
    shorter = FULL.pgmorl(ITEMS["fig7"], "raw", 1, SHORTER).config
    assert shorter.population.warmup_iterations == 40
    own = FULL.pgmorl(ITEMS["fig7"], "raw", 1).config
    assert own.population.warmup_iterations == 120 and shorter == own.replace(population={"warmup_iterations": 40})
    others = [("fig5", "raw"), ("fig7", "paper"), ("fig11", "raw")]
    assert not any(FULL.later(ITEMS[name], units) for name, units in others)
    assert not any(SHORTER in cell.key for cell in FULL.pilots(CHEETAH))


def test_seeds_are_the_papers_and_pilots_have_others():
    assert {cell.config.seed for cell in FULL.cells(ITEMS["table1"], "raw")} == set(TARGET_SEEDS)
    assert {cell.config.seed for cell in FULL.cells(ITEMS["fig5"], "raw")} == set(USER_SEEDS)
    pilots = FULL.pilots(CHEETAH)
    assert {cell.config.seed for cell in pilots} == set(PILOT_SEEDS)
    assert not set(PILOT_SEEDS) & {*TARGET_SEEDS, *USER_SEEDS}
    assert {cell.config.method for cell in pilots} == {"interactive", "pgmorl"}
    assert {cell.config.seed for cell in Plan(seeds=(8,)).cells(ITEMS["table1"], "raw")} == {8}


def test_the_raw_targets_are_five_per_cent_from_the_exact_front():
    exact = json.loads(Path("benchmarks/exact_front.json").read_text())["users"]
    for user, target in honest(CAR).targets.items():
        for value, best in zip(target, (exact[user]["time"], exact[user]["fuel"]), strict=True):
            assert value == pytest.approx(1.05 * best, abs=0.06)


def test_halfcheetahs_raw_targets_are_what_the_pilot_runs_propose():
    pilots = [read_record(Path("benchmarks/paper/records") / f"{cell.key}.json") for cell in FULL.pilots(CHEETAH)]
    found = proposals(pilots, min(USER_STEPS[CHEETAH], *(record.total_steps for record in pilots)))
    assert {each.user: tuple(each.target) for each in found} == dict(honest(CHEETAH).targets)
    assert not any(each.at_once for each in found)


def test_the_published_numbers_are_complete_and_fit_each_other():
    tables = published().tables
    for table in tables.values():
        assert len(table.rows) == 6 and set(table.targets) == {"A", "B", "C"}
        for row in table.rows:
            succeeded = 5 - row.timeouts
            if row.mean_steps is not None and row.timeouts:
                assert row.mean_steps >= row.timeouts / 5 * table.cap_steps  # time-outs count at the cap
            assert (row.mean_steps is None) == (succeeded == 0)
    assert tables["table1"].mean_steps("B", "pgmorl") == 5_000_000
    assert set(published().claims) == set(ITEMS) - set(tables)


def test_every_statement_of_a_figures_text_has_a_rule():
    for name, claims in published().claims.items():
        finals = ITEMS[name].kind == "final policies"
        assert set(claims.also) <= set(FINALS_STATEMENTS if finals else CURVE_STATEMENTS)
        assert set(claims.ahead) == (set() if finals else {"A", "B", "C"})


def test_deviations_of_rows_with_four_time_outs_follow_from_their_means():
    table = published().tables["table2"]
    rows = [row for row in table.rows if row.timeouts == 4]
    assert [(row.target, row.method) for row in rows] == [("B", "interactive"), ("C", "pgmorl")]
    for row in rows:
        runs = [table.cap_steps] * 4 + [5 * row.mean_steps - 4 * table.cap_steps]
        assert np.std(runs, ddof=1) == pytest.approx(row.std_steps, rel=1e-3)
        assert row.std_printed != pytest.approx(row.std_steps, rel=0.1)


def test_the_papers_time_is_that_of_all_its_runs():
    hours = [table.seconds / 3600 for table in published().tables.values()]
    assert hours == pytest.approx([10.2, 25.7], abs=0.05)


def test_the_command_line_knows_every_item():
    assert set(PAPER_ITEMS) == {*ITEMS, "targets"}

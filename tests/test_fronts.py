"""The report on fronts beside published ones, from runs of no length."""

import numpy as np
import pytest

from benchmarks.fronts import plan, report
from jmorl.experiments.cells import Places, known
from jmorl.experiments.runner import make
from jmorl.search.pareto import hypervolume

TINY = {
    "population": {"agents": 2, "warmup_iterations": 1, "iterations": 1},
    "ppo": {"environments": 2, "rollout_steps": 32},
    "steps": 512,
}


def test_without_runs_it_has_what_is_published(tmp_path):
    text = report.write_report(tmp_path, {}).read_text()
    assert "from 0 of 40 runs" in text
    assert "| published | 9 | 5.533e+06 ± 1.1e+05 | 2289 |" in text
    assert not list(tmp_path.glob("figures/*"))


def test_published_numbers_are_the_ones_of_the_task():
    found = [plan.published(env) for env in plan.TASKS]
    assert [there.hypervolume for there in found] == pytest.approx([5.53e6, 5.37e6, 2.05e7, 3.58e10], rel=0.01)
    assert [there.steps for there in found] == [30e6, 30e6, 48e6, 120e6]
    for env, there in zip(plan.TASKS, found, strict=True):
        if there.front is not None:  # of one seed of nine
            assert hypervolume(there.front, np.zeros(2)) == pytest.approx(there.hypervolume, rel=0.1), env


@pytest.mark.slow
def test_runs_are_laid_out_beside_it(tmp_path, monkeypatch):
    env = "pgmorl-hopper-v3"
    original = plan.cell

    def tiny(env, method, seed):
        found = original(env, method, seed)
        overrides = found.config.model_dump(mode="json") | {"steps": TINY["steps"]}
        sizes = {name: overrides[name] | TINY[name] for name in ("population", "ppo")}
        return type(found)(found.key, type(found.config).model_validate(overrides | sizes))

    monkeypatch.setattr(report, "cell", tiny)
    places = Places(tmp_path / "records", tmp_path / "work")
    cells = [tiny(env, method, 1) for method in plan.METHODS]
    for cell in cells:
        make([cell], places, lambda *_: None)
    records = known(cells, places)
    text = report.write_report(tmp_path, records).read_text()
    assert "from 2 of 40 runs" in text and "| PGMORL | 1 |" in text and "| interactive | 1 |" in text
    for record in records.values():
        result = report.Result(record)
        front = np.clip(result.front, 0, None)
        assert 0 <= result.hypervolumes[-1] <= front.max(axis=0).prod()
        assert result.reached(0.0) == (record.steps[0], record.seconds[0])
        assert result.reached(1e30) is None
    assert len(list(tmp_path.glob("figures/*.png"))) == 2

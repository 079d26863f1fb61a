"""Imports go one way, as the README says."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

# Part -> what it may import, of the project and of JAX. A part is a package, or a module of `jmorl`.
MAY_IMPORT = {
    "envs": {"jax"},
    "jmorl.search": set(),
    "jmorl.display": {"envs", "jmorl.search"},
    "jmorl.decision": {"envs", "jmorl.display", "jmorl.search"},
    "jmorl.config": {"envs", "jmorl.decision", "jmorl.search"},
    "jmorl.signals": set(),
    "jmorl.units": {"envs"},
    "jmorl.arguments": {"jmorl.config"},
    "jmorl.learning": {"envs", "jax", "jmorl.config"},
    "jmorl.scoring": {"jmorl.learning", "jmorl.units"},
    "jmorl.evaluation": {"envs", "jax", "jmorl.learning", "jmorl.storage"},
    "jmorl.playback": {"envs", "jax", "jmorl.learning", "jmorl.storage"},
    "jmorl.state": {"jmorl.config", "jmorl.search", "jmorl.units"},
    "jmorl.loop": {
        *("envs", "jax", "jmorl.config", "jmorl.decision", "jmorl.learning", "jmorl.scoring", "jmorl.search"),
        *("jmorl.state", "jmorl.units"),
    },
    "jmorl.storage": {
        *("envs", "jax", "jmorl.config", "jmorl.decision", "jmorl.learning", "jmorl.loop", "jmorl.search"),
        *("jmorl.state", "jmorl.units"),
    },
    "jmorl.report": {
        *("envs", "jmorl.config", "jmorl.decision", "jmorl.display", "jmorl.learning", "jmorl.playback"),
        *("jmorl.loop", "jmorl.search", "jmorl.state", "jmorl.storage"),
    },
    "jmorl.studio": {
        *("envs", "jax", "jmorl.config", "jmorl.decision", "jmorl.display", "jmorl.playback", "jmorl.report"),
        *("jmorl.loop", "jmorl.search", "jmorl.state", "jmorl.storage", "jmorl.units"),
    },
    "jmorl.paper": {
        *("envs", "jmorl.config", "jmorl.decision", "jmorl.display", "jmorl.learning", "jmorl.report", "jmorl.loop"),
        *("jmorl.search", "jmorl.signals", "jmorl.storage", "jmorl.units"),
    },
}
JAX = {"jax", "flax", "optax", "chex"}


def part(module):
    """The part that a module belongs to, or "jax", or None for other libraries."""
    names = module.split(".")
    if names[0] in JAX:
        return "jax"
    if names[0] == "envs":
        return "envs"
    return ".".join(names[:2]) if names[0] == "jmorl" else None


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        if isinstance(node, ast.ImportFrom) and node.module:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def files(name):
    place = ROOT.joinpath(*name.split("."))
    return sorted(place.rglob("*.py")) if place.is_dir() else [place.with_suffix(".py")]


@pytest.mark.parametrize("name", MAY_IMPORT)
def test_a_part_imports_only_what_it_may(name):
    for path in files(name):
        used = {part(module) for module in imports(path)} - {None, name}
        assert used <= MAY_IMPORT[name], path


def test_no_part_may_import_itself_by_way_of_others():
    TopologicalSorter(MAY_IMPORT).prepare()  # raises CycleError with the parts of a cycle


def test_every_part_is_in_the_list():
    parts = {part(".".join(path.relative_to(ROOT).with_suffix("").parts)) for path in (ROOT / "jmorl").rglob("*.py")}
    assert parts - {"jmorl.__init__", "jmorl.__main__", "jmorl.cli"} == set(MAY_IMPORT) - {"envs"}


def test_only_the_programs_compile_training():
    """One place decides what is traced: elsewhere in `learning` there is no `jit`."""
    for path in files("jmorl.learning"):
        assert ("jax.jit(" in path.read_text()) == (path.name == "programs.py"), path

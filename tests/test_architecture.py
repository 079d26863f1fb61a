"""Imports go one way, as the README says."""

import ast
from pathlib import Path

import pytest

import jmorl
from tests.imports import import_circle, import_graph, imported_names, modules

ROOT = Path(__file__).parent.parent
GRAPH = import_graph(ROOT, "envs", "jmorl")

# Part -> what it may import, of the project and of JAX. A part is a package, or a module of `jmorl`.
MAY_IMPORT = {
    "envs": {"jax"},
    "jmorl.settings": set(),
    "jmorl.search": {"jmorl.settings"},
    "jmorl.display": {"envs", "jmorl.search"},
    "jmorl.decision": {"envs", "jmorl.display", "jmorl.search"},
    "jmorl.module_path": set(),
    "jmorl.signals": set(),
    "jmorl.units": {"envs"},
    "jmorl.learning": {"envs", "jax", "jmorl.settings"},
    "jmorl.state": {"jmorl.search", "jmorl.units"},
    "jmorl.methods": {"envs", "jmorl.decision", "jmorl.search", "jmorl.state"},
    "jmorl.config_format": set(),
    "jmorl.presets": set(),
    "jmorl.config": {
        *("envs", "jmorl.config_format", "jmorl.decision", "jmorl.learning", "jmorl.methods", "jmorl.presets"),
        *("jmorl.search", "jmorl.settings"),
    },
    "jmorl.arguments": {"envs", "jmorl.config", "jmorl.display", "jmorl.presets", "jmorl.search", "jmorl.settings"},
    "jmorl.scoring": {"jmorl.learning", "jmorl.units"},
    "jmorl.evaluation": {"envs", "jax", "jmorl.learning", "jmorl.search", "jmorl.storage"},
    "jmorl.playback": {"envs", "jax", "jmorl.learning", "jmorl.storage"},
    "jmorl.events": {"jmorl.decision", "jmorl.search", "jmorl.state"},
    "jmorl.confirmation": {"jax", "jmorl.learning", "jmorl.scoring", "jmorl.search"},
    "jmorl.blending": {"jax", "jmorl.confirmation", "jmorl.learning", "jmorl.scoring", "jmorl.search"},
    "jmorl.loop": {
        *(
            "envs",
            "jmorl.blending",
            "jax",
            "jmorl.config",
            "jmorl.confirmation",
            "jmorl.decision",
            "jmorl.events",
            "jmorl.learning",
            "jmorl.methods",
        ),
        *("jmorl.scoring", "jmorl.search", "jmorl.state", "jmorl.units"),
    },
    "jmorl.storage": {
        *("envs", "jax", "jmorl.config", "jmorl.decision", "jmorl.display", "jmorl.events", "jmorl.learning"),
        *("jmorl.loop", "jmorl.methods", "jmorl.search", "jmorl.state", "jmorl.units"),
    },
    "jmorl.report": {
        *("envs", "jmorl.config", "jmorl.decision", "jmorl.display", "jmorl.events", "jmorl.learning"),
        *("jmorl.playback", "jmorl.loop", "jmorl.search", "jmorl.state", "jmorl.storage"),
    },
    "jmorl.studio": {
        *("envs", "jax", "jmorl.config", "jmorl.decision", "jmorl.display", "jmorl.evaluation", "jmorl.events"),
        *("jmorl.learning", "jmorl.playback"),
        *("jmorl.methods", "jmorl.presets", "jmorl.report", "jmorl.loop", "jmorl.search", "jmorl.state"),
        *("jmorl.storage", "jmorl.units"),
    },
    "jmorl.experiments": {
        *("envs", "jax", "jmorl.config", "jmorl.confirmation", "jmorl.decision", "jmorl.display", "jmorl.events"),
        *("jmorl.learning", "jmorl.loop", "jmorl.report", "jmorl.search", "jmorl.signals", "jmorl.storage"),
    },
    "jmorl.paper": {
        *("envs", "jmorl.config", "jmorl.decision", "jmorl.display", "jmorl.events", "jmorl.experiments"),
        *("jmorl.presets", "jmorl.report", "jmorl.search", "jmorl.signals", "jmorl.storage", "jmorl.units"),
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
    return imported_names(path, ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"))


def files(name):
    return list(modules(ROOT, name).values()) or [ROOT.joinpath(*name.split(".")).with_suffix(".py")]


@pytest.mark.parametrize("name", MAY_IMPORT)
def test_a_part_imports_only_what_it_may(name):
    for path in files(name):
        used = {part(module) for module in imports(path)} - {None, name}
        assert used <= MAY_IMPORT[name], path


def test_no_part_may_import_itself_by_way_of_others():
    assert import_circle(MAY_IMPORT) == []


def test_no_module_imports_itself_by_way_of_others():
    """Imports inside functions and those for type checking count, too."""
    assert import_circle(GRAPH) == []


def test_what_learns_knows_neither_the_config_nor_who_decides():
    reached, new = set(), {module for module in GRAPH if module.startswith("jmorl.learning")}
    while new:
        reached |= new
        new = {imported for module in new for imported in GRAPH[module]} - reached
    assert not [module for module in reached if module.startswith(("jmorl.config", "jmorl.decision", "jmorl.loop"))]


def test_every_part_is_in_the_list():
    parts = {part(module) for module in GRAPH if module.startswith("jmorl.")}
    assert parts - {"jmorl.__main__", "jmorl.cli"} == set(MAY_IMPORT) - {"envs"}


def test_no_package_hides_one_of_its_modules_behind_a_name_that_it_exports():
    for path in [*files("envs"), *(ROOT / "jmorl").rglob("__init__.py")]:
        if path.name == "__init__.py":
            modules = {each.stem for each in path.parent.iterdir()}
            assert not modules & {name.rpartition(".")[2] for name in imports(path)} - {"__init__"}, path


def test_one_place_makes_the_runs_of_comparisons():
    """Runs made elsewhere are another file beside it: nothing else trains, or opens a run to go on with it."""
    for name in ("jmorl.experiments", "jmorl.paper"):
        for path in files(name):
            trains = any(module.startswith(("jmorl.learning.", "jmorl.storage.resume.")) for module in imports(path))
            assert trains == (path == ROOT / "jmorl" / "experiments" / "runner.py"), path


def test_comparisons_are_of_any_methods():
    """Nothing in them depends on which method a run has."""
    for path in files("jmorl.experiments"):
        for node in ast.walk(ast.parse(path.read_text())):
            compared = [node.left, *node.comparators] if isinstance(node, ast.Compare) else []
            assert not any(isinstance(each, ast.Attribute) and each.attr == "method" for each in compared), path


def test_only_the_programs_compile_training():
    """One place decides what is traced: elsewhere in `learning` there is no `jit`."""
    for path in files("jmorl.learning"):
        assert ("jax.jit(" in path.read_text()) == (path.name == "programs.py"), path


def test_every_public_name_can_be_imported():
    """Names are imported when they are first used: one without a home would be missed by nobody but a user."""
    for name in jmorl.__all__:
        assert getattr(jmorl, name) is not None

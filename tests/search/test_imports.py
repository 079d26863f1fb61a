"""The search is host-side arithmetic: it knows neither JAX nor the environments, directly or through others."""

import ast
from pathlib import Path

import jmorl.search

FILES = sorted(Path(jmorl.search.__file__).parent.rglob("*.py"))


def imported_modules(source: str) -> set[str]:
    modules = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide where they lead"
            modules.add(node.module or "")
    return modules


def test_search_imports_arithmetic_and_itself_only() -> None:
    modules = set().union(*(imported_modules(file.read_text()) for file in FILES))
    ours = {module for module in modules if module.split(".")[0] in ("jmorl", "envs")}
    theirs = {module.split(".")[0] for module in modules - ours}
    assert len(FILES) > 8 and "numpy" in theirs
    assert all(module.startswith("jmorl.search.") for module in ours)
    assert not theirs & {"jax", "jaxlib", "flax", "optax", "chex"}

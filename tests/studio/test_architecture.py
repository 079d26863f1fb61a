"""In the studio imports go one way: the page knows its panels, a panel knows the tab and the charts."""

import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest

from tests.imports import import_circle, import_graph, imported_names, modules

ROOT = Path(__file__).parent.parent.parent
STUDIO = import_graph(ROOT, "jmorl.studio")
PANELS = modules(ROOT, "jmorl.studio.panels")
NO_PANELS = {
    "jmorl.studio.panels",
    "jmorl.studio.panels.panel",
    "jmorl.studio.panels.drawing",
    "jmorl.studio.panels.lost",
    "jmorl.studio.panels.player",
}  # what panels share
TABS = {"jmorl.studio.tab", "jmorl.studio.home_tab"}
PAGES = {"jmorl.studio.page", "jmorl.studio.home_page", "jmorl.studio.server"}


def test_no_modules_of_the_studio_import_each_other_in_a_circle():
    assert import_circle(STUDIO) == []


@pytest.mark.parametrize("panel", sorted(set(PANELS) - NO_PANELS))
def test_a_panel_knows_one_tab_no_other_panel_and_no_page(panel):
    beside = STUDIO[panel] & (set(PANELS) | PAGES)
    assert beside <= NO_PANELS
    assert len(STUDIO[panel] & TABS) == 1


@pytest.mark.parametrize("module", [*sorted(TABS), *modules(ROOT, "jmorl.studio.charts")])
def test_neither_the_tab_nor_a_chart_makes_widgets(module):
    path = modules(ROOT, "jmorl.studio")[module]
    widgets = {name for name in imported_names(path, module) if name.startswith("nicegui")} - {"nicegui.run"}
    assert not widgets and not any(name.startswith("jmorl.studio.panels") for name in STUDIO[module])


def test_an_installed_studio_has_the_files_of_its_pages():
    """NiceGUI is silent about a component whose file is missing."""
    data = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]
    files = [path for path in (ROOT / "jmorl/studio").rglob("*") if path.suffix in (".js", ".css")]
    assert {path.name for path in files} >= {"studio.css", "player.js", "policy_table.js", "run_list.js"}
    for path in files:
        package = ".".join(path.parent.relative_to(ROOT).parts)
        assert any(fnmatch(path.name, pattern) for pattern in data.get(package, [])), path

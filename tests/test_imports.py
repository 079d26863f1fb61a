"""Which modules import which is read rightly, in packages made by hand."""

import pytest

from tests.imports import import_circle, import_graph


def write(root, files):
    for name, source in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(source)


@pytest.mark.parametrize(
    ("source", "imported"),
    [
        ("import a.b", {"a.b"}),
        ("from a import b", {"a.b"}),
        ("from a import NAME", {"a"}),
        ("from a.b import NAME", {"a.b"}),
        ("from . import b", {"a.b"}),
        ("from .b import NAME", {"a.b"}),
        ("import a.inner", {"a.inner"}),
        ("def later():\n    from a import b", {"a.b"}),
        ("if TYPE_CHECKING:\n    from a.b import NAME", {"a.b"}),
        ("import json, a.b", {"a.b"}),
        ("from a.inner import module", {"a.inner.module"}),
    ],
)
def test_every_way_to_import_is_seen(tmp_path, source, imported):
    write(tmp_path, {f"a/{name}.py": "" for name in ("__init__", "b", "inner/__init__")})
    write(tmp_path, {"a/c.py": source, "a/inner/module.py": "from ..b import NAME"})
    graph = import_graph(tmp_path, "a")
    assert graph["a.c"] == imported and graph["a.inner.module"] == {"a.b"}


def test_a_circle_is_named_in_its_order(tmp_path):
    under = "if TYPE_CHECKING:\n    from a.page import Page"
    write(
        tmp_path, {"a/page.py": "from a.panel import Panel", "a/panel.py": "from a.tab import Tab", "a/tab.py": under}
    )
    write(tmp_path, {"a/__init__.py": "from a.page import Page", "a/server.py": "import a"})
    circle = import_circle(import_graph(tmp_path, "a"))
    assert circle[0] == circle[-1] and set(circle) == {"a.page", "a.panel", "a.tab"}
    assert circle[circle.index("a.panel") + 1] == "a.tab"
    (tmp_path / "a" / "tab.py").write_text("")
    assert import_circle(import_graph(tmp_path, "a")) == []

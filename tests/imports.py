"""What the modules of the project import, read from their source: nothing is run."""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path


def modules(root, package):
    """Return the files of all modules in a package below `root`, by full name; `a/__init__.py` is the module `a`."""
    found = {}
    for path in sorted((root / Path(*package.split("."))).rglob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported_names(path, module):
    """Yield the full name of everything that a file imports, as `package.module` or `package.module.name`.

    All imports count: those inside functions and those under `TYPE_CHECKING`, too. Relative ones are resolved against
    `module`, the file's own full name. Modules that are imported by a computed name are not seen.
    """
    package = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        if isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            origin = ".".join([*base, *filter(None, [node.module])])
            yield from (f"{origin}.{alias.name}" for alias in node.names)


def import_graph(root, *packages):
    """Return which modules of the packages each of their modules imports: `{"a.b": {"a.c", ...}, ...}`.

    A name stands for the module that it is, or else for the module that it is taken from: `from a import b` is an
    import of `a.b` where that is a module, and of `a` where it is not. An import of `a.b` is none of `a`.
    """
    files = {name: path for package in packages for name, path in modules(root, package).items()}
    graph = {}
    for module, path in files.items():
        nearest = {_nearest(name, files) for name in imported_names(path, module)}
        graph[module] = nearest - {None, module}
    return graph


def import_circle(graph):
    """Return modules that import each other in a circle, the first one again at the end; an empty list without any."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1][::-1]  # graphlib lists what is imported before what imports it
    return []


def _nearest(name, modules):
    """Return the module that a name is or is taken from; None if it is from elsewhere."""
    while name and name not in modules:
        name = name.rpartition(".")[0]
    return name or None

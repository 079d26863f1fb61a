"""Which modules this program finds. `jmorl` imports this module before all others.

A folder that somebody works in may hold an `envs.py` or a `numpy.py` of their own. So `envs` is always the package
beside this one, and the working directory is searched last.
"""

import os
import sys
from contextlib import suppress
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path

BESIDE = Path(__file__).parents[1]


def working_directory_last() -> None:
    """Let modules of the working directory be found, after all others."""
    with suppress(FileNotFoundError):  # it has been deleted
        if os.getcwd() not in sys.path:
            sys.path.append(os.getcwd())


def _take_back_first_place() -> None:
    """Put the working directory last where `python -m` has put it first."""
    with suppress(FileNotFoundError):
        if sys.argv[:1] == ["-m"] and sys.path[0] == os.getcwd():  # as documented, until Python has found the module
            sys.path.append(sys.path.pop(0))


def _import_own_envs() -> None:
    """Import `envs` from beside this package. Raise ImportError if another package has that name already."""
    loaded = sys.modules.get("envs")
    if loaded:
        place = Path(loaded.__file__ or "")
        if place.resolve().parent != (BESIDE / "envs").resolve():
            raise ImportError(
                f"jmorl needs its own package `envs`, but {place} has been imported under this name; rename that one"
            )
        return
    spec = PathFinder.find_spec("envs", [str(BESIDE)])
    if spec is None or spec.loader is None:
        raise ImportError(f"{BESIDE} has no package `envs`; install jmorl again")
    sys.modules["envs"] = module_from_spec(spec)
    try:
        spec.loader.exec_module(sys.modules["envs"])
    except BaseException:
        del sys.modules["envs"]
        raise


_take_back_first_place()
REFUSED: Exception | None = None  # why JAX cannot be imported, which the command line says
try:
    _import_own_envs()
except (ValueError, RuntimeError) as error:  # a variable of JAX's own has a value that it cannot read
    REFUSED = error

"""What a new user of `make demo` waits for, after installation; printed and kept in `benchmarks/demo.json`.

    python -m benchmarks.demo               (2 minutes)
    python -m benchmarks.demo --out FILE --steps 480000     any more flags are for `jmorl train`

The commands are those that `make` gives for the demo, with `--json`, each a process of its own. Seconds count from the
start of the first, imports included, to the lines that it prints: once with nothing compiled, once with what that left.
The end is that of the last command, which shows tables and draws plots.
"""

import argparse
import json
import os
import shlex
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

from rich.table import Table

from benchmarks.speed import machine
from jmorl.display.console import PlainConsole
from jmorl.learning.devices import use_all_cpu_cores

HERE = Path(__file__).parent
BARS = {"cold": {"first generation": 40.0}, "warm": {"first generation": 15.0, "end": 90.0}}  # seconds


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=HERE / "demo.json", help="default: benchmarks/demo.json")
    options, flags = parser.parse_known_args()
    use_all_cpu_cores()
    report: dict[str, Any] = {"machine": machine(), "bars": BARS}
    with tempfile.TemporaryDirectory() as folder:
        for cache in BARS:
            report[cache] = waited(Path(folder), flags)
    options.out.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    PlainConsole().print(table(report))


def waited(folder: Path, flags: list[str]) -> dict[str, float]:
    """Seconds to each thing that a user sees of the demo; in the folder are its run and what was compiled before."""
    train, *others = commands(folder / "run")
    environment = {**os.environ, "JAX_COMPILATION_CACHE_DIR": str(folder / "jax")}
    started = time.perf_counter()
    seconds: dict[str, float] = {}
    with subprocess.Popen([*train, *flags, "--json"], cwd=HERE.parent, env=environment, stdout=subprocess.PIPE) as demo:
        assert demo.stdout is not None
        for line in demo.stdout:
            seconds.setdefault(_name(json.loads(line)), round(time.perf_counter() - started, 2))
    if demo.returncode:
        raise subprocess.CalledProcessError(demo.returncode, train)
    for command in others:
        subprocess.run(command, cwd=HERE.parent, env=environment, stdout=subprocess.DEVNULL, check=True)
    return {**seconds, "end": round(time.perf_counter() - started, 2)}


def commands(run: Path) -> list[list[str]]:
    """Return what `make demo` would run, but for the installation."""
    make = ["make", "--no-print-directory", "--dry-run", "demo", f"DEMO_OUT={run}"]
    lines = subprocess.run(make, cwd=HERE.parent, check=True, capture_output=True, encoding="utf-8").stdout.splitlines()
    return [words for words in map(shlex.split, lines) if Path(words[0]).name == "jmorl"]


def _name(event: dict[str, Any]) -> str:
    match event:
        case {"event": "generation", "generation": 0}:
            return "warm-up"
        case {"event": "generation"}:
            return "first generation"
        case {"event": "decided"}:
            return "first choice"
    return str(event["event"])


def table(report: dict[str, Any]) -> Table:
    """Return the report for people."""
    shown = Table("seconds until", *BARS, "bar", title="make demo, compilation cache cold and warm")
    for name in report["cold"]:
        bars = [f"{cache} {bar[name]:g}" for cache, bar in BARS.items() if name in bar]
        shown.add_row(name, *(f"{report[cache][name]:.1f}" for cache in BARS), ", ".join(bars))
    return shown


if __name__ == "__main__":
    main()

"""How the studio feels, and what it costs; in a real browser. `make bench-studio` prints it and keeps it.

interaction   from a click on a policy to the page that shows it, with a front of 2,000 policies of three objectives
first look    from the click that begins a run in the form to its first policies on the page, with warm caches
question      from the click on a choice to the page with the next question on MountainCar, less the generation's own
              time
serving       how much longer the generations of a run take in the studio than those of `jmorl train`: with no page,
              with one, whose browser runs on the same processors, and with a policy playing on it
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from playwright.sync_api import Page
from rich.table import Table

from benchmarks.speed import machine
from jmorl.config import resolve
from jmorl.decision.protocol import Question
from jmorl.display.console import PlainConsole
from jmorl.methods.base import Prospect
from jmorl.search.policy import Policy
from jmorl.storage.layout import Layout
from jmorl.storage.stored_run import read_run
from jmorl.studio.session import Session
from jmorl.studio.view import Generation, View
from tests.studio.browsing import chromium

RESULTS = Path(__file__).parent / "studio.json"
POLICIES, PORT, CLICKS, REPEATS, LOOKS = 2000, 8765, 20, 4, 3
BEGUN = ("mo-mountaincarcontinuous-v0", "mo-halfcheetah-v5")
# Time in the browser, from a click on the n-th row in sight to the first picture that has the row and its card.
CLICK = """(n) => new Promise((done) => {
  const row = document.querySelectorAll(".policies-row")[n], started = performance.now();
  const policy = row.children[1].textContent;
  const look = () => {
    const card = document.querySelector(".place.focus .card-title")?.textContent;
    const focused = document.querySelector(".policies-row.focus")?.children[1].textContent;
    if (card === `policy ${policy}` && focused === policy)
      requestAnimationFrame(() => setTimeout(() => done(performance.now() - started)));
    else requestAnimationFrame(look);
  };
  row.click();
  look();
})"""
# The same from a choice to the next question.
CHOOSE = """(question) => new Promise((done) => {
  const heading = document.querySelector(".heading"), started = performance.now();
  const observer = new MutationObserver(() => {
    if (!heading.textContent.startsWith(question)) return;
    observer.disconnect();
    requestAnimationFrame(() => setTimeout(() => done((performance.now() - started) / 1000)));
  });
  observer.observe(heading, { characterData: true, childList: true, subtree: true });
  document.querySelector(".place.focus .choose").click();
})"""
WHAT = "still: serve a question about many policies, and no more; look: measure the first look alone"
SERVED = ("alone", "served", "with a page", "with a policy playing")


class Still(Session):
    """A session at a question about many policies, of a run that there is not."""

    def __init__(self, policies: int, objectives: int, label: str):
        super().__init__()
        config = resolve(overrides={"env": "mo-halfcheetah-v5", "user": "terminal"})
        names = tuple(
            replace(config_objective, name=f"o{index}", label=f"{label} {index + 1}")
            for index, config_objective in enumerate([_objective()] * objectives)
        )
        generator = np.random.default_rng(0)
        directions = np.abs(generator.normal(size=(policies, objectives)))
        values = 1000 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
        front = tuple(_policy(number, each) for number, each in enumerate(values))
        bounds = np.full(objectives, 150.0)
        question = Question("steer", 4, names, front, bounds, 0)
        generations = tuple(
            Generation(number, values[:: 4 - number] * (0.7 + 0.1 * number), 1e6 * number, 1e8 * (1 + number), None)
            for number in range(4)
        )
        self.view = View(
            Path("synthetic"), "synthetic", config, names, generations, front, bounds, front[0], (), None,
            question=question,
        )  # fmt: skip

    def work_out(self, policy: int) -> None:
        """Make up what choosing a policy would mean."""
        values = self.view.values
        bounds = values[policy] - 100
        expected = values[policy] + np.random.default_rng(policy).normal(size=(40, values.shape[1])) * 50
        prospect = Prospect(bounds, (values >= bounds).all(axis=1), expected, odds=0.25)
        if policy not in self.prospects:
            self.prospects = {**self.prospects, policy: prospect}

    def history(self) -> tuple[()]:
        """Return no branches."""
        return ()


def _objective() -> Any:
    from envs.core import Objective

    return Objective("o", "objective", "units")


def _policy(number: int, values: np.ndarray) -> Policy:
    weights = np.full(len(values), 1 / len(values))
    return Policy(number, number % 4, None, weights, values, np.full(len(values), 5.0), values, None)


@contextmanager
def served(*command: str) -> Iterator[None]:
    """Run a server in a process of its own, on PORT."""
    process = subprocess.Popen([sys.executable, "-m", *command], stdout=subprocess.DEVNULL)
    try:
        while True:
            try:
                httpx.get(f"http://127.0.0.1:{PORT}")
                break
            except httpx.TransportError:
                assert process.poll() is None, "the server has ended"
                time.sleep(0.1)
        yield
    finally:
        process.terminate()
        process.wait()


@contextmanager
def browser_page() -> Iterator[Page]:
    """Hold a browser with the page open."""
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(f"http://127.0.0.1:{PORT}")
        yield page


def interaction() -> list[float]:
    """Milliseconds from a click to what it shows, for clicks on several policies."""
    with served("benchmarks.studio", "still"), browser_page() as page:
        page.wait_for_selector(".policies-row")
        page.wait_for_timeout(2000)
        return [float(page.evaluate(CLICK, number % 9)) for number in range(CLICKS)]


def first_look(folder: Path, env: str) -> list[float]:
    """Seconds from the click on *Begin* to the first policies, for some runs after one that warms the caches."""
    waited = []
    folder.mkdir()
    for _ in range(1 + LOOKS):
        with served("jmorl.cli", "studio", str(folder), "--port", str(PORT)), browser_page() as page:
            page.get_by_label("Environment", exact=True).click()
            page.get_by_role("option", name=env).click()
            started = time.monotonic()
            page.get_by_role("button", name="Begin").click()
            page.get_by_text("still learning").first.wait_for(timeout=300_000)
            waited.append(time.monotonic() - started)
    return waited[1:]


def question(folder: Path) -> list[float]:
    """Seconds between a choice and the next question that were not the generation's own."""
    waited = []
    run = str(folder / "question")
    with served("jmorl.cli", "studio", "--out", run, "--port", str(PORT), "--ask", "always"), browser_page() as page:
        page.get_by_text("Round 1: which of these").wait_for(timeout=300_000)
        for generation in range(2, 7):
            page.locator(".policies-row").first.click()
            page.locator(".place.focus .choose").wait_for()
            page.wait_for_timeout(1000)
            waited.append(float(page.evaluate(CHOOSE, f"Round {generation}: which of these")))
    return (np.array(waited) - _seconds(folder / "question")[: len(waited)]).tolist()


def serving(folder: Path) -> dict[str, list[float]]:
    """Seconds of all generations of a run with an artificial user, in each way of `SERVED`; they take turns."""
    seconds: dict[str, list[float]] = {way: [] for way in SERVED}
    settings = ["--user", "A", "--steps", "1700000"]
    for repeat in range(REPEATS):
        for way in SERVED:
            path = folder / f"{way}-{repeat}"
            if way == "alone":
                command = [sys.executable, "-m", "jmorl.cli", "train", "--quiet", "--out", str(path), *settings]
                subprocess.run(command, check=True)
            else:
                with served("jmorl.cli", "studio", "--out", str(path), "--port", str(PORT), *settings):
                    _follow(path, with_page=way.startswith("with"), playing=way == SERVED[-1])
            seconds[way].append(float(_seconds(path).sum()))
    return seconds


def _follow(path: Path, with_page: bool, playing: bool) -> None:
    """Wait for the end of a run that is being served."""
    with browser_page() if with_page else nullcontext() as page:
        if page and playing:
            page.locator(".policies-row").first.click(timeout=300_000)
        while not Layout(path).result.exists():
            time.sleep(0.5)


def _seconds(path: Path) -> np.ndarray:  # [G]
    """Return what each generation after the warm-up took."""
    metrics = read_run(path).metrics
    return np.asarray(sum(metrics[f"{part}_seconds"] for part in ("select", "train", "evaluate")))[1:]


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="?", choices=["still", "look"], help=WHAT)
    parser.add_argument("--objectives", type=int, default=3, help="of that question")
    parser.add_argument("--label", default="objective", help="of these objectives, before their number")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=PORT)
    options = parser.parse_args()
    if options.what == "still":
        from jmorl.studio.server import address, serve

        print(f"The studio is at {address(options.host, options.port, None)}", flush=True)
        serve(Still(POLICIES, options.objectives, options.label), options.host, options.port, None)
        return
    with tempfile.TemporaryDirectory() as folder:
        looks = {env: first_look(Path(folder) / env, env) for env in BEGUN}
        if options.what == "look":
            kept = json.loads(RESULTS.read_text(encoding="utf-8"))
            RESULTS.write_text(json.dumps({**kept, "first_look_seconds": looks}, indent=2) + "\n", encoding="utf-8")
            return
        clicks, waits, seconds = interaction(), question(Path(folder)), serving(Path(folder))
    shares = {way: statistics.median(seconds[way]) / statistics.median(seconds["alone"]) - 1 for way in SERVED[1:]}
    results = {
        "machine": machine(),
        "interaction_milliseconds": {"median": statistics.median(clicks), "most": max(clicks)},
        "first_look_seconds": looks,
        "question_seconds": {"median": statistics.median(waits), "most": max(waits)},
        "serving": {"seconds": seconds, "share": shares},
    }
    RESULTS.write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")
    table = Table("what", "median", "most")
    table.add_row(f"click, with {POLICIES} policies", f"{statistics.median(clicks):.0f} ms", f"{max(clicks):.0f} ms")
    for env, found in looks.items():
        table.add_row(f"Begin to first policies, {env}", f"{statistics.median(found):.1f} s", f"{max(found):.1f} s")
    table.add_row(
        "choice to next question, besides training", f"{statistics.median(waits):.2f} s", f"{max(waits):.2f} s"
    )
    for way, share in shares.items():
        table.add_row(f"training, {way}", f"{100 * share:+.1f} %", "")
    PlainConsole().print(table)


if __name__ == "__main__":
    main()

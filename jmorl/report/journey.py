"""The journey of a run as one page that needs no network: its result, favourites, every question, the plots."""

import base64
import io
from collections.abc import Sequence
from html import escape
from pathlib import Path

import envs
from jmorl.display.console import PlainConsole
from jmorl.display.readings import confirmed_in_words, values_in_words, writers_for
from jmorl.display.text import plural
from jmorl.report.tables import run_tables
from jmorl.search.policy import Policy, values_of
from jmorl.storage.files import written_whole
from jmorl.storage.layout import Layout
from jmorl.storage.notes_file import Note
from jmorl.storage.stored_run import StoredRun

WIDTH = 110  # characters of the tables
STYLE = """
:root { color-scheme: light dark; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
img { max-width: 100%; background: white; border-radius: 6px; margin: 0.5rem 0; }
pre { overflow-x: auto; font-size: 12.5px; line-height: 1.35; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
.note { white-space: pre-line; margin: 0.2rem 0 0.8rem; overflow-wrap: anywhere; }
"""
FAVOURITE = "★ "
HOW_TO = """\
import jmorl
policy = jmorl.load_policy("{file}")
action = policy(observation)  # {observation} numbers, as the environment observes them, to {action}"""


def how_to(env: str, file: str) -> str:
    """Return the lines of Python that use a policy file made in an environment."""
    environment = envs.make(env)
    return HOW_TO.format(file=file, observation=environment.observation_size, action=environment.action_size)


def write_journey(run: StoredRun, plots: Sequence[Path], path: Path) -> None:
    """Write the page of a run, with its plots, which are PNG files. Raises OSError."""
    page = journey_page(run, plots)
    with written_whole(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def journey_page(run: StoredRun, plots: Sequence[Path]) -> str:
    """Return an HTML page about a run, with its plots. Raises OSError for a plot that cannot be read."""
    title = f"{run.notes.run.named(run.path.name)}: {run.config.env}"
    asked = sum(not getattr(record, "stand_in", False) for record in run.decisions)
    parts = [
        f"<h1>{escape(title)}</h1>",
        f"<p>{escape(_result(run))} It took {plural(len(run.metrics['generation']) - 1, 'round')} of training and "
        f"{plural(asked, 'answer')}.</p>",
        *_text(run.notes.run),
    ]
    if run.chosen:
        lines = how_to(run.config.env, Layout(run.path).chosen.name)
        where = (
            f"{Layout(run.path).chosen.name} is in the folder of the run; the studio saves it under a name of its own."
        )
        parts += ["<h2>How to use the policy</h2>", f"<p>{escape(where)}</p>", f"<pre>{escape(lines)}</pre>"]
    noted = _noted(run)
    parts += ["<h2>Favourites and notes</h2>", f"<ul>{''.join(noted)}</ul>"] if noted else []
    parts += ["<h2>Pictures</h2>", *(_picture(plot) for plot in plots)] if plots else []
    parts += ["<h2>The run in numbers</h2>", f"<pre>{escape(_tables(run))}</pre>"]
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{STYLE}</style>'
    viewport = '<meta name="viewport" content="width=device-width, initial-scale=1">'
    body = "\n".join(parts)
    return f'<!doctype html>\n<html lang="en"><head>{head}{viewport}</head>\n<body>\n{body}\n</body></html>\n'


def _result(run: StoredRun) -> str:
    """Say what came of a run."""
    if run.chosen is None:
        return "The run has not ended."
    scores = confirmed_in_words(run.chosen, run.objectives) or _scores(run, run.chosen)
    return f"The result is {run.notes.policy(run.chosen.id).named(f'policy {run.chosen.id}')}: {scores}."


def _noted(run: StoredRun) -> list[str]:
    """Return an item for each policy that somebody has noted something about, favourites first."""
    notes = run.notes
    known = [policy for policy in run.policies if policy.id in notes.policies]
    known.sort(key=lambda policy: not notes.policy(policy.id).favourite)
    return [_item(run, policy, notes.policy(policy.id)) for policy in known]


def _item(run: StoredRun, policy: Policy, note: Note) -> str:
    name = f"{FAVOURITE if note.favourite else ''}{note.named(f'policy {policy.id}')}"
    return "".join([f"<li><b>{escape(name)}</b>: {escape(_scores(run, policy))}", *_text(note), "</li>"])


def _text(note: Note) -> list[str]:
    return [f'<p class="note">{escape(note.text)}</p>'] if note.text else []


def _scores(run: StoredRun, policy: Policy) -> str:
    return values_in_words(policy.values, writers_for(values_of(run.front), run.objectives))


def _picture(plot: Path) -> str:
    data = base64.b64encode(plot.read_bytes()).decode("ascii")
    return f'<img alt="{escape(plot.stem.replace("_", " "), quote=True)}" src="data:image/png;base64,{data}">'


def _tables(run: StoredRun) -> str:
    """Return what `jmorl show` prints."""
    text = io.StringIO()
    console = PlainConsole(file=text, width=WIDTH)
    for table in run_tables(run):
        console.print(table)
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines())

"""Runs that are broken off and taken up again, and what they are compared by."""

import csv
import io
import itertools
import json

import envs
from jmorl.decision.protocol import DecisionMaker
from jmorl.decision.users import make_user
from jmorl.storage.policy_file import load_policy
from jmorl.storage.resume import Continued, resume
from jmorl.storage.run_folder import RunFolder

TIMES = ("steps_per_second", "select_seconds", "train_seconds", "evaluate_seconds", "total_seconds")


class Counting(DecisionMaker):
    """The config's user, counting what it is asked."""

    def __init__(self, config):
        self.user = make_user(config.user, envs.make(config.env).objectives)
        self.asked = []

    def answer(self, question):
        self.asked.append((question.purpose, question.generation))
        return self.user.answer(question)

    def utility(self, values):
        return self.user.utility(values)


def follow(continued, user=None, events=None):
    """Record a run, or its next events only; the folder is closed then, as if the process had ended."""
    with continued.folder as folder:
        for _ in itertools.islice(continued.events(user), events):
            pass
    return folder.path


def train(path, config, **how):
    return follow(Continued(RunFolder.create(path, config, envs.make(config.env)), None), **how)


def go_on(path, **how):
    continued = resume(path)
    return follow(continued, **how), continued.notes


def timeless(text):
    rows = csv.DictReader(io.StringIO(text))
    return [{name: cell for name, cell in row.items() if name not in TIMES} for row in rows]


def outcome(path):
    """All that a run leaves but what tells one process or one time from another."""
    files = {str(file.relative_to(path)) for file in path.rglob("*") if file.is_file() and "arrays" not in file.parts}
    policies = {}
    for file in (path / "policies").iterdir():
        policy = load_policy(file)
        arrays = [array.tobytes() for layer in policy.layers for array in layer]
        policies[file.name] = ({**policy.header, "run": None}, arrays, policy.observation_mean.tobytes())
    texts = [(path / name).read_bytes() for name in ("policies.csv", "front.csv", "decisions.jsonl")]
    result = json.loads((path / "result.json").read_text())
    return files, policies, texts, timeless((path / "metrics.csv").read_text()), result["chosen"], result["reason"]

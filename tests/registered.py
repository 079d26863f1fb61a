"""Registers a probe environment, for processes that know it only by `--env tests.registered:probe-three-ways`."""

import envs
from tests.probes import ThreeWays

envs.register(ThreeWays.id, ThreeWays)

"""Registers probe environments, for processes that know them only by `--env tests.registered:probe-three-ways`."""

import envs
from tests.probes import FaultyLater, ThreeWays

envs.register(ThreeWays.id, ThreeWays)
envs.register(FaultyLater.id, FaultyLater)

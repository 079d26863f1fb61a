"""Registers an environment that breaks the contract, apart from those that every environment's tests find."""

import envs
from tests.probes import FaultyLater

envs.register(FaultyLater.id, FaultyLater)

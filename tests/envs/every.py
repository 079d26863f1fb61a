"""Every registered environment, for tests of what all promise."""

import pytest

import envs

# The models and most of the code of these are tested with others at once.
LATER = {"mo-hopper-2obj-v5", "pgmorl-halfcheetah-v2", "pgmorl-walker2d-v2", "pgmorl-hopper-v2"}
EVERY = [pytest.param(id, marks=pytest.mark.slow) if id in LATER else id for id in envs.ids()]

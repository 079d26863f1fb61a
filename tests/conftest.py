"""One JAX set-up for the whole suite: two CPU devices, whatever the machine, and compiled programs kept on disk."""

import hypothesis
import jax

from jmorl.learning.devices import use_all_cpu_cores

use_all_cpu_cores()
jax.config.update("jax_num_cpu_devices", 2)
# Examples are the same in every run, and a slow machine is no failure.
hypothesis.settings.register_profile("jmorl", deadline=None, derandomize=True)
hypothesis.settings.load_profile("jmorl")

"""Programs under settings of their own, and JAX's failures as one sentence."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jmorl.cli import main
from jmorl.learning.execution import ComputationFailed, compile_for, own_settings, result_of


def test_a_result_is_on_the_host():
    assert isinstance(result_of(jax.jit(lambda x: x + 1), np.ones(3, np.float32)), np.ndarray)


@pytest.mark.parametrize(
    "setting",
    [
        lambda: jax.enable_x64(True),
        lambda: jax.disable_jit(True),
        lambda: jax.numpy_dtype_promotion("strict"),
        lambda: jax.numpy_rank_promotion("raise"),
        lambda: jax.debug_nans(True),
        lambda: jax.transfer_guard("disallow"),
    ],
)
def test_settings_from_outside_change_nothing(setting):
    function = jax.jit(lambda x: (jnp.ones((2, 3)) + x + jnp.arange(3)) * jnp.array([0.0, 1.0, jnp.inf]) * 0)
    argument = np.ones(3, np.float32)
    expected = result_of(function, argument)
    with setting():
        found = result_of(compile_for(function, argument), argument)
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, expected)


def test_a_module_that_switches_64_bits_on_changes_nothing():
    try:
        with own_settings():
            jax.config.update("jax_enable_x64", True)
            assert jnp.zeros(1).dtype == np.float32
    finally:
        jax.config.update("jax_enable_x64", False)


def failing(*_):
    raise jax.errors.JaxRuntimeError("RESOURCE_EXHAUSTED: Out of memory allocating 160 bytes.\nand more")


def test_a_failure_is_one_sentence():
    with pytest.raises(ComputationFailed) as error:
        result_of(failing)
    assert str(error.value).startswith("JAX cannot compute this: RESOURCE_EXHAUSTED: Out of memory allocating 160")
    assert "need less memory" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("error", [ComputationFailed("JAX cannot compute this"), MemoryError("cannot allocate")])
def test_a_computation_that_fails_ends_the_command_with_a_sentence(error, monkeypatch, capsys):
    def fail(options):
        raise error

    monkeypatch.setitem(__import__("jmorl.cli").cli.COMMANDS, "envs", fail)
    assert main(["envs"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("jmorl: stopped: ") and str(error) in line

"""Running statistics equal those of everything seen at once."""

import jax.numpy as jnp
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from jmorl.learning.statistics import NORMALIZED_CLIP, initial_statistics, normalize, update_statistics


@given(st.lists(st.integers(1, 30), min_size=1, max_size=6), st.integers(0, 2**32 - 1), st.floats(-5, 5))
def test_batches_merge_to_the_whole(sizes, seed, offset):
    generator = np.random.default_rng(seed)
    batches = [generator.normal(offset, 2.0, (size, 2, 3)).astype(np.float32) for size in sizes]
    statistics = initial_statistics((3,))
    for batch in batches:
        statistics = update_statistics(statistics, jnp.asarray(batch))
    whole = np.concatenate(batches).reshape(-1, 3)
    # The initial mean 0 and variance 1 weigh as much as a ten-thousandth of a sample.
    np.testing.assert_allclose(statistics.mean, whole.mean(0), rtol=2e-4, atol=2e-3)
    np.testing.assert_allclose(statistics.variance, whole.var(0), rtol=5e-3, atol=5e-3)
    np.testing.assert_allclose(statistics.count, len(whole), rtol=1e-3)


def test_a_large_offset_keeps_its_digits():
    generator = np.random.default_rng(0)
    batches = generator.normal(1000.0, 0.1, (50, 400, 1)).astype(np.float32)
    statistics = initial_statistics((1,))
    for batch in batches:
        statistics = update_statistics(statistics, jnp.asarray(batch))
    np.testing.assert_allclose(statistics.mean, 1000.0, atol=0.05)
    np.testing.assert_allclose(update_statistics(statistics, batches[0]).count, 50 * 400 + 400, rtol=1e-4)


def test_normalised_values_are_clipped():
    statistics = update_statistics(initial_statistics((1,)), jnp.array([[-1.0], [1.0]]))
    x = normalize(statistics, jnp.array([[0.0], [1.0], [1e6], [-1e6]]))
    np.testing.assert_allclose(x[:, 0], [0.0, 1.0, NORMALIZED_CLIP, -NORMALIZED_CLIP], atol=1e-3)

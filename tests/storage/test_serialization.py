"""A packed state is the state: every field, every bit, and which policies are one and the same."""

import dataclasses
import json

import jax
import numpy as np
import pytest

from jmorl.methods.pgmorl import PGMORLState
from jmorl.search.archive import Archive
from jmorl.state import RunState
from jmorl.storage.serialization import PackingError, pack, unpack


def bits(array):
    array = np.asarray(array)
    return array.dtype, array.shape, array.tobytes()


def assert_same(one, other):
    """Compare recursively; arrays by their bytes."""
    if dataclasses.is_dataclass(one):
        assert type(one) is type(other)
        for field in dataclasses.fields(one):
            assert_same(getattr(one, field.name), getattr(other, field.name))
    elif isinstance(one, tuple):
        assert len(one) == len(other)
        for each, another in zip(one, other, strict=True):
            assert_same(each, another)
    elif isinstance(one, dict):
        assert one.keys() == other.keys()
        assert_same(tuple(one.values()), tuple(other[name] for name in one))
    elif isinstance(one, np.generic | np.ndarray):
        assert bits(one) == bits(other)
    else:
        assert one == other


@pytest.mark.parametrize("generation", [0, 3])
def test_every_field_comes_back_bit_for_bit(make_state, small_config, environment, method, generation):
    state = make_state(generation)
    assert_same(state, unpack(pack(state, method), small_config, environment))


def test_a_state_in_raw_units_comes_back_too(make_state, small_config, environment, method):
    """The made-up states are in paper units, which have more to remember."""
    state = make_state(2)

    def raw(policies):
        return tuple(dataclasses.replace(policy, raw=None) for policy in policies)

    buffer = state.search.buffer
    in_raw_units = dataclasses.replace(buffer, members=raw(buffer.members))
    scouts = dataclasses.replace(
        state.search.scouts, starts=raw(state.search.scouts.starts), underway=raw(state.search.scouts.underway)
    )
    state = dataclasses.replace(
        state,
        units=None,
        search=dataclasses.replace(state.search, buffer=in_raw_units, scouts=scouts),
        archive=Archive(raw(state.archive.members)),
        choice=raw([state.choice])[0],
    )
    packed = pack(state, method)
    assert_same(state, unpack(packed, small_config, environment))
    assert not {"raw", "units"} & set(packed.arrays)


def test_the_comparison_of_these_tests_sees_every_field(make_state):
    """Change one field after the other, down to one bit of a policy's optimiser."""
    state = make_state(2)
    earlier = dataclasses.replace(make_state(1), choice=None, questions=0, policies_shown=0)
    for field in dataclasses.fields(RunState):
        changed = dataclasses.replace(state, **{field.name: getattr(earlier, field.name)})
        with pytest.raises(AssertionError):
            assert_same(state, changed)
    for field in dataclasses.fields(PGMORLState):
        search = dataclasses.replace(state.search, **{field.name: getattr(earlier.search, field.name)})
        with pytest.raises(AssertionError):
            assert_same(state, dataclasses.replace(state, search=search))
    other = make_state(2)
    other.choice.snapshot.observation_statistics.mean.view(np.int32)[0] ^= 1
    with pytest.raises(AssertionError):
        assert_same(state, other)


@pytest.mark.parametrize("limits", [None, (-np.inf, -np.inf, -np.inf), (0.1, -np.inf, -1e-300)])
def test_limits_that_were_never_set_and_those_that_were_taken_back_stay_apart(
    make_state, small_config, environment, method, limits
):
    state = make_state(1)
    state = dataclasses.replace(state, search=dataclasses.replace(state.search, limits=limits))
    packed = pack(state, method)
    json.dumps(packed.document, allow_nan=False)
    assert_same(state, unpack(packed, small_config, environment))


def test_a_policy_in_several_places_stays_one(make_state, small_config, environment, method):
    state = unpack(pack(make_state(2), method), small_config, environment)
    assert state.choice in state.search.buffer.members
    assert state.archive.members[0] in state.search.buffer.members


def test_there_are_a_few_arrays_whatever_the_number_of_policies(make_state, method):
    few, many = pack(make_state(1), method), pack(make_state(6), method)
    assert few.arrays.keys() == many.arrays.keys()
    assert len(many.arrays) < 18


def test_another_network_is_refused_by_name(make_state, small_config, environment, method):
    wider = small_config.replace(ppo={"hidden_sizes": (64, 32)})
    with pytest.raises(PackingError, match=r"train states of another shape: .*Dense_1.*\[64\].* where .*\[32\]"):
        unpack(pack(make_state(1), method), wider, environment)


def test_a_restored_policy_has_memory_of_its_own(make_state, small_config, environment, method):
    """Views would keep the numbers of all policies in memory as long as one is known."""
    state = unpack(pack(make_state(1), method), small_config, environment)
    for leaf in jax.tree.leaves(state.archive.members[0].snapshot):
        assert leaf.base is None or leaf.base.size == leaf.size

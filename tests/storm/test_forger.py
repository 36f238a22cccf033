"""An adversary's packets come from kernels: they draw the numbers that NumPy draws, and hear what is sent."""

from __future__ import annotations

import numpy as np
import pytest

from helpers import place_scenario
from swarmscope._jit import jit_alloc
from swarmscope.onboard.percept import DECISION, MAX_OUTBOX, PERCEPT
from swarmscope.onboard.sharing.message import MAX_PACKET_BYTES, OK, decode
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_setting
from swarmscope.sim.loop import run
from swarmscope.sim.radio import throw, throw_all
from swarmscope.storm.forger import FORGED, KINDS, REMEMBERED, REPLAYED, Attack, Forger, Heard, prepare


def heard_nothing():
    data = np.zeros((REMEMBERED, MAX_PACKET_BYTES), np.uint8)
    return Heard(*(np.zeros(REMEMBERED, np.int64) for _ in range(3)), data, np.zeros(1, np.int64))


@jit_alloc
def draws(rng, mean, found):
    """Draw what a forger draws, in all the ways it does."""
    for k in range(found.shape[0]):
        many = int(rng.poisson(mean))
        found[k, 0] = many
        found[k, 1] = rng.integers(0, 1 + many % 7)
        found[k, 2] = rng.integers(0, 65536)
        found[k, 3] = rng.random() + rng.uniform(-10.0, 10.0)
        found[k, 4] = rng.integers(0, 256, many % 141, np.uint8).sum()
        found[k, 5] = rng.integers(0, 1 + many, 4).sum()
        found[k, 6] = rng.uniform(0.0, 7.0, many % 17).sum()


@pytest.mark.parametrize("mean", [0.05, 3.0, 60.0])
def test_kernels_draw_the_numbers_that_numpy_draws(mean):
    ours, theirs = (np.random.default_rng(4) for _ in range(2))
    found, wanted = np.zeros((2, 3000, 7))
    draws(ours, mean, found)
    getattr(draws, "py_func", draws)(theirs, mean, wanted)
    np.testing.assert_allclose(found, wanted, rtol=1e-15)
    assert ours.bit_generator.state == theirs.bit_generator.state


def test_forged_packets_have_right_checksums():
    rng, header = np.random.default_rng(1), np.zeros(6, np.int64)
    percepts, decisions = np.zeros(5, PERCEPT), np.zeros(5, DECISION)
    to, length, data = prepare(rng, 400.0, np.array([FORGED]), decisions, percepts, heard_nothing())
    status = np.array([decode(data[k], length[k], header) for k in range(to.size)])
    assert to.min() == 0 and to.max() == 4 and length.max() <= MAX_PACKET_BYTES
    assert (status == OK).mean() > 0.5


def test_it_remembers_the_newest_packets_and_throws_them_as_they_were():
    rng, heard = np.random.default_rng(1), heard_nothing()
    percepts, decisions = np.zeros(3, PERCEPT), np.zeros(3, DECISION)
    for number in range(50):
        decisions["n_out"], decisions["out_to"], decisions["out_length"] = MAX_OUTBOX, 2, 10
        decisions["out_length"][:, 0] = 0  # nothing is sent in this place
        decisions["out"][:, :, :10] = number
        to, length, data = prepare(rng, 20.0, np.array([REPLAYED]), decisions, percepts, heard)
        assert (length == 10).all() and set(to.tolist()) <= {0, 1, 2}
        assert data[:, :10].min() >= number - REMEMBERED // 21 - 1
        assert (data[:, :10] == data[:, :1]).all() and not data[:, 10:].any()
    assert heard.total[0] == 50 * 3 * (MAX_OUTBOX - 1)


@pytest.mark.parametrize("kind", KINDS)
def test_packets_thrown_together_arrive_as_those_thrown_one_by_one(kind):
    def digest(one_by_one):
        attack, thrown = Attack(Forger(3, 30.0, (kind,))), []

        def between(held, tick):
            sim = held.what
            args = attack._rng, attack.forger.per_tick, attack._kinds, sim.decisions, sim.percepts, attack._heard
            to, length, data = prepare(*args)
            if one_by_one:
                thrown.append(sum(throw(sim, tick, to[k], data[k], length[k]) for k in range(to.size)))
            else:
                thrown.append(throw_all(held, tick, to, data, length))
            return tick == 30

        values = place_scenario([(-2.0, 0.0, 0.0), (2.0, 0.2, 3.0)], [(2.0, 0.0), (-2.0, 0.2)], [], limit_s=20.0)
        scenario = parse_scenario(values, "test")
        trace = run(make_setting(scenario, make_setup(scenario)), between=between)
        return thrown, trace.robots.tobytes(), trace.shared.tobytes()

    assert digest(True) == digest(False)

"""The run as a whole: the same with any number of threads, and for any order of the robots."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import circle, place_scenario, run_scenario

NOISE = {"range_fraction": 0.01, "bearing_deg": 1.0, "compass_deg": 2.0, "dropout": 0.01}
TREES = [circle(x, y, 0.3) for x in (-2.0, 0.0, 2.0) for y in (-2.0, -0.7, 0.6, 1.9)]


def crossing(robots=6, **more):
    starts = [(-4.0, 1.2 * k - 3.0, 0.0) for k in range(robots)]
    goals = [(4.0, 3.0 - 1.2 * k) for k in range(robots)]
    return place_scenario(
        starts, goals, TREES, **({"limit_s": 25.0, "record_scans": "yes", "seed": 3} | more)
    )


@pytest.fixture(scope="module")
def alone():
    return run_scenario(crossing(noise=NOISE, radio={"loss": 0.1}))


@pytest.mark.parametrize("threads", [2, 3])
def test_records_do_not_depend_on_the_threads(alone, threads):
    other = run_scenario(crossing(noise=NOISE, radio={"loss": 0.1}), threads)
    assert (alone.records.bytes_sent[-1] > 0).any()
    for name in alone.records._fields:
        assert getattr(alone.records, name).tobytes() == getattr(other.records, name).tobytes(), name
    assert alone.robots.tobytes() == other.robots.tobytes()
    assert alone.shared.tobytes() == other.shared.tobytes()
    assert alone.links.tobytes() == other.links.tobytes()


def test_the_same_scenario_gives_the_same_run_and_another_seed_another(alone):
    again = run_scenario(crossing(noise=NOISE, radio={"loss": 0.1}))
    assert all(a.tobytes() == b.tobytes() for a, b in zip(alone.records, again.records, strict=True))
    other = run_scenario(crossing(noise=NOISE, radio={"loss": 0.1}, seed=4))
    assert alone.records.x[: len(other.t_s)].tobytes() != other.records.x[: len(alone.t_s)].tobytes()


def test_records_agree_with_the_robots_at_the_end(alone):
    records, robots = alone.records, alone.robots
    ticks = len(alone.t_s)
    assert all(len(a) == ticks for a in records)
    assert records.bytes_sent[-1] == pytest.approx(robots["bytes"], abs=200)
    assert (np.diff(records.bytes_sent, axis=0) >= 0).all()
    assert (records.speed >= -1e-6).all()
    assert (records.speed <= 0.5 + 1e-6).all()
    steps = np.hypot(np.diff(records.x, axis=0), np.diff(records.y, axis=0))
    assert steps.max() <= 0.5 * 0.2 + 1e-9


def test_scans_are_recorded_as_they_were_seen():
    trace = run_scenario(
        place_scenario(
            [(0.0, 0.0, 0.0)], [(3.0, 3.0)], [circle(2.0, 0.0, 0.5)], limit_s=0.2, record_scans="yes"
        )
    )
    scan, safe = trace.records.scan[0, 0], np.unpackbits(trace.records.safe[0, 0])[:360]
    assert scan[180] == round(254 * 1.5 / 5.0)
    assert scan[0] == 255
    assert safe[180] == 0
    assert safe[0] == 1
    assert trace.records.x[0, 0] == 0.0


def order_of(trace, order):
    back = np.argsort(order)
    return {name: getattr(trace.records, name)[:, back] for name in ("x", "y", "yaw", "speed", "clearance")}


def test_the_order_of_the_robots_does_not_matter_to_sensing_and_motion():
    """Robots that never meet and need no radio: renumbered, they drive exactly the same ways."""
    starts = [(-4.0, y, 0.0) for y in (-4.5, -1.5, 1.5, 4.5)]
    goals = [(4.0, y) for y in (-4.5, -1.5, 1.5, 4.5)]
    order = [2, 0, 3, 1]
    trees = [circle(0.0, y + 0.1, 0.4) for y in (-4.5, -1.5, 1.5, 4.5)]
    nav_i = {"name": "nav-scope", "params": {"w_i": 0.0}}
    a = run_scenario(place_scenario(starts, goals, trees, planner=nav_i))
    b = run_scenario(
        place_scenario([starts[k] for k in order], [goals[k] for k in order], trees, planner=nav_i)
    )
    ours, theirs = order_of(a, [0, 1, 2, 3]), order_of(b, order)
    for name, values in ours.items():
        assert values == pytest.approx(theirs[name], abs=1e-9), name
    assert a.robots["arrived"].all()


def test_a_run_ends_when_all_have_arrived_or_at_the_limit():
    short = run_scenario(place_scenario([(0.0, 0.0, 0.0)], [(1.0, 0.0)]))
    assert short.t_s[-1] < 10.0
    assert float(short.robots[0]["arrival_s"]) == pytest.approx(short.t_s[-1] + 0.2)
    cut = run_scenario(place_scenario([(0.0, 0.0, 0.0)], [(9.0, 0.0)], limit_s=3.0))
    assert len(cut.t_s) == 15
    assert not cut.robots[0]["arrived"]
    assert math.isnan(float(cut.robots[0]["arrival_s"]))
    assert np.isfinite(cut.plan_us).all()

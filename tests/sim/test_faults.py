"""What fails in the middle of a run: how often, for how long, what is lost and what goes on."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import DT, circle, place_scenario, place_sim, rig_of, run_scenario
from swarmscope.errors import ConfigError
from swarmscope.onboard.percept import new_shared
from swarmscope.onboard.planners import load_planner
from swarmscope.onboard.view import new_swarm
from swarmscope.sim.cells import index_robots
from swarmscope.sim.faults import blanks, forget, strike
from swarmscope.sim.radio import exchange
from swarmscope.sim.sensing import sense
from swarmscope.sim.state import Faults
from swarmscope.sim.streams import boot_number

MANY = 300
TICKS = 1000
OFTEN = 360.0
"""Once in 10 s, in 50 ticks."""
TREES = [circle(x, y, 0.3) for x in (-2.0, 0.0, 2.0) for y in (-2.0, -0.7, 0.6, 1.9)]


def robots_of(faults, robots=MANY, **options):
    starts = np.column_stack([np.linspace(-9.0, 9.0, robots), np.zeros((robots, 2))])
    sim, _ = place_sim(starts, faults=faults, **options)
    index_robots(sim)
    return sim


def crossing(**more):
    starts = [(-4.0, 1.2 * k - 3.0, 0.0) for k in range(6)]
    goals = [(4.0, 3.0 - 1.2 * k) for k in range(6)]
    return place_scenario(starts, goals, TREES, **({"limit_s": 60.0, "seed": 3} | more))


@pytest.mark.parametrize(
    ("faults", "count", "until", "off"),
    [
        (Faults(restarts_per_h=OFTEN, restart_s=1.0), "boots", "down_until", 5),
        (Faults(restarts_per_h=OFTEN, restart_s=0.0), "boots", "down_until", 1),
        (Faults(silences_per_h=OFTEN, silence_s=1.1), "silences", "mute_until", 6),
    ],
)
def test_events_come_at_the_rate_and_last_as_long_as_is_said(faults, count, until, off):
    sim = robots_of(faults)
    times = 0
    for tick in range(1, TICKS + 1):
        before = sim.robots[count].copy()
        strike(sim, tick)
        struck = sim.robots[count] > before
        assert (sim.robots[until][struck] == tick + off).all()
        times += int(struck.sum())
    assert times == sim.robots[count].sum()
    assert times == pytest.approx(MANY * TICKS / (50 + off - 1), rel=0.04)
    assert sim.robots[count].std() == pytest.approx(math.sqrt(TICKS / 50.0), rel=0.25)


def test_clocks_jump_at_the_rate_to_and_fro():
    sim = robots_of(Faults(clock_jumps_per_h=OFTEN, clock_jump_s=3.0))
    steps = []
    for tick in range(1, TICKS + 1):
        before = sim.robots["clock_s"].copy()
        strike(sim, tick)
        steps += (sim.robots["clock_s"] - before).tolist()
    steps = np.array(steps)
    assert set(np.round(steps, 6)) == {-3.0, 0.0, 3.0}
    assert (steps != 0.0).sum() == sim.robots["clock_jumps"].sum()
    assert (steps != 0.0).mean() == pytest.approx(0.02, rel=0.04)
    assert (steps > 0.0).sum() == pytest.approx((steps < 0.0).sum(), rel=0.08)
    sense(sim, TICKS, 0, MANY)
    assert sim.percepts["now_s"] == pytest.approx(TICKS * DT + sim.robots["clock_s"])
    assert (sim.percepts["dt_s"] == DT).all()


def test_what_fails_differs_from_seed_to_seed_and_each_fault_has_draws_of_its_own():
    every = Faults(restarts_per_h=OFTEN, silences_per_h=OFTEN, clock_jumps_per_h=OFTEN)

    def counts(faults, seed):
        sim = robots_of(faults, seed=seed)
        for tick in range(1, 100):
            strike(sim, tick)
        return [sim.robots[name].tolist() for name in ("boots", "silences", "clock_jumps")]

    first = counts(every, 1)
    assert first == counts(every, 1) != counts(every, 2)
    for k, name in enumerate(("restarts_per_h", "silences_per_h", "clock_jumps_per_h")):
        left = counts(every._replace(**{name: 0.0}), 1)
        assert sum(left[k]) == 0
        assert [row for n, row in enumerate(left) if n != k] == [row for n, row in enumerate(first) if n != k]


def test_nothing_fails_at_rates_of_zero_and_nothing_of_a_robot_that_has_collided():
    sim = robots_of(Faults())
    for tick in range(1, 200):
        strike(sim, tick)
    assert not any(sim.robots[name].any() for name in ("boots", "silences", "clock_jumps", "clock_s", "down_until"))
    sim = robots_of(Faults(3600.0, 1.0, 3600.0, 1.0, 3600.0))
    sim.robots["crashed"] = 1
    for tick in range(1, 50):
        strike(sim, tick)
    assert not any(sim.robots[name].any() for name in ("boots", "silences", "clock_jumps"))


def test_a_restart_forgets_everything_and_gets_a_new_number_and_a_clock_from_zero():
    planner, robots = load_planner("nav-scope"), 4
    swarm, memory = new_swarm(robots, rig_of()), planner.new_memory(robots)
    sim = robots_of(Faults(restarts_per_h=1.0, restart_s=1.0), robots)
    pairs = blanks(planner, swarm, memory)
    memory["log_n"], swarm.shared["seq"], swarm.decisions["v"] = 5, 9, 0.4
    swarm.decisions["n_out"] = 3
    sim.robots["down_until"][2] = 30
    for rows, blank in pairs:
        forget(sim.robots, 29, rows, blank)
    fresh = planner.new_memory(robots)
    for i in range(robots):
        assert (memory[i].tobytes() == fresh[i].tobytes()) == (i == 2)
        assert (swarm.shared[i].tobytes() == new_shared(1)[0].tobytes()) == (i == 2)
        assert (swarm.decisions["v"][i], swarm.decisions["n_out"][i]) == ((0.0, 0) if i == 2 else (0.4, 3))
    memory["log_n"] = 6
    for rows, blank in pairs:
        forget(sim.robots, 30, rows, blank)  # it runs again
    assert (memory["log_n"] == 6).all()

    sim = robots_of(Faults(restarts_per_h=3600.0, restart_s=1.0), robots)
    old = sim.percepts["boot"].copy()
    tick = 1
    strike(sim, tick)
    while not sim.robots["boots"][1]:
        tick += 1
        strike(sim, tick)
    assert sim.percepts["boot"][1] == boot_number(0, 1, 1) != old[1]
    sense(sim, int(sim.robots["down_until"][1]), 0, robots)
    assert sim.percepts["now_s"][1] == 0.0


def sends(sim, i, to):
    sim.decisions["n_out"][i], sim.decisions["out_to"][i, 0] = 1, to
    sim.decisions["out_length"][i, 0], sim.decisions["out"][i, 0, 0] = 9, 0x21


@pytest.mark.parametrize("until", ["down_until", "mute_until"])
def test_who_has_no_radio_neither_sends_nor_hears_and_loses_what_is_on_the_way(until):
    faults = Faults(restarts_per_h=1e-9, silences_per_h=1e-9)
    sim, _ = place_sim([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)], faults=faults)
    index_robots(sim)
    for i in range(3):
        sends(sim, i, (i + 1) % 3)
    exchange(sim, 0)
    assert sim.robots["queued"].tolist() == [1, 1, 1]
    sim.robots[until][1] = 3
    strike(sim, 1)
    assert sim.robots["queued"].tolist() == [1, 0, 1]
    assert sim.robots["lost"].tolist() == [1, 0, 0]
    exchange(sim, 1)
    assert sim.robots["sent"].tolist() == [2, 1, 2]
    assert sim.robots["unreachable"].tolist() == [1, 0, 0]
    sense(sim, 2, 0, 3)
    assert sim.percepts["n_packets"].tolist() == [2, 0, 1]
    exchange(sim, 3)
    assert sim.robots["sent"].tolist() == [3, 2, 3]
    assert sim.robots["queued"].tolist() == [1, 1, 1]


def test_who_restarts_brakes_stands_where_it_is_and_remembers_nothing():
    trace = run_scenario(crossing(faults={"restarts_per_h": 1200, "restart_s": 1000}, limit_s=20.0))
    assert (trace.robots["boots"] == 1).all()
    speed = trace.records.speed
    drove = speed.max(axis=0) > 0.0
    assert drove.any() and (speed[-1] == 0.0).all()
    assert (np.diff(speed, axis=0) >= -2.0 * DT - 1e-6).all()  # as hard as it can, no harder
    assert np.ptp(trace.records.x[-10:], axis=0).max() == 0.0
    assert all(row.tobytes() == new_shared(1)[0].tobytes() for row in trace.shared)
    assert not trace.robots["crashed"].any()


def test_who_restarted_goes_on_from_there_and_is_heard_again():
    seed = 3
    trace = run_scenario(crossing(faults={"restarts_per_h": 200, "restart_s": 2.0}, seed=seed, limit_s=120.0))
    assert trace.robots["arrived"].all() and not trace.robots["crashed"].any()
    assert np.hypot(np.diff(trace.records.x, axis=0), np.diff(trace.records.y, axis=0)).max() <= 0.5 * DT + 1e-9
    heard = 0
    for i, robot in enumerate(trace.robots):
        number = boot_number(seed, i, int(robot["boots"]))
        for row in trace.shared:
            mine = row["window_boot"][row["sender_id"] == i]
            heard += bool(robot["boots"] > 0 and (mine == number).any())
    assert trace.robots["boots"].sum() > 2
    assert heard > 0


def test_silent_radios_send_nothing_more():
    talk = run_scenario(crossing())
    mute = run_scenario(crossing(faults={"silences_per_h": 1200, "silence_s": 1000}))
    assert 0 < mute.robots["sent"].sum() < 0.5 * talk.robots["sent"].sum() or mute.robots["sent"].sum() == 0
    assert mute.robots["arrived"].all()
    last = int(max(mute.links[:, 0], default=0))
    assert last < len(mute.t_s) // 2


def test_choices_are_noted_at_the_time_of_the_run_whatever_a_clock_says():
    trace = run_scenario(crossing(faults={"clock_jumps_per_h": 1200, "clock_jump_s": 2.0}))
    assert trace.robots["clock_jumps"].sum() > 5
    ticks = trace.choices["tick"]
    assert len(ticks) > 3 and (np.diff(ticks) >= 0).all() and ticks.max() < len(trace.t_s)
    for choice in trace.choices:
        assert trace.records.x[choice["tick"], choice["robot"]] == choice["x"]


def test_a_memory_of_python_objects_cannot_be_emptied():
    swarm = new_swarm(1, rig_of())
    with pytest.raises(ConfigError, match=r"^faults\.restarts_per_h, robot\.start_s: planner 'nav-scope' keeps"):
        blanks(load_planner("nav-scope"), swarm, np.zeros(1, [("a", object)]))

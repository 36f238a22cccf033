"""Errors of single robots: each key has the size that is asked for, and the same for whoever draws it again."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import DT, beams_of, make_sensor, place_sim, rig_of, world_of
from swarmscope.onboard.perception.reproject import move_on
from swarmscope.onboard.view import python_view
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_setting
from swarmscope.sim.cells import index_robots
from swarmscope.sim.loop import run
from swarmscope.sim.sensing import sense
from swarmscope.sim.state import Noise
from swarmscope.sim.world import Circle

MANY = 400
"""Robots, far from one another."""


def lonely(noise, robots=MANY, **options):
    """A simulation of robots that see nothing but, each of them, a ring of 1 m about itself."""
    starts = np.column_stack([20.0 * np.arange(robots), np.zeros(robots), np.full(robots, 0.3)])
    world = world_of(*(Circle(center=(float(x), 0.0), radius=1.0) for x in starts[:, 0]))
    sim, _ = place_sim(starts, noise=noise, world=world, **options)
    index_robots(sim)
    return sim


def scans(sim, ticks):
    """(T, N, M) ranges."""
    found = []
    for tick in range(ticks):
        sense(sim, tick, 0, sim.robots.size)
        found.append(sim.ranges.copy())
    return np.array(found)


def driven(sim, ticks, step):
    """Odometry (T, N, 4: x, y, yaw, speed) of robots that drive ``step`` [m] straight on at each tick."""
    found = []
    sense(sim, 0, 0, sim.robots.size)
    for tick in range(1, ticks + 1):
        robots = sim.robots
        robots["x"] += step * np.cos(robots["yaw"])
        robots["y"] += step * np.sin(robots["yaw"])
        robots["v"] = step / DT
        sense(sim, tick, 0, robots.size)
        found.append([sim.percepts[name].copy() for name in ("odom_x", "odom_y", "odom_yaw", "speed")])
    return np.array(found).transpose(0, 2, 1)


def test_wheels_of_another_size_scale_speed_and_way_alike_for_the_whole_run():
    rows = driven(lonely(Noise(odometry_scale=0.02)), 5, 0.1)
    scale = rows[:, :, 0] / 0.1
    assert np.ptp(scale, axis=0).max() < 1e-9
    assert rows[:, :, 3] * DT == pytest.approx(rows[:, :, 0], abs=1e-12)
    assert scale[0].mean() == pytest.approx(1.0, abs=0.003)
    assert scale[0].std() == pytest.approx(0.02, rel=0.12)
    assert abs(rows[:, :, 1:3]).max() < 1e-9


def test_wheels_of_another_size_measure_turns_too_long():
    sim = lonely(Noise(odometry_scale=0.05), 5)
    sense(sim, 0, 0, 5)
    sim.robots["yaw"] += 0.2
    sense(sim, 1, 0, 5)
    turned = sim.percepts["odom_yaw"] / 0.2
    sim.robots["x"] += 0.1
    sense(sim, 2, 0, 5)
    assert turned == pytest.approx(np.hypot(sim.percepts["odom_x"], sim.percepts["odom_y"]) / 0.1)
    assert np.ptp(turned) > 0.01


@pytest.mark.parametrize("step", [0.02, 0.1])
def test_odometry_drifts_with_the_root_of_the_way(step):
    ticks = 50
    rows = driven(lonely(Noise(odometry_drift_m=0.03, odometry_turn_rad=0.05)), ticks, step)
    off = rows[:, :, :3].sum(axis=0) - np.array([ticks * step, 0.0, 0.0])
    root = math.sqrt(ticks * step)
    assert off.std(axis=0) == pytest.approx([0.03 * root, 0.03 * root, 0.05 * root], rel=0.12)
    assert off.mean(axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=0.2 * 0.05 * root)
    assert abs(np.corrcoef(off.T)[np.triu_indices(3, 1)]).max() < 0.2
    assert rows[:, :, 3] == pytest.approx(step / DT)


def test_who_stands_does_not_drift():
    rows = driven(lonely(Noise(odometry_drift_m=0.3, odometry_turn_rad=0.5, odometry_scale=0.05), 20), 5, 0.0)
    assert (rows == 0.0).all()


def test_a_compass_bias_stays_and_differs_from_robot_to_robot():
    sim = lonely(Noise(compass_bias_rad=0.05))
    first = None
    for tick in (0, 1, 700):
        sense(sim, tick, 0, MANY)
        error = sim.percepts["compass"] - 0.3
        first = error if first is None else first
        assert error == pytest.approx(first, abs=1e-12)
    assert first.mean() == pytest.approx(0.0, abs=0.01)
    assert first.std() == pytest.approx(0.05, rel=0.12)


def test_bias_and_noise_of_a_compass_add_up_and_others_see_the_same_error():
    starts = [(0.0, 0.0, 0.0), (2.0, 0.0, 1.0)]
    errors = []
    for noise in (Noise(compass_rad=0.1), Noise(compass_bias_rad=0.2), Noise(compass_rad=0.1, compass_bias_rad=0.2)):
        sim, _ = place_sim(starts, noise=noise)
        index_robots(sim)
        sense(sim, 5, 0, 2)
        errors.append(sim.percepts["compass"] - np.array([0.0, 1.0]))
        turn = sim.percepts["compass"][1] - sim.percepts["compass"][0]
        assert sim.percepts["neighbour_yaw"][0, 0] == pytest.approx(turn)
    assert errors[2] == pytest.approx(errors[0] + errors[1])


def test_broken_readings_come_anew_for_every_scan_with_their_share():
    broken = np.isnan(scans(lonely(Noise(nan=0.07), 40), 10))
    assert broken.mean() == pytest.approx(0.07, abs=0.004)
    assert broken.mean(axis=0).std() == pytest.approx(math.sqrt(0.07 * 0.93 / 10), rel=0.05)


def test_stuck_beams_stay_and_say_the_longest_range():
    found = scans(lonely(Noise(stuck=0.04)), 3)
    stuck = found == 5.0
    assert (stuck == stuck[0]).all()
    assert stuck[0].mean() == pytest.approx(0.04, abs=0.002)
    assert found[~stuck] == pytest.approx(1.0, abs=1e-5)
    assert len(np.unique(stuck[0], axis=0)) == MANY


@pytest.mark.parametrize("fov", [2.0 * math.pi, math.pi])
def test_a_blind_sector_has_its_width_and_lies_anywhere(fov):
    rig = rig_of(sensor=make_sensor(beams=181 if fov < 4.0 else 360, fov=fov))
    found = scans(lonely(Noise(blind_rad=0.5), rig=rig), 2)
    blind = np.isinf(found)
    assert (blind[0] == blind[1]).all()
    assert set(blind.sum(axis=2).ravel()) == {round(0.5 / beams_of(rig).increment)}
    edges = (np.diff(blind[0].astype(int), axis=1, prepend=blind[0][:, -1:]) == 1).sum(axis=1)
    assert (edges == 1).all()  # one sector
    share = blind[0].mean(axis=0)
    middle = share if fov > 4.0 else share[40:-40]
    assert middle.min() > 0.01 and middle.max() < 0.25
    assert (found[~blind] < 1.1).all()


def test_a_sector_as_wide_as_the_field_sees_nothing():
    assert np.isinf(scans(lonely(Noise(blind_rad=2.0 * math.pi), 3), 1)).all()


EVERYTHING = Noise(
    0.02, 0.05, 0.02, 0.05, compass_bias_rad=0.1, odometry_scale=0.05, odometry_drift_m=0.1, odometry_turn_rad=0.1,
    nan=0.05, stuck=0.05, blind_rad=0.5,
)  # fmt: skip


def test_errors_do_not_depend_on_the_order_of_the_robots():
    starts = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 1.5, 0.0)]
    first, _ = place_sim(starts, noise=EVERYTHING, seed=1)
    other, _ = place_sim(starts, noise=EVERYTHING, seed=1)
    for sim in (first, other):
        index_robots(sim)
        sim.robots["x"] += 0.1
    sense(first, 4, 0, 3)
    for i in (2, 0, 1):
        sense(other, 4, i, i + 1)
    assert first.percepts.tobytes() == other.percepts.tobytes()
    assert first.ranges.tobytes() == other.ranges.tobytes()


@pytest.mark.parametrize("name", Noise._fields)
def test_an_error_leaves_the_draws_of_the_others_alone(name):
    """Without one of them, whatever it does not touch is as before."""
    touches = {
        "compass_bias_rad": {"compass", "goal_bearing", "neighbour_yaw"},
        "compass_rad": {"compass", "goal_bearing", "neighbour_yaw"},
        "odometry_scale": {"speed", "odom_x", "odom_y", "odom_yaw"},
        "odometry_drift_m": {"odom_x", "odom_y"},
        "odometry_turn_rad": {"odom_yaw"},
        "range_fraction": {"neighbour_x", "neighbour_y"},
        "bearing_rad": {"neighbour_x", "neighbour_y"},
    }.get(name, set())
    starts = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 1.5, 0.0)]
    sims = []
    for noise in (EVERYTHING, EVERYTHING._replace(**{name: 0.0})):
        sim, _ = place_sim(starts, noise=noise)
        index_robots(sim)
        sim.robots["x"] += 0.1
        sim.robots["yaw"] += 0.1
        sense(sim, 2, 0, 3)
        sims.append(sim)
    differ = {
        field
        for field in sims[0].percepts.dtype.names
        if sims[0].percepts[field].tobytes() != sims[1].percepts[field].tobytes()
    }
    assert differ <= touches
    same = sims[0].ranges.tobytes() == sims[1].ranges.tobytes()
    assert same == (name not in ("range_fraction", "dropout", "nan", "stuck", "blind_rad"))


def test_a_late_scan_is_from_a_random_moment_of_the_robots_own_way():
    oldest, step, ahead = 0.5, 0.02, 180
    sim = lonely(Noise(scan_age_s=oldest))
    sense(sim, 0, 0, MANY)
    assert sim.ranges[:, ahead] == pytest.approx(1.0, abs=1e-5)  # it stood
    ages = []
    for tick in range(1, 21):
        sim.robots["x"] += step * math.cos(0.3)
        sim.robots["y"] += step * math.sin(0.3)
        sense(sim, tick, 0, MANY)
        ages.append((sim.ranges[:, ahead] - (1.0 - step * tick)) / step * DT)
    late = np.array(ages[3:])
    assert late.min() > -1e-4 and late.max() < oldest + 1e-4
    assert late.mean() == pytest.approx(oldest / 2.0, rel=0.03)
    assert late.std() == pytest.approx(oldest / math.sqrt(12.0), rel=0.03)
    assert abs(np.corrcoef(late[:-1].ravel(), late[1:].ravel())[0, 1]) < 0.05
    assert np.array(ages[0]).max() < DT + 1e-4  # before the start everybody stood


def test_a_late_scan_is_turned_and_shows_others_where_they_were_but_positioning_is_of_now():
    oldest, ahead = 0.2, 180
    sim, _ = place_sim([(0.0, 0.0, 0.0), (2.0, 0.0, math.pi)], noise=Noise(scan_age_s=oldest))
    index_robots(sim)
    sense(sim, 0, 0, 2)
    found = []
    for tick in range(1, 40):
        sim.robots["x"][1] = 2.0 - 0.03 * tick
        index_robots(sim)
        sense(sim, tick, 0, 2)
        assert sim.percepts["neighbour_x"][0, 0] == pytest.approx(2.0 - 0.03 * tick)
        found.append(((sim.ranges[:, ahead] - (1.85 - 0.03 * tick)) / 0.03 * DT).tolist())
    both = np.array(found)  # each has an age of its own
    assert both.min() > -1e-4 and both.max() < oldest + 1e-4
    assert both.std(axis=0).min() > 0.03
    assert abs(np.corrcoef(both.T)[0, 1]) < 0.5
    sim.robots["yaw"][0] += 0.4
    sense(sim, 40, 0, 2)
    nearest = int(np.flatnonzero(sim.ranges[0] == sim.ranges[0].min()).mean())
    assert 180 - math.degrees(0.4) - 1.0 < nearest < 180  # turned by a part of it


def test_whoever_comes_into_range_or_leaves_it_is_seen_where_he_was():
    """The other is looked for among the robots that are near now."""
    sim, _ = place_sim([(0.0, 0.0, 0.0), (5.1, 0.0, 0.0)], noise=Noise(scan_age_s=1.0), rig=rig_of())
    index_robots(sim)
    sense(sim, 0, 0, 2)
    seen = []
    for tick in range(1, 30):
        sim.robots["x"][1] = 5.1 + 0.1 * (tick % 2)  # 5.2 m is too far
        index_robots(sim)
        sense(sim, tick, 0, 1)
        seen.append((tick % 2, bool(np.isfinite(sim.ranges[0]).any())))
    assert {out for out, there in seen if there} == {0, 1}


def driving(noise):
    """A robot that drives and turns in a ring of 1 m; at each tick where its scan was taken, and where it says."""
    sim = lonely(noise, 30)
    sim.robots["goal_x"] += 5.0
    found = []
    for tick in range(12):
        sense(sim, tick, 0, 30)
        found.append([sim.percepts[name].copy() for name in ("scan_x", "scan_y", "scan_yaw")])
        sim.robots["x"] += 0.02 * np.cos(sim.robots["yaw"])
        sim.robots["y"] += 0.02 * np.sin(sim.robots["yaw"])
        sim.robots["yaw"] += 0.3 * (-1.0) ** np.arange(30)
    return sim, np.array(found)


def test_a_robot_is_told_how_it_has_moved_since_its_scan():
    _, told = driving(Noise(scan_age_s=0.5))
    assert (told[0] == 0.0).all()  # it stood
    late = told[4:]
    assert np.abs(late[:, 2]).max() == pytest.approx(0.3 * 2.5, rel=0.05)
    assert (np.sign(late[:, 2]) == -((-1.0) ** np.arange(30))).all()  # it has turned on since
    assert late[:, 0].min() >= -0.05 and late[:, 0].max() <= 1e-9
    _, wrong = driving(Noise(scan_age_s=0.5, odometry_scale=0.05))
    assert 0.01 < np.abs(wrong[4:, 2] / late[:, 2] - 1.0).max() < 0.2  # by its own wheels
    _, never = driving(Noise())
    assert (never == 0.0).all()


@pytest.mark.parametrize("age", [0.1, 0.4])
def test_a_late_scan_that_is_moved_on_shows_what_is_seen_from_here(age):
    trees = [Circle(center=(1.0, 0.4), radius=0.3), Circle(center=(-0.6, 1.2), radius=0.4)]
    seats = []
    for oldest in (age, 0.0):
        sim, swarm = place_sim([(0.0, 0.0, 0.3)], [(5.0, 0.0)], world_of(*trees), noise=Noise(scan_age_s=oldest))
        index_robots(sim)
        for tick in range(8):
            sense(sim, tick, 0, 1)
            before = sim.ranges[0].copy()
            move_on(python_view(swarm, 0))
            seats.append((before, sim.ranges[0].copy()))
            sim.robots["x"] += 0.03 * np.cos(sim.robots["yaw"])
            sim.robots["y"] += 0.03 * np.sin(sim.robots["yaw"])
            sim.robots["yaw"] += 0.25
    off, moved = [], []
    for (raw, late), (now, same) in zip(seats[2:8], seats[10:], strict=True):
        assert now.tobytes() == same.tobytes()
        near = np.isfinite(now) & np.isfinite(raw) & np.isfinite(late)
        off.append(np.median(np.abs(raw[near] - now[near])))
        moved.append(np.median(np.abs(late[near] - now[near])))
        assert near.sum() > 5
    assert max(moved) < 0.005
    assert max(off) > 0.02


@pytest.mark.parametrize("fov_deg", [360.0, 180.0])
def test_late_scans_with_broken_beams_stop_nobody(fov_deg):
    """Single holes are bridged before a scan is moved on; they became walls from the body outwards."""
    values = {"task": {"name": "T1"}, "robots": 3, "seed": 2, "limit_s": 90.0, "record_scans": "no"}
    values |= {"lidar": {"fov_deg": fov_deg}, "noise": {"scan_age_s": 0.15, "nan": 0.02}}
    scenario = parse_scenario(values, "test")
    robots = run(make_setting(scenario, make_setup(scenario))).robots
    assert robots["arrived"].all()
    assert not robots["crashed"].any()

"""The judge of contacts against the exact motion of a unicycle, sampled densely, at all speeds and rates."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import circle, place_sim, rig_of, wall, world_of
from swarmscope.onboard.body import Body
from swarmscope.sim.cells import index_robots
from swarmscope.sim.motion import judge, move
from swarmscope.sim.state import ARC_M, Clock, enough_substeps

RADIUS = 0.15
SAMPLES = 4000
PACES = [(0.2, 20.0, 2.0), (0.5, 5.0, 2.0), (0.5, 1.0, 2.0), (2.0, 3.0, 6.0), (2.0, 1.0, 2.0), (5.0, 5.0, 2.0)]
PACES += [(5.0, 1.0, 2.0), (5.0, 2.0, 6.0), (5.0, 1.0, 6.0)]
"""Speed [m/s], rate [Hz], turn rate [rad/s]."""


def off_by(rate, w_max):
    """How far the judge's path may be off the exact one [m].

    A piece lies ARC_M = v w h^2 / 8 beside its arc. Its length is that of the arc, w^2 h^2 / 24 longer than the chord,
    in all v w^2 h^2 / (24 rate) = ARC_M w / (3 rate). Speeding up moves the way made in a piece against its middle by
    at most w h / 12 of what speed changes in h, in all v w h^2 / 12 < ARC_M.
    """
    return ARC_M * (2.0 + w_max / (3.0 * rate)) + 1e-5


def exact_path(start, v0, v, w, a_max, dt):
    """Positions (SAMPLES + 1, 2) of a unicycle whose speed goes from v0 to v as a_max lets it."""
    h = dt / SAMPLES
    middle = (np.arange(SAMPLES) + 0.5) * h
    speed = v0 + np.sign(v - v0) * np.minimum(a_max * middle, abs(v - v0))
    yaw = start[2] + w * middle
    steps = h * speed[:, None] * np.column_stack([np.cos(yaw), np.sin(yaw)])
    return start[:2] + np.vstack([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def to_line(points, a, b):
    t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return np.linalg.norm(points - a - t[:, None] * (b - a), axis=1)


def judged(starts, speeds, commands, pace, a_max, *obstacles):
    """One tick; the simulation after it."""
    v_max, rate, w_max = pace
    body = Body(radius_m=RADIUS, v_max_mps=v_max, w_max_radps=w_max, a_max_mps2=a_max, half_width_m=0.1)
    sim, _ = place_sim(starts, world=world_of(*obstacles), rig=rig_of(body), dt=1.0 / rate)
    sim.robots["v"] = speeds
    sim.decisions["v"], sim.decisions["w"] = np.array(commands).T
    index_robots(sim)
    move(sim, 0, 0, len(starts))
    judge(sim, 0)
    return sim


def random_drive(rng, pace, start):
    v_max, rate, w_max = pace
    a_max = float(rng.choice([1.0, 4.0, 20.0]))
    v0, v = rng.uniform(0.0, v_max), rng.choice([v_max, rng.uniform(0.0, v_max)])
    w = rng.choice([0.0, w_max, -w_max, rng.uniform(-w_max, w_max)])
    return a_max, v0, (v, w), exact_path(start, v0, v, w, a_max, 1.0 / rate)


def beside(rng, points):
    """A place of a path and a unit vector away from it, mostly square to the way on, so that half of the cases miss."""
    k = int(rng.integers(len(points) - 1))
    ahead = points[k + 1] - points[k]
    angle = math.atan2(ahead[1], ahead[0]) + rng.choice([-0.5, 0.5]) * math.pi + rng.choice([0.0, rng.normal()])
    return k, np.array([math.cos(angle), math.sin(angle)])


def offset(rng):
    """How deep two things meet at the place where they are put [m]; negative: they miss."""
    return float(rng.choice([-1.0, 1.0]) * rng.choice([1e-3, 3e-3, 0.01, 0.04, 0.1]) * rng.uniform(0.5, 1.0))


@pytest.mark.parametrize("pace", PACES)
def test_contacts_with_standing_things_are_those_of_the_exact_motion(pace):
    rng = np.random.default_rng([int(10 * p) for p in pace])
    touching = judged_cases = 0
    for _ in range(150):
        start = np.array([0.0, 0.0, rng.uniform(-3.0, 3.0)])
        a_max, v0, command, path = random_drive(rng, pace, start)
        k, out = beside(rng, path)
        at = path[k]
        if rng.random() < 0.5:
            size = rng.choice([0.02, 0.3])
            centre = at + (RADIUS + size - offset(rng)) * out
            thing = circle(*centre.tolist(), size)
            gap = np.linalg.norm(path - centre, axis=1).min() - size - RADIUS
        else:
            end, turn = at + (RADIUS + 0.01 - offset(rng)) * out, math.atan2(out[1], out[0]) + rng.uniform(-1.5, 1.5)
            far = end + rng.uniform(0.1, 1.0) * np.array([math.cos(turn), math.sin(turn)])
            thing = wall(end.tolist(), far.tolist())
            gap = to_line(path, end, far).min() - 0.01 - RADIUS
        if abs(gap) < off_by(pace[1], pace[2]):
            continue
        sim = judged([start], [v0], [command], pace, a_max, thing)
        judged_cases += 1
        touching += gap < 0.0
        assert bool(sim.robots[0]["crashed"]) == (gap < 0.0), f"gap {gap:.5f} m, {command}, {thing}"
        assert float(sim.robots[0]["clearance"]) <= max(gap, 0.0) * 1.3 + 2e-3  # of what is near, too
    assert judged_cases > 100
    assert 20 < touching < judged_cases - 20


@pytest.mark.parametrize("pace", PACES)
def test_contacts_between_robots_are_those_of_the_exact_motion(pace):
    rng = np.random.default_rng([int(10 * p) for p in pace])
    touching = judged_cases = 0
    for _ in range(150):
        starts = np.column_stack([np.zeros((2, 2)), rng.uniform(-3.0, 3.0, 2)])
        a_max, v0, first, path = random_drive(rng, pace, starts[0])
        _, v1, second, other = random_drive(rng, pace, starts[1])
        other = exact_path(starts[1], v1, *second, a_max, 1.0 / pace[1])
        k, out = beside(rng, path - other)
        moved = path[k] - other[k] + (2.0 * RADIUS - offset(rng)) * out
        starts[1, :2] += moved
        gap = np.linalg.norm(other + moved - path, axis=1).min() - 2.0 * RADIUS
        if abs(gap) < 2.0 * off_by(pace[1], pace[2]) + 1e-4:
            continue
        sim = judged(starts, [v0, v1], [first, second], pace, a_max)
        judged_cases += 1
        touching += gap < 0.0
        assert sim.robots["crashed"].tolist() == [int(gap < 0.0)] * 2, f"gap {gap:.5f} m, {first}, {second}"
        assert np.allclose(np.maximum(sim.robots["clearance"], 0.0), max(gap, 0.0), atol=2e-3) or gap > 0.4
    assert judged_cases > 100
    assert 20 < touching < judged_cases - 20


@pytest.mark.parametrize(
    ("rate", "v"), [(1.0, 2.0), (2.0, 2.0), (3.0, 2.0), (5.0, 2.0), (5.0, 3.0), (5.0, 5.0), (1.0, 5.0)]
)
def test_nobody_drives_through_another_within_one_tick(rate, v):
    for apart in np.arange(0.35, 2.0 * v / rate + 0.3, 0.05):
        starts = [(-0.5 * apart, 0.0, 0.0), (0.5 * apart, 0.0, math.pi)]
        sim = judged(starts, [v, v], [(v, 0.0)] * 2, (v, rate, 2.0), 2.0)
        meets = 2.0 * v / rate > apart - 2.0 * RADIUS
        assert sim.robots["crashed"].tolist() == [int(meets)] * 2, apart


@pytest.mark.parametrize(
    ("rate", "v", "w"),
    [(1.0, 2.0, 2.0), (2.0, 1.0, 2.0), (2.0, 2.0, 2.0), (3.0, 2.0, 2.0), (5.0, 2.0, 6.0), (5.0, 0.5, 2.0)],
)
def test_an_arc_that_grazes_a_post_is_a_contact(rate, v, w):
    """Posts of 10 cm all along an arc and beside it: once its chords were clear of some that the arc hit."""
    pace, path = (v, rate, w), exact_path(np.zeros(3), v, v, w, 2.0, 1.0 / rate)
    grazed = 0
    for x in np.linspace(0.0, v / rate, 11):
        for y in np.linspace(-1.2, 1.2, 25):
            gap = float(np.hypot(path[:, 0] - x, path[:, 1] - y).min()) - RADIUS - 0.05
            if gap < -off_by(rate, w) and math.hypot(x, y) > 0.22:
                sim = judged([(0.0, 0.0, 0.0)], [v], [(v, w)], pace, 2.0, circle(float(x), float(y), 0.05))
                assert sim.robots["crashed"].tolist() == [1], (x, y, gap)
                grazed += 1
    assert grazed > 0


def test_who_was_stopped_stands_in_the_way_of_the_third():
    """Robot 1 stops at robot 2, on the line of robot 0, which it had else left in time."""
    starts = [(0.0, 0.0, 0.0), (2.0, -1.5, 0.5 * math.pi), (2.0, 0.32, 0.0)]
    commands = [(5.0, 0.0), (5.0, 0.0), (0.0, 0.0)]
    pace = (5.0, 1.0, 2.0)
    assert judged(starts, [5.0, 5.0, 0.0], commands, pace, 2.0).robots["crashed"].tolist() == [1, 1, 1]
    alone = judged(starts[:2], [5.0, 5.0], commands[:2], pace, 2.0)
    assert alone.robots["crashed"].tolist() == [0, 0]


def test_who_stops_before_touches_nobody_behind():
    """Robot 1 is stopped by robot 0 before it comes to robot 2, which nobody touches then."""
    starts = [(1.0, 0.31, 0.0), (0.0, 0.05, 0.0), (3.0, 0.0, 0.0)]
    sim = judged(starts, [0.0, 5.0, 0.0], [(0.0, 0.0), (5.0, 0.0), (0.0, 0.0)], (5.0, 1.0, 2.0), 2.0)
    assert sim.robots["crashed"].tolist() == [1, 1, 0]
    assert float(sim.robots[2]["clearance"]) > 0.0


def test_usual_robots_move_in_as_many_pieces_as_asked_for():
    assert enough_substeps(Clock(0, 0.2, 20), 0.5, 2.0) == 20
    assert enough_substeps(Clock(0, 1.0, 20), 5.0, 2.0) == math.ceil(math.sqrt(10.0 / (8.0 * ARC_M)))
    assert enough_substeps(Clock(0, 1.0, 20), 1e4, 50.0) == 1000

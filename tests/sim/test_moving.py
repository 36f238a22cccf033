"""What moves by itself: where discs are, what LiDARs see of them, who touched whom, when doors close."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError

from helpers import BOUNDS, beams_of, place_scenario, rig_of, run_scenario
from swarmscope.sim.moving import cast_moving, disc_at, moving_in, should_open, top_speed
from swarmscope.sim.world import Circle, Door, WorldSpec


def disc(**about):
    return {"type": "circle", "center": (0.0, 0.0), "radius": 0.5} | about


def moving(*obstacles):
    return moving_in(WorldSpec.model_validate({"obstacles": list(obstacles), "bounds": BOUNDS}))


def at(motion, *times):
    return [pytest.approx(disc_at(motion, 0, t), abs=1e-9) for t in times]


def test_a_disc_at_constant_speed_goes_on_for_ever():
    assert at(moving(disc(velocity=(0.5, -1.0))), 0.0, 2.0, 100.0) == [(0.0, 0.0), (1.0, -2.0), (50.0, -100.0)]


def test_a_disc_turns_back_at_the_end_of_its_way_unless_something_else_is_said():
    """4 m at 2 m/s: there after 2 s, back after 4."""
    for repeat in ({}, {"repeat": "back"}):
        motion = moving(disc(way=[(4.0, 0.0)], speed_mps=2.0, **repeat))
        assert at(motion, 1.0, 2.0, 3.0, 4.0, 7.0) == [(2, 0), (4, 0), (2, 0), (0, 0), (2, 0)]


def test_a_loop_leads_back_to_the_first_point_and_once_stays_at_the_last():
    square = {"way": [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], "speed_mps": 1.0}
    assert at(moving(disc(repeat="loop", **square)), 3.5, 4.0, 4.5) == [(0, 0.5), (0, 0), (0.5, 0)]
    assert at(moving(disc(repeat="once", **square)), 2.5, 3.0, 99.0) == [(0.5, 1), (0, 1), (0, 1)]


def test_times_say_when_it_is_where():
    motion = moving(disc(way=[(1.0, 0.0), (1.0, 0.0), (3.0, 0.0)], times_s=[2.0, 5.0, 6.0], repeat="once"))
    assert at(motion, 1.0, 4.0, 5.5) == [(0.5, 0), (1, 0), (2, 0)]
    assert top_speed(motion) == 2.0


@pytest.mark.parametrize(
    ("about", "message"),
    [
        ({"velocity": (0.1, 0.0), "way": [(1.0, 0.0)], "speed_mps": 1.0}, "either a velocity, or a way"),
        ({"way": [(1.0, 0.0)]}, "with speed_mps or times_s"),
        ({"way": [(0.0, 0.0)], "speed_mps": 1.0}, "leads nowhere"),
        ({"speed_mps": 1.0}, "are those of a 'way'"),
        ({"way": [(1.0, 0.0)], "times_s": [1.0, 2.0]}, "2 times_s for 1 points"),
        ({"way": [(1.0, 0.0)], "times_s": [0.0]}, "0 s is too early"),
        ({"way": [(1.0, 0.0)], "times_s": [1.0], "repeat": "loop"}, "ends at its center"),
        ({"velocity": (101.0, 0.0)}, "less than or equal to 100"),
        ({"way": [], "speed_mps": 1.0}, "at least 1"),
    ],
)
def test_what_is_wrong_with_a_motion_is_said(about, message):
    with pytest.raises(ValidationError, match=message):
        Circle.model_validate(disc(**about))


def test_a_door_that_opens_twice_a_minute():
    door = {"type": "door", "points": [(0.0, 0.0), (1.0, 0.0)], "open_s": [(5.0, 10.0), (20.0, 25.0)], "every_s": 30.0}
    motion = moving(door)
    assert [should_open(motion, 0, t) for t in (0.0, 5.0, 9.9, 10.0, 22.0, 29.0, 36.0)] == [0, 1, 1, 0, 1, 0, 1]
    with pytest.raises(ValidationError, match="from < until <= every_s"):
        Door.model_validate(door | {"open_s": [(5.0, 31.0)]})


def test_lidars_see_discs_where_they_are_and_nothing_from_inside():
    rig = rig_of()
    motion, out = moving(disc(center=(3.0, 0.0), velocity=(-1.0, 0.0))), np.full(360, np.inf, np.float32)
    cast_moving(motion, 1.0, 0.0, 0.0, 1.0, 0.0, beams_of(rig), out)
    assert (
        out[180] == pytest.approx(1.5)
        and np.isinf(out[0])
        and (out < 5.0).sum() == 2 * math.floor(math.degrees(math.asin(0.25))) + 1
    )
    cast_moving(motion, 3.0, 0.0, 0.0, 1.0, 0.0, beams_of(rig), out)
    assert not out.any()


def test_lidars_see_a_closed_door_like_a_wall():
    motion, out = (
        moving({"type": "door", "points": [(2.0, -1.0), (2.0, 1.0)], "open_s": []}),
        np.full(360, np.inf, np.float32),
    )
    cast_moving(motion, 0.0, 0.0, 0.0, 1.0, 0.0, beams_of(rig_of()), out)
    assert np.isinf(out).all()
    motion.closed[0] = 1
    cast_moving(motion, 0.0, 0.0, 0.0, 1.0, 0.0, beams_of(rig_of()), out)
    assert out[180] == pytest.approx(1.99) and out[180 + 26] < 5.0 and np.isinf(out[180 + 28])


def test_a_disc_that_walks_over_a_robot_that_stands_is_no_collision_of_the_robots():
    """Robot 0 stands at its goal in the disc's way, and the disc comes by twice; robot 1 keeps the run going."""
    walker = disc(center=(-3.0, 0.0), way=[(3.0, 0.0)], speed_mps=1.0)
    values = place_scenario([(0.0, 0.0, 0.0), (0.0, -9.0, 0.0)], [(0.0, 0.0), (9.0, 9.0)], [walker], limit_s=12.0)
    robots = run_scenario(values).robots
    assert robots["touched"].tolist() == [2, 0] and not robots["crashed"].any()


def test_a_door_waits_for_robots_and_robots_for_the_door():
    """It should close after 3 s, when the robot is in it; the one behind has to wait until it opens again at 40 s."""
    walls = [
        {"type": "wall", "points": [(0.0, -9.0), (0.0, -0.6)]},
        {"type": "wall", "points": [(0.0, 0.6), (0.0, 9.0)]},
    ]
    door = {"type": "door", "points": [(0.0, -0.58), (0.0, 0.58)], "open_s": [(0.0, 3.0), (40.0, 60.0)]}
    ends = [{"type": "wall", "points": [(-8.0, y), (8.0, y)]} for y in (-9.0, 9.0)]
    values = place_scenario(
        [(-1.5, 0.0, 0.0), (-4.5, 0.0, 0.0)], [(4.0, 0.0), (2.0, 0.0)], [*walls, *ends, door], limit_s=120.0
    )
    trace = run_scenario(values)
    closed_at = trace.t_s[np.flatnonzero(trace.doors[:, 0])[0]]
    robots = trace.robots
    assert 3.0 < closed_at < 8.0 and not robots["crashed"].any()
    assert robots["arrived"].all() and robots["arrival_s"][0] < 20.0 and robots["arrival_s"][1] > 40.0


def test_discs_are_recorded_where_they_were():
    values = place_scenario([(0.0, -5.0, 0.0)], [(2.0, -5.0)], [disc(center=(0.0, 3.0), velocity=(0.5, 0.0))])
    trace = run_scenario(values)
    assert trace.discs[:, 0] == pytest.approx(np.column_stack([0.5 * trace.t_s, np.full(len(trace.t_s), 3.0)]))

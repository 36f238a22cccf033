"""What `Robot` does with what it cannot use: it brakes, says why, counts it, and goes on at the next good tick."""

from __future__ import annotations

import itertools
import math
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import DT
from robots import ANGLES, OPEN, Driver, LaserScan, brakes, new_robot, wall_ahead, within
from swarmscope.errors import ConfigError, MissingExtraError, UnknownNameError
from swarmscope.onboard.body import Body
from swarmscope.onboard.lidar import Lidar
from swarmscope.onboard.planners import planner_names
from swarmscope.onboard.robot import Robot, Seen
from swarmscope.onboard.sharing.message import MAX_PACKET_BYTES

NAN, INF = math.nan, math.inf


class Hostile:
    """Raises whatever is asked of it."""

    def __getattr__(self, name):
        raise RuntimeError(name)

    def __len__(self):
        raise RuntimeError("len")

    def __iter__(self):
        raise RuntimeError("iter")

    def __float__(self):
        raise RuntimeError("float")

    def __repr__(self):
        raise RuntimeError("repr")


def no_ranges():
    scan = LaserScan(OPEN)
    scan.ranges = None
    return scan


BAD_SCANS = {
    "too short": np.full(180, INF, np.float32),
    "too long": np.full(720, INF, np.float32),
    "empty": [],
    "two-dimensional": np.full((360, 1), INF, np.float32),
    "one number": 3.0,
    "0-dimensional": np.array(3.0),
    "all NaN": np.full(360, NAN, np.float32),
    "all -inf": np.full(360, -INF),
    "all negative": np.full(360, -1.0),
    "text": ["far"] * 360,
    "numbers as text": ["1.0"] * 360,
    "one text": "x" * 360,
    "bytes": b"x" * 359,
    "objects": np.array([None] * 360),
    "ragged": [[1.0], *([1.0, 2.0] for _ in range(359))],
    "complex": np.full(360, 1j),
    "booleans": np.ones(360, bool),
    "a set": set(range(360)),
    "a generator": (1.0 for _ in range(360)),
    "hostile": Hostile(),
    "hostile list": [Hostile()] * 360,
    "huge": np.broadcast_to(np.float32(1.0), 10**9),
    "header without angles": LaserScan(OPEN, NAN),
    "header without increment": LaserScan(OPEN, angle_increment=NAN),
    "increment 0": LaserScan(OPEN, angle_increment=0.0),
    "three turns": LaserScan(np.full(1080, 1.0)),
    "a million readings": LaserScan(np.broadcast_to(np.float32(1.0), 10**6), angle_increment=1e-5),
    "one reading": LaserScan([1.0]),
    "no ranges": no_ranges(),
    "shorter range than the data sheet": LaserScan(OPEN, range_max=3.0),
    "range_max NaN": LaserScan(OPEN, range_max=NAN),
    "range_min beyond everything": LaserScan(OPEN, range_min=9.0),
}


@pytest.mark.parametrize("what", BAD_SCANS)
def test_a_scan_that_is_none_brakes_and_the_next_good_one_drives(what):
    driver = Driver()
    assert driver.ticks(3).v == 0.5
    bad = driver.tick(BAD_SCANS[what])
    assert brakes(bad), bad
    assert driver.tick().v == 0.5
    assert sum(driver.robot.faults.values()) == 1, driver.robot.faults


BAD_VALUES = [
    ("goal", (NAN, 1.0)), ("goal", (0.0, NAN)), ("goal", (INF, 1.0)), ("goal", (0.0, INF)), ("goal", (0.0, -1.0)),
    ("goal", (0.0, 1e300)), ("goal", (0.0,)), ("goal", (0.0, 1.0, NAN)), ("goal", (0.0, 1.0, 0.0, 2.0)), ("goal", 5.0),
    ("goal", "ab"), ("goal", None),
    ("goal", Hostile()), ("goal", (Hostile(), 1.0)), ("goal", itertools.repeat(1.0)), ("goal", (10**400, 1.0)),
    ("heading", NAN), ("heading", INF), ("heading", None), ("heading", "east"), ("heading", [1.0]),
    ("heading", Hostile()), ("heading", np.array([1.0])), ("heading", 10**400), ("heading", 1j),
    ("speed", NAN), ("speed", INF), ("speed", -INF), ("speed", None), ("speed", 1e9), ("speed", 3e38), ("speed", -9.0),
    ("moved", (NAN, 0.0, 0.0)), ("moved", (0.0, INF, 0.0)), ("moved", (0.0, 0.0, NAN)), ("moved", (0.0, 0.0)),
    ("moved", None), ("moved", (100.0, 0.0, 0.0)), ("moved", Hostile()), ("moved", itertools.count()),
    ("now_s", NAN), ("now_s", INF), ("now_s", -INF), ("now_s", None), ("now_s", "now"), ("now_s", 1.7e18),
    ("now_s", 0.4), ("now_s", -5.0), ("now_s", 1e6), ("now_s", Hostile()),
    ("scan_s", NAN), ("scan_s", INF), ("scan_s", "then"), ("scan_s", 1e6), ("scan_s", Hostile()),
    ("neighbours", 5), ("neighbours", Hostile()), ("neighbours", [None]), ("neighbours", [(1,)]), ("neighbours", [5]),
    ("neighbours", [Seen(1, NAN, 0.0)]), ("neighbours", [Seen(1, 0.0, INF)]), ("neighbours", [Seen(1, 1e300, 0.0)]),
    ("neighbours", [Seen(1, 1.0, 0.0, yaw=NAN)]), ("neighbours", [Seen(1, 1.0, 0.0, speed=NAN)]),
    ("neighbours", [Seen(1, 1.0, 0.0, radius_m=NAN)]), ("neighbours", [Seen(1, 1.0, 0.0, radius_m=-1.0)]),
    ("neighbours", [Seen(-1, 1.0, 0.0)]), ("neighbours", [Seen(65536, 1.0, 0.0)]),
    ("neighbours", [Seen(1.5, 1.0, 0.0)]),
    ("neighbours", [Seen(None, 1.0, 0.0)]), ("neighbours", [Hostile()]), ("neighbours", itertools.count()),
    ("neighbours", np.broadcast_to(np.float64(1.0), (10**8, 4))), ("neighbours", range(10**8)),
]  # fmt: skip


@pytest.mark.parametrize(("name", "value"), BAD_VALUES, ids=[f"{name}-{k}" for k, (name, _) in enumerate(BAD_VALUES)])
def test_a_value_that_is_none_brakes_and_the_next_good_tick_drives(name, value):
    driver = Driver()
    assert driver.ticks(3).v == 0.5
    bad = driver.tick(**{name: value})
    assert brakes(bad), bad
    driver.k += 1 if name == "now_s" and value == 1e6 else 0
    after = [driver.tick() for _ in range(2)]  # a clock that had jumped jumps back
    assert after[1].v == 0.5, after
    assert after[0].v == 0.5 or name == "now_s"
    assert set(driver.robot.faults) <= {
        "goal", "no goal", "heading", "speed", "moved", "clock", "scan stamp", "neighbours", "error",
    }  # fmt: skip
    assert driver.robot.faults["error"] == 0


def test_everything_wrong_at_once_for_long_and_then_right():
    driver, rng = Driver(), np.random.default_rng(0)
    scans = [OPEN, None, *BAD_SCANS.values()]
    for _ in range(500):
        values = dict(BAD_VALUES[k] for k in rng.integers(0, len(BAD_VALUES), rng.integers(0, 4)))
        command = driver.tick(scans[rng.integers(len(scans))], **values)
        assert within(command, Body())
    assert driver.ticks(2).v == 0.5
    assert len(driver.robot.faults) < 15


def test_no_clock_no_motion():
    driver = Driver()
    driver.ticks(3)
    for _ in range(3):
        assert brakes(driver.robot.tick(**driver.always, scan=OPEN, now_s=driver.now_s))
    assert driver.robot.faults["clock"] == 3
    assert driver.tick().v == 0.5


@pytest.mark.parametrize("jump", [-1000.0, 1000.0, 1.7e9])
def test_after_a_jump_of_the_clock_it_goes_on_with_what_it_knows(jump):
    """A following goes on, and nothing waits for the time that was skipped."""
    driver, other = Driver(), Driver()
    scan = wall_ahead()
    for _ in range(8):
        driver.tick(scan)
        other.tick(scan)
    driver.k += int(jump / DT)
    assert brakes(driver.tick(scan))
    for _ in range(5):
        a, b = driver.tick(scan), other.tick(scan)
    assert a.state == b.state == "follow"
    assert a.side == b.side != ""


@pytest.mark.parametrize("rate_hz", [1.0, 5.0, 20.0])
def test_a_scan_older_than_three_periods_brakes(rate_hz):
    robot = new_robot(rate_hz=rate_hz)
    driver = Driver(robot)
    period = 1.0 / rate_hz

    def tick(k, scan):
        return robot.tick(**driver.always, scan=scan, now_s=100.0 + k * period)

    assert tick(0, OPEN).ok
    assert all(tick(k, None).ok for k in (1, 2, 3))
    late = tick(4, None)
    assert brakes(late)
    assert "old" in late.reason
    assert tick(5, OPEN).ok
    old = robot.tick(**driver.always, scan=OPEN, now_s=100.0 + 9 * period, scan_s=100.0 + 5 * period)
    assert brakes(old)
    assert robot.faults == {"stale scan": 2}


def test_without_any_scan_it_stands():
    driver = Driver()
    for _ in range(3):
        assert brakes(driver.tick(None))
    assert driver.robot.faults == {"no scan": 3}


def test_a_scan_is_not_moved_on_by_unknown_motion():
    driver = Driver()
    driver.ticks(3)
    assert brakes(driver.tick(None, moved=(NAN, 0.0, 0.0)))
    command = driver.tick(None)
    assert brakes(command)
    assert "not known" in command.reason
    assert driver.tick().ok


@pytest.mark.parametrize("speed", [NAN, INF])
@pytest.mark.parametrize("distance", [0.2, 0.35])
def test_nan_speed_before_a_wall_does_not_drive(speed, distance):
    driver = Driver()
    assert brakes(driver.tick(wall_ahead(distance=distance), speed=speed))


def test_strange_addresses_among_the_neighbours():
    driver = Driver()
    places = [(7, 1.0), (3, 2.0), (3, 1.5), (4, 3.0), (3, 9.0)]
    driver.tick(neighbours=[Seen(address, x, 0.0) for address, x in places])
    percept = driver.robot.rows.percept
    assert percept["neighbour_id"][: percept["n_neighbours"]].tolist() == [3, 4]
    assert percept["neighbour_x"][0] == 1.5
    assert driver.robot.faults == {"own address seen": 1, "neighbour twice": 2}


BAD_INBOXES = [
    5, Hostile(), [None], [5], ["text"], [b""], [bytes(MAX_PACKET_BYTES + 1)], [bytes(10**6)], [np.zeros(3)], [[]],
    {1: 2},
    [np.zeros((2, 2), np.uint8)], [Hostile()], [(1, 2, 3)], [(1, None)], [memoryview(np.zeros((40, 40), np.uint8))],
]  # fmt: skip


@pytest.mark.parametrize("inbox", BAD_INBOXES, ids=range(len(BAD_INBOXES)))
def test_what_is_no_packet_is_left_out_and_stops_nobody(inbox):
    driver = Driver()
    assert driver.tick(inbox=inbox).v == 0.5
    assert driver.robot.faults == {"packets": 1}
    assert driver.robot.rows.percept["n_packets"] == 0


def test_a_flood_of_packets_fills_a_bounded_queue():
    driver = Driver()
    assert driver.tick(inbox=[bytes(7)] * 300).v == 0.5
    assert driver.robot.faults == {"packets without room": 300 - 32}
    assert driver.robot.rows.percept["n_packets"] == 8
    assert driver.tick(inbox=itertools.repeat(bytes(7))).v == 0.5
    driver.ticks(4)
    assert driver.robot.rows.percept["n_packets"] == 8 * (driver.robot.rows.percept["n_packets"] > 0)
    assert driver.tick().ok
    assert driver.robot.rows.percept["n_packets"] == 0


def test_packets_of_braking_ticks_are_not_lost():
    driver = Driver()
    assert brakes(driver.tick(heading=NAN, inbox=[bytes(7)]))
    driver.tick()
    assert driver.robot.rows.percept["n_packets"] == 1


def test_a_planner_that_fails_brakes():
    driver = Driver()
    driver.ticks(2)
    planner = driver.robot.rows.planner

    class Broken:
        def step_all(self, *arguments):
            raise ZeroDivisionError

    driver.robot.rows.planner = Broken()
    assert brakes(driver.tick())
    driver.robot.rows.planner = planner
    assert driver.tick().v == 0.5
    assert driver.robot.faults == {"error": 1}


def test_a_planner_that_asks_for_the_impossible_brakes():
    driver = Driver()

    class Wild:
        def step_all(self, first, last, held, memories, params):
            held.what.decisions["v"], held.what.decisions["w"] = NAN, 1e9

    driver.robot.rows.planner = Wild()
    assert brakes(driver.tick())
    assert driver.robot.faults == {"planner": 1}


# The lines of what was tried on earlier versions: a wall 0.35 m ahead, in every way that a scan can be wrong.


def drive(scan, lidar=None, **values):
    driver = Driver(new_robot(lidar=lidar or Lidar(range_sigma=0.01, position_sigma=0.02)), goal=(0.0, 10.0))
    for _ in range(10):
        command = driver.tick(scan, **values)
        assert within(command, Body())
    return command, driver.robot


def keeps_off(command, robot):
    """Not at the wall ahead: it stands, or turns away from it on the spot."""
    return command.v < 0.01 or abs(robot.rows.decision["heading"]) > 0.6


def test_danger_wall_with_the_right_rig():
    command, robot = drive(wall_ahead())
    assert command.ok
    assert keeps_off(command, robot)


def test_danger_720_beams_into_360():
    command, robot = drive(wall_ahead(-np.pi + np.pi / 360.0 * np.arange(720)))
    assert brakes(command)
    assert robot.faults["scan"] == 10


def test_danger_a_clockwise_lidar():
    command, robot = drive(wall_ahead(-ANGLES), Lidar(clockwise=True))
    assert command.ok
    assert keeps_off(command, robot)


def test_danger_a_scan_from_0_to_2_pi():
    command, robot = drive(np.roll(wall_ahead(), 180), Lidar(first_deg=0.0))
    assert keeps_off(command, robot)
    command, robot = drive(LaserScan(np.roll(wall_ahead(), 180), 0.0))
    assert keeps_off(command, robot)


def test_danger_goal_nan():
    command, robot = drive(OPEN, goal=(NAN, 10.0))
    assert brakes(command)
    assert robot.faults == {"goal": 10}


@pytest.mark.parametrize(
    ("scan", "moves"),
    [(OPEN, True), (OPEN.astype(float), True), ([INF] * 360, True), (np.full(180, INF), False),
     (np.full(720, INF), False), (np.full(360, NAN), False)],
)  # fmt: skip
def test_tryers_scans(scan, moves):
    command, _ = drive(scan)
    assert (command.v > 0.4) == moves == command.ok


def test_tryers_all_zero():
    command, _ = drive(np.zeros(360, np.float32))
    assert command.v == 0.0


def test_tryers_99_neighbours():
    command, robot = drive(OPEN, neighbours=[Seen(100 + k, 5.0 + k, 1.0) for k in range(99)])
    assert command.ok
    assert robot.rows.percept["n_neighbours"] == 10


WRONG_BODIES = [
    ({"radius_m": -1.0}, "body.radius_m"), ({"radius_m": 0.0}, "body.radius_m"), ({"radius_m": NAN}, "body.radius_m"),
    ({"v_max_mps": INF}, "body.v_max_mps"), ({"a_max_mps2": 0.0}, "body.a_max_mps2"),
    ({"w_max_radps": "2"}, "body.w_max_radps"),
    ({"half_width_m": 3.0}, "body.half_width_m"), ({"sensor_delay_s": -1.0}, "body.sensor_delay_s"),
    ({"radius_m": 1e300, "half_width_m": 1e-300}, "body"),
]  # fmt: skip


@pytest.mark.parametrize(("values", "field"), WRONG_BODIES)
def test_an_impossible_body(values, field):
    with pytest.raises(ConfigError) as error:
        Robot("nav-scope", Body(**values), Lidar(), address=1)
    assert error.value.where == field


WRONG_ROBOTS = [
    ({"lidar": Lidar(beams=0)}, "lidar.beams"), ({"lidar": Lidar(range_m=INF)}, "lidar.range_m"),
    ({"lidar": Lidar(range_m=-1.0)}, "lidar.range_m"), ({"lidar": Lidar(range_m=0.2)}, "lidar.range_m"),
    ({"lidar": Lidar(fov_deg=400.0)}, "lidar.fov_deg"), ({"lidar": Lidar(mount=(0.5, 0.0, 0.0))}, "lidar.mount"),
    ({"lidar": Lidar(mount=(NAN, 0.0, 0.0))}, "lidar.mount"), ({"address": -1}, "address"),
    ({"address": 65536}, "address"), ({"address": 1.5}, "address"), ({"address": None}, "address"),
    ({"address": NAN}, "address"), ({"rate_hz": 0.0}, "rate_hz"),
    ({"rate_hz": NAN}, "rate_hz"), ({"rate_hz": -5}, "rate_hz"), ({"look_ahead_m": NAN}, "look_ahead_m"),
    ({"clearance_m": -0.1}, "clearance_m"), ({"margin_m": "wide"}, "margin_m"),
    ({"first_scans": 101}, "first_scans"), ({"first_scans": 2.5}, "first_scans"), ({"first_scans": NAN}, "first_scans"),
    ({"params": {"w_i": NAN}}, "planner 'nav-scope': w_i"),
    ({"planner": "oracle"}, "planner"), ({"planner": None}, "planner"), ({"planner": 7}, "planner"),
]  # fmt: skip


@pytest.mark.parametrize(("values", "field"), WRONG_ROBOTS, ids=range(len(WRONG_ROBOTS)))
def test_an_impossible_robot(values, field):
    arguments = {"planner": "nav-scope", "body": Body(), "lidar": Lidar(), "address": 1} | values
    with pytest.raises(ConfigError) as error:
        Robot(**arguments)
    assert error.value.where == field


@pytest.mark.parametrize(
    ("values", "hint"),
    [({"planner": "nav-scop"}, "nav-scope"), ({"planner": ""}, "nav-scope"), ({"look_ahed": 1.0}, "look_ahead"),
     ({"params": {"w_j": 1.0}}, "w_i")],
)  # fmt: skip
def test_an_unknown_name_is_an_error_with_the_nearest(values, hint):
    arguments = {"planner": "nav-scope", "body": Body(), "lidar": Lidar(), "address": 1} | values
    with pytest.raises(UnknownNameError, match=hint):
        Robot(**arguments)


@pytest.mark.parametrize(("planner", "library"), [("orca", "navground.core"), ("giwt", "onnxruntime")])
def test_a_missing_extra_is_named(planner, library, monkeypatch):
    from swarmscope.onboard.planning import orca

    monkeypatch.setattr(orca, "_local", type(orca._local)())
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingExtraError, match=planner):
        Robot(planner, Body(), Lidar(), address=1)


strange = st.one_of(
    st.floats(), st.integers(), st.none(), st.text(max_size=3), st.binary(max_size=3), st.just(10**400),
    st.sampled_from([np.float32("nan"), np.int8(3), np.array([1.0]), np.array(2.0), True, Hostile(), 1j]),
)  # fmt: skip
lists = st.lists(strange, max_size=5)
entries = st.one_of(
    strange, lists, st.builds(Seen, strange, strange, strange, strange, strange, strange),
    st.tuples(st.integers(0, 9), st.floats(-3, 3), st.floats(-3, 3)),
)  # fmt: skip
a_scan = st.one_of(
    strange, lists, st.just(OPEN), st.none(), st.just(wall_ahead()),
    st.builds(lambda v, k: np.where(np.arange(360) % k == 0, v, 2.0), st.floats(), st.integers(1, 360)),
    st.builds(lambda n, a, i: LaserScan(np.ones(n), a, i), st.integers(0, 800), st.floats(), st.floats()),
)  # fmt: skip


@settings(max_examples=25)
@pytest.mark.parametrize("name", [name for name in planner_names() if name != "oracle"])
@given(data=st.data())
def test_nothing_makes_it_raise_or_leave_its_limits(name, data):
    driver = Driver(warm(name))
    for _ in range(6):
        values = data.draw(
            st.fixed_dictionaries(
                {},
                optional={
                    "goal": st.one_of(strange, st.tuples(strange, strange)),
                    "heading": strange,
                    "speed": st.one_of(st.floats(-1.0, 1.0), strange),
                    "moved": st.one_of(strange, st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), strange)),
                    "now_s": strange,
                    "scan_s": strange,
                    "neighbours": st.one_of(strange, st.lists(entries, max_size=4)),
                    "inbox": st.one_of(strange, st.lists(st.one_of(strange, st.binary(max_size=150)), max_size=12)),
                },
            )
        )
        command = driver.tick(data.draw(a_scan), **values)
        assert within(command, Body())
        assert isinstance(command.reason, str)
        assert command.ok or brakes(command)


def warm(name, robots={}):  # noqa: B006
    """A robot of every planner, warm once; as new for every example."""
    if name not in robots:
        robots[name] = new_robot(name)
    robots[name].reset()
    return robots[name]

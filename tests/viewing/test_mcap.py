"""The MCAP file, opened with the public readers: scans, frames and commands are those of the run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from helpers import circle, place_scenario, wall
from swarmscope.errors import ConfigError, InputFileError, MissingExtraError
from swarmscope.judging.run import run_scenario
from swarmscope.onboard.body import Body
from swarmscope.onboard.control.unicycle import ramp
from swarmscope.scenarios.read import parse_scenario
from swarmscope.sim import loop
from swarmscope.sim.world import Grid
from swarmscope.viewing.bag import drawn, make
from swarmscope.viewing.bag.exact import Exact
from swarmscope.viewing.bag.ros import as_cdr
from swarmscope.viewing.run_data import RunData, load_run

STORE = get_typestore(Stores.LATEST)
CORNERS = [[2.0, -2.0], [3.0, -2.0], [2.5, -1.0]]
NOISE = {"range_fraction": 0.05, "dropout": 0.05, "nan": 0.05, "stuck": 0.02}


class Made(NamedTuple):
    run: RunData
    given: list[np.ndarray]
    """Scans as the planners were given them, a tick each."""
    messages: dict[str, list]
    """Of each topic (time [ns], message)."""


def scenario_of(**more):
    things = [circle(1.5, 0.1, 0.4), {"type": "polygon", "points": CORNERS}, wall((-1, 2), (3, 2))]
    starts, goals = [(-1, 0, 0), (-1, 1, 0), (4, 0.5, math.pi)], [(4, 0), (4, 1), (-1, 0.5)]
    values = place_scenario(starts, goals, things, limit_s=5.0, noise=NOISE) | {"record_scans": "yes"} | more
    return parse_scenario(values, "test")


def messages_of(path: Path) -> dict[str, list]:
    found: dict[str, list] = {}
    with Reader(path) as reader:
        for connection, t_ns, raw in reader.messages():
            found.setdefault(connection.topic, []).append((t_ns, STORE.deserialize_cdr(raw, connection.msgtype)))
    return found


@pytest.fixture(scope="module", params=[360.0, 120.0], ids=["round", "field of view"])
def made(request, tmp_path_factory) -> Made:
    scenario = scenario_of(lidar={"fov_deg": request.param, "beams": 90})
    folder, exact, given = tmp_path_factory.mktemp("mcap") / "run", Exact(), []
    stepper = loop._stepper

    def spied(setting, swarm, memory):
        step, sensor = stepper(setting, swarm, memory), setting.rig.sensor

        def step_all(first, last):
            if last > first:
                given.append(swarm.scans[:, sensor.first : sensor.first + 90].copy())
            step(first, last)

        return step_all

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loop, "_stepper", spied)
        run_scenario(scenario, folder, extras=make.adder(exact), watch=exact.watch)
    return Made(load_run(folder), given, messages_of(folder / "run.mcap"))


def test_scans_are_what_the_robots_were_given(made: Made) -> None:
    """To the bit, with noise, lost, stuck and broken readings: not what a decision has mended in place."""
    trajectory = made.run.trajectory
    assert len(made.given) == trajectory.t_s.size == 25
    assert np.isnan(made.given).any() and np.isposinf(made.given).any()
    for i in range(3):
        scans = made.messages[f"/robot_{i}/scan"]
        assert np.array_equal([m.ranges for _, m in scans], [tick[i] for tick in made.given], equal_nan=True)
        assert [t_ns for t_ns, _ in scans] == [200_000_000 * k for k in range(25)]
        scan = scans[6][1]
        assert (scan.header.stamp.sec, scan.header.stamp.nanosec) == (1, 200_000_000)
        assert scan.header.frame_id == f"robot_{i}/base_link"
        angles = scan.angle_min + scan.angle_increment * np.arange(90)
        assert angles == pytest.approx(trajectory.beam_angles, abs=1e-5)
        assert scan.angle_max == pytest.approx(trajectory.beam_angles[-1])
        assert (scan.range_max, scan.scan_time, scan.time_increment) == pytest.approx((5.0, 0.2, 0.0))


def test_frames_are_the_trajectory(made: Made) -> None:
    trajectory = made.run.trajectory
    frames = [m.transforms for _, m in made.messages["/tf"]]
    for i in range(3):
        mine = [tick[i] for tick in frames]
        assert {(f.header.frame_id, f.child_frame_id) for f in mine} == {("map", f"robot_{i}/base_link")}
        assert np.array_equal([f.transform.translation.x for f in mine], trajectory.x_m[:, i])
        assert np.array_equal([f.transform.translation.y for f in mine], trajectory.y_m[:, i])
        yaw = [2.0 * math.atan2(f.transform.rotation.z, f.transform.rotation.w) for f in mine]
        assert np.cos(yaw - trajectory.yaw_rad[:, i]) == pytest.approx(1.0)
        assert mine[-1].header.stamp.sec == 4 and mine[-1].header.stamp.nanosec == 800_000_000


def test_commands_drive_the_trajectory(made: Made) -> None:
    """From tick to tick the heading turns by w dt, and the speed follows v as far as the acceleration lets it."""
    trajectory = made.run.trajectory
    moved = 0
    for i in range(3):
        commands = [m for _, m in made.messages[f"/robot_{i}/cmd_vel"]]
        yaw, speed = trajectory.yaw_rad[:, i], trajectory.speed_mps[:, i]
        turned = np.angle(np.exp(1j * (np.diff(yaw) - [0.2 * m.angular.z for m in commands[:-1]])))
        assert turned == pytest.approx(0.0, abs=1e-9)
        after = [ramp(float(v), m.linear.x, Body().a_max_mps2, 0.2)[0] for v, m in zip(speed, commands, strict=True)]
        assert after[:-1] == pytest.approx(speed[1:], abs=1e-6)
        moved += np.count_nonzero(speed > 0.1)
    assert moved > 20


def test_the_world_stands_in_markers_and_states_are_told(made: Made) -> None:
    ((_, world),) = made.messages["/obstacles"]
    disc, block, line = world.markers
    assert (disc.type, disc.pose.position.x, disc.pose.position.y, disc.scale.x) == (drawn.CYLINDER, 1.5, 0.1, 0.8)
    assert block.type == drawn.TRIANGLES and len(block.points) == 3 * 9
    assert {(p.x, p.y) for p in block.points} == {tuple(c) for c in CORNERS}
    assert [(p.x, p.y) for p in line.points] == [(-1.0, 2.0), (3.0, 2.0)] and line.scale.x == 0.02
    assert [m.text for m in made.messages["/goals"][0][1].markers if m.text] == ["0", "1", "2"]
    assert "/map" not in made.messages
    robots = made.messages["/robots"]
    assert [t_ns // 10**9 for t_ns, _ in robots] == [0, 1, 2, 3, 4, 4]
    assert {(m.header.frame_id, m.frame_locked) for m in robots[0][1].markers} == {
        (f"robot_{i}/base_link", True) for i in range(3)
    }
    way = made.messages["/paths"][-1][1].markers[1]
    assert [p.x for p in way.points] == made.run.trajectory.x_m[:, 1].tolist()
    words = made.messages["/robot_0/state"][0][1].data
    trajectory = made.run.trajectory
    assert words.startswith(f"{trajectory.state_names[trajectory.state[0, 0]]}: ")


def test_a_finished_run_gives_the_same_bytes_again(made: Made, tmp_path: Path) -> None:
    folder = made.run.folder
    again = make.make_mcap(folder, make.scenario_of(folder), tmp_path / "again.mcap")
    assert again.read_bytes() == (folder / "run.mcap").read_bytes()
    with again.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        kinds = {(s.name, s.encoding) for s in reader.get_summary().schemas.values()}
        assert ("sensor_msgs/msg/LaserScan", "ros2msg") in kinds and ("tf2_msgs/msg/TFMessage", "ros2msg") in kinds
        assert next(reader.iter_attachments()).data == (folder / "config.yaml").read_bytes()


def test_a_run_that_no_longer_comes_out_the_same_is_refused(made: Made, tmp_path: Path) -> None:
    trajectory = made.run.trajectory
    other = made.run.__class__(
        made.run.folder, made.run.world, trajectory._replace(y_m=trajectory.y_m + 1e-9), made.run.metrics
    )
    from swarmscope.viewing.bag.again import play_again

    with pytest.raises(InputFileError, match=r"trajectory.npz: the run no longer comes out the same \(y_m differs\)"):
        play_again(other, make.scenario_of(made.run.folder))


def test_names_that_are_no_mcap_and_missing_packages(made: Made, tmp_path: Path, monkeypatch) -> None:
    folder = made.run.folder
    with pytest.raises(ConfigError, match=r"ends with \.mcap"):
        make.make_mcap(folder, make.scenario_of(folder), tmp_path / "run.bag")
    with pytest.raises(ConfigError, match="no such folder"):
        make.make_mcap(folder, make.scenario_of(folder), tmp_path / "nowhere/run.mcap")
    monkeypatch.setattr(make, "find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"swarmscope\[bags\]"):
        make.check_packages()


def test_a_map_is_an_occupancy_grid() -> None:
    """3 x 2 cells of 0.5 m, turned by 90 degrees; solid are the lower left one and the upper two on the right."""
    grid = Grid(resolution=0.5, origin=(1, 2), yaw=math.pi / 2, width=3, height=2, rows=[(0, 0, 0), (1, 1, 2)])
    raw = as_cdr(drawn.occupancy(grid, 1_500_000_000), "nav_msgs/OccupancyGrid")
    found = STORE.deserialize_cdr(raw, "nav_msgs/msg/OccupancyGrid")
    assert found.data.tolist() == [100, 0, 0, 0, 100, 100]
    info = found.info
    assert (info.width, info.height, info.resolution, info.origin.position.x) == (3, 2, 0.5, 1.0)
    assert (info.origin.orientation.z, info.origin.orientation.w) == pytest.approx((0.5**0.5, 0.5**0.5))
    assert (found.header.stamp.sec, found.header.stamp.nanosec, found.header.frame_id) == (1, 500_000_000, "map")


def test_long_ways_are_thinned_and_end_where_the_robot_is(made: Made) -> None:
    trajectory = made.run.trajectory
    long = [np.tile(array, (40, 1)) for array in trajectory[1:12]]
    run = RunData(
        made.run.folder,
        made.run.world,
        trajectory._replace(t_s=np.arange(1000) * 0.2, **dict(zip(trajectory._fields[1:12], long, strict=True))),
        {},
    )
    points = drawn.Moving(run).paths(998)[0].points
    assert len(points) == 251  # every fourth, and the last
    assert points[-1].x == run.trajectory.x_m[998, 0]

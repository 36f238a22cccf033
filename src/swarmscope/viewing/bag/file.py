"""Writes the MCAP file of a run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import numpy as np
from mcap.writer import Writer

from swarmscope.judging.run_folder import CONFIG
from swarmscope.sim.world import Grid
from swarmscope.viewing.bag import drawn
from swarmscope.viewing.bag.drawn import array_of, base_link
from swarmscope.viewing.bag.exact import Exact, LidarSheet, Noted
from swarmscope.viewing.bag.ros import MAP, as_cdr, definition, header, make, nanoseconds, turned, vector
from swarmscope.viewing.run_data import RunData, replacing

SLOW_S = 1.0
"""How often the robots' markers and their ways are written again, for those who begin in the middle."""
FOREVER = "{sec: 9223372036, nsec: 854775807}"
KEPT = (  # what rosbag2 offers late subscribers, in the spelling that all its versions read
    "- {history: 1, depth: 1, reliability: 1, durability: 1, "
    f"deadline: {FOREVER}, lifespan: {FOREVER}, liveliness: 1, liveliness_lease_duration: {FOREVER}, "
    "avoid_ros_namespace_conventions: false}"
)
MARKERS = "visualization_msgs/MarkerArray"


class Bag:
    """An MCAP file that is being written: a channel for each topic, made when it is first needed."""

    def __init__(self, file: IO[bytes]) -> None:
        self._writer = Writer(file)
        self._writer.start(profile="ros2", library="swarmscope")
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._counts: dict[str, int] = {}

    def put(self, topic: str, kind: str, message: Any, t_ns: int, kept: bool = False) -> None:
        """Write a message; late subscribers are given the last one of a topic that is ``kept``."""
        if topic not in self._channels:
            self._channels[topic] = self._channel(topic, kind, kept)
        number = self._counts[topic] = self._counts.get(topic, 0) + 1
        self._writer.add_message(self._channels[topic], t_ns, as_cdr(message, kind), t_ns, number)

    def attach(self, path: Path) -> None:
        """Add a file as it is."""
        self._writer.add_attachment(0, 0, path.name, "application/yaml", path.read_bytes())

    def finish(self) -> None:
        """Write the index."""
        finish: Callable[[], None] = self._writer.finish  # which says nothing of its types
        finish()

    def _channel(self, topic: str, kind: str, kept: bool) -> int:
        if kind not in self._schemas:
            name = kind.replace("/", "/msg/")
            self._schemas[kind] = self._writer.register_schema(name, "ros2msg", definition(kind))
        about = {"offered_qos_profiles": KEPT if kept else ""}
        return self._writer.register_channel(topic, "cdr", self._schemas[kind], about)


def write_mcap(run: RunData, exact: Exact, path: Path, progress: Callable[[int, int], None] | None = None) -> Path:
    """Write the run into the MCAP file ``path``; the same run gives the same bytes. ``progress(ticks, of)``."""
    with replacing(path) as temporary, temporary.open("wb") as file:
        bag = Bag(file)
        bag.attach(run.folder / CONFIG)
        _put_world(bag, run)
        moving, before = drawn.Moving(run), np.zeros(0)
        for tick, noted in enumerate(exact):
            t_ns = nanoseconds(float(run.trajectory.t_s[tick]))
            _put_robots(bag, run, tick, noted, exact.lidar)
            _put_states(bag, run, tick)
            crashed = moving.crashed(tick)
            if _is_due(run, tick) or tick == exact.ticks - 1 or not np.array_equal(crashed, before):
                bag.put("/robots", MARKERS, array_of(moving.robots(tick)), t_ns)
                bag.put("/paths", MARKERS, array_of(moving.paths(tick)), t_ns)
            things = moving.things(tick)
            if things:
                bag.put("/moving", MARKERS, array_of(things), t_ns)
            packets = moving.packets(tick)
            if packets:
                bag.put("/packets", MARKERS, array_of(packets), t_ns)
            before = crashed
            if progress is not None:
                progress(tick + 1, exact.ticks)
        bag.finish()
    return path


def _is_due(run: RunData, tick: int) -> bool:
    """Tell whether a new second begins with this tick."""
    t_s = run.trajectory.t_s
    return tick == 0 or int(t_s[tick] / SLOW_S + 1e-6) != int(t_s[tick - 1] / SLOW_S + 1e-6)


def _put_world(bag: Bag, run: RunData) -> None:
    """Write what stands still."""
    t_ns = nanoseconds(float(run.trajectory.t_s[0]))
    for obstacle in run.world.obstacles:
        if isinstance(obstacle, Grid):
            bag.put("/map", "nav_msgs/OccupancyGrid", drawn.occupancy(obstacle, t_ns), t_ns, kept=True)
    standing = drawn.obstacles(run.world.obstacles)
    if standing:
        bag.put("/obstacles", MARKERS, array_of(standing), t_ns, kept=True)
    bag.put("/goals", MARKERS, array_of(drawn.goals(run.world.robots)), t_ns, kept=True)


def _put_robots(bag: Bag, run: RunData, tick: int, noted: Noted, lidar: LidarSheet) -> None:
    """Write where the robots are, what they measure and what they command."""
    trajectory = run.trajectory
    t_ns = nanoseconds(float(trajectory.t_s[tick]))
    frames = []
    for i in range(len(run.world.robots)):
        x, y, yaw = (float(array[tick, i]) for array in (trajectory.x_m, trajectory.y_m, trajectory.yaw_rad))
        where = make("geometry_msgs/Transform", vector(x, y), turned(yaw))
        frames.append(make("geometry_msgs/TransformStamped", header(t_ns, MAP), base_link(i), where))
    bag.put("/tf", "tf2_msgs/TFMessage", make("tf2_msgs/TFMessage", frames), t_ns)
    for i, (ranges, (v, w)) in enumerate(zip(noted.ranges, noted.commands.tolist(), strict=True)):
        bag.put(f"/robot_{i}/scan", "sensor_msgs/LaserScan", _scan(ranges, lidar, t_ns, base_link(i)), t_ns)
        command = make("geometry_msgs/Twist", vector(v, 0.0), vector(0.0, 0.0, w))
        bag.put(f"/robot_{i}/cmd_vel", "geometry_msgs/Twist", command, t_ns)


def _scan(ranges: np.ndarray, lidar: LidarSheet, t_ns: int, frame: str) -> Any:
    """Return a scan: inf is no return, NaN is broken (REP-117); all its beams look at the same moment."""
    beams = lidar.beams
    last = beams.angle_min + beams.increment * (len(ranges) - 1)
    angles, times = (beams.angle_min, last, beams.increment), (0.0, lidar.dt)
    reach = (lidar.range_min, beams.range_max)
    nothing = np.zeros(0, np.float32)
    return make("sensor_msgs/LaserScan", header(t_ns, frame), *angles, *times, *reach, ranges, nothing)


def _put_states(bag: Bag, run: RunData, tick: int) -> None:
    """Write why robots do what they do, where that has changed."""
    trajectory = run.trajectory
    state, reason = trajectory.state, trajectory.reason
    t_ns = nanoseconds(float(trajectory.t_s[tick]))
    for i in range(len(run.world.robots)):
        if tick > 0 and (state[tick, i], reason[tick, i]) == (state[tick - 1, i], reason[tick - 1, i]):
            continue
        words = f"{trajectory.state_names[state[tick, i]]}: {trajectory.reason_names[reason[tick, i]]}"
        bag.put(f"/robot_{i}/state", "std_msgs/String", make("std_msgs/String", words), t_ns)

"""The markers of a run: what stands in its world, its robots, goals, ways and packets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from swarmscope.sim.world import WALL_M, Circle, Grid, Obstacle, Polygon, Wall, solid_from_grid
from swarmscope.viewing.bag.ros import (
    ARROW,
    CYLINDER,
    LINE_STRIP,
    MAP,
    TEXT,
    TRIANGLES,
    Look,
    Name,
    header,
    make,
    marker,
    nanoseconds,
    pose,
)
from swarmscope.viewing.colours import CRASH, INK, MOVER, SOLID, WALL, robot_colours
from swarmscope.viewing.run_data import RobotEntry, RunData, crash_ticks, discs_of, doors_of

TALL_M = 0.3
"""Height of what stands in the world."""
PATH_POINTS = 256
"""Of a longer way only every 2nd, 4th, ... point is drawn."""
LINK_S = 0.6
"""How long a packet is seen."""
CIRCLE = np.linspace(0.0, 2.0 * math.pi, 25)


def array_of(markers: Sequence[Any]) -> Any:
    """Return the markers as one message."""
    return make("visualization_msgs/MarkerArray", list(markers))


def occupancy(grid: Grid, t_ns: int) -> Any:
    """Return a map: 0 free, 100 solid, row 0 at the bottom."""
    x, y = grid.origin
    time = header(t_ns, MAP).stamp
    info = make("nav_msgs/MapMetaData", time, grid.resolution, grid.width, grid.height, pose(x, y, 0.0, grid.yaw))
    cells = (solid_from_grid(grid).astype(np.int8) * np.int8(100)).ravel()
    return make("nav_msgs/OccupancyGrid", header(t_ns, MAP), info, cells)


def obstacles(found: Sequence[Obstacle]) -> list[Any]:
    """Return markers of all that is no map."""
    head, here, markers = header(0, MAP), pose(0.0, 0.0), []
    for n, obstacle in enumerate(found):
        name = Name("obstacles", n)
        if isinstance(obstacle, Circle) and obstacle.moves:
            continue
        if isinstance(obstacle, Circle):
            wide = 2.0 * obstacle.radius
            where = pose(*obstacle.center, 0.5 * TALL_M)
            markers.append(marker(CYLINDER, name, head, where, Look(_rgba(SOLID), (wide, wide, TALL_M))))
        elif isinstance(obstacle, Polygon):
            look = Look(_rgba(SOLID), (1.0, 1.0, 1.0))
            markers.append(marker(TRIANGLES, name, head, here, look, _block(obstacle.points)))
        elif isinstance(obstacle, Wall):
            line = [(x, y, 0.0) for x, y in obstacle.points]
            markers.append(marker(LINE_STRIP, name, head, here, Look(_rgba(WALL), (WALL_M, 0.0, 0.0)), line))
    return markers


def goals(robots: Sequence[RobotEntry]) -> list[Any]:
    """Return a ring and a number for each goal."""
    head, markers = header(0, MAP), []
    for i, (robot, colour) in enumerate(zip(robots, robot_colours(len(robots)), strict=True)):
        x, y = robot.goal
        wide, paint = robot.radius, tuple(colour)
        ring = np.column_stack([1.3 * wide * np.cos(CIRCLE), 1.3 * wide * np.sin(CIRCLE), 0.0 * CIRCLE]).tolist()
        look = Look(paint, (0.15 * wide, 0.0, 0.0))
        markers.append(marker(LINE_STRIP, Name("goals", i), head, pose(x, y), look, ring))
        look, above = Look(paint, (0.0, 0.0, 1.5 * wide)), pose(x, y, TALL_M)
        markers.append(marker(TEXT, Name("numbers", i), head, above, look, text=str(robot.id)))
    return markers


class Moving:
    """The markers that change."""

    def __init__(self, run: RunData) -> None:
        self._run = run
        self._colours = [tuple(colour) for colour in robot_colours(len(run.world.robots)).tolist()]
        self._crashed = crash_ticks(run.trajectory)
        order = np.argsort(run.trajectory.links[:, 0], kind="stable")
        self._links = run.trajectory.links[order]

    def crashed(self, tick: int) -> Any:
        """Return (N,) who has collided."""
        return self._crashed <= tick

    def robots(self, tick: int) -> list[Any]:
        """Return body, heading and number of each robot, in its own frame."""
        markers, crashed = [], self.crashed(tick)
        for i, robot in enumerate(self._run.world.robots):
            head, r = header(0, base_link(i)), robot.radius
            paint = _rgba(CRASH) if crashed[i] else self._colours[i]
            look = Look(paint, (2.0 * r, 2.0 * r, TALL_M))
            markers.append(marker(CYLINDER, Name("bodies", i), head, pose(0.0, 0.0, 0.5 * TALL_M), look))
            look = Look(_rgba(INK), (1.6 * r, 0.3 * r, 0.1 * r))
            markers.append(marker(ARROW, Name("headings", i), head, pose(0.0, 0.0, TALL_M), look))
            look, above = Look(_rgba(INK), (0.0, 0.0, 1.5 * r)), pose(0.0, 0.0, TALL_M + 1.5 * r)
            markers.append(marker(TEXT, Name("numbers", i), head, above, look, text=str(robot.id)))
        return markers

    def things(self, tick: int) -> list[Any]:
        """Return the discs that move, and the doors that are closed or have just opened."""
        trajectory, markers = self._run.trajectory, []
        head, here = header(nanoseconds(float(trajectory.t_s[tick])), MAP), pose(0.0, 0.0)
        for d, disc in enumerate(discs_of(self._run.world)):
            x, y = trajectory.disc_xy_m[tick, d].tolist()
            look = Look(_rgba(MOVER), (2.0 * disc.radius, 2.0 * disc.radius, TALL_M))
            markers.append(marker(CYLINDER, Name("discs", d), head, pose(x, y, 0.5 * TALL_M), look))
        for k, door in enumerate(doors_of(self._run.world)):
            wide = WALL_M if trajectory.door_closed[tick, k] else 0.2 * WALL_M
            line = [(x, y, 0.0) for x, y in door.points]
            markers.append(marker(LINE_STRIP, Name("doors", k), head, here, Look(_rgba(WALL), (wide, 0.0, 0.0)), line))
        return markers

    def paths(self, tick: int) -> list[Any]:
        """Return the way of each robot until now."""
        head, here = header(0, MAP), pose(0.0, 0.0)
        step = 2 ** max(0, math.ceil(math.log2((tick + 1) / PATH_POINTS)))
        ticks = np.unique(np.append(np.arange(0, tick + 1, step), tick))
        markers = []
        for i, robot in enumerate(self._run.world.robots):
            x, y = self._run.trajectory.x_m[ticks, i], self._run.trajectory.y_m[ticks, i]
            line = np.column_stack([x, y, np.zeros(len(ticks))]).tolist()
            look = Look(self._colours[i], (0.2 * robot.radius, 0.0, 0.0))
            markers.append(marker(LINE_STRIP, Name("paths", i), head, here, look, line))
        return markers

    def packets(self, tick: int) -> list[Any]:
        """Return an arrow for each packet of features that was delivered in this tick."""
        trajectory, markers = self._run.trajectory, []
        first, last = np.searchsorted(self._links[:, 0], [tick, tick + 1])
        head = header(nanoseconds(float(trajectory.t_s[tick])), MAP)
        for n, (_, sender, receiver, _) in enumerate(self._links[first:last].tolist(), start=int(first)):
            ends = [(trajectory.x_m[tick, i], trajectory.y_m[tick, i], TALL_M) for i in (sender, receiver)]
            look = Look(self._colours[sender], (0.03, 0.09, 0.12), LINK_S)
            markers.append(marker(ARROW, Name("packets", n), head, pose(0.0, 0.0), look, ends))
        return markers


def base_link(robot: int) -> str:
    """Return the frame of a robot's body (REP-105), in the middle of which its LiDAR sits."""
    return f"robot_{robot}/base_link"


def _rgba(colour: str, opacity: float = 1.0) -> tuple[float, float, float, float]:
    r, g, b = (int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    return r, g, b, opacity


def _block(corners: Sequence[tuple[float, float]]) -> list[tuple[float, float, float]]:
    """Return the triangles of a convex polygon that stands up: its top and its sides."""
    (x0, y0), triangles = corners[0], []
    for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True):
        triangles += [(x0, y0, TALL_M), (ax, ay, TALL_M), (bx, by, TALL_M)]
        triangles += [(ax, ay, 0.0), (bx, by, 0.0), (bx, by, TALL_M)]
        triangles += [(ax, ay, 0.0), (bx, by, TALL_M), (ax, ay, TALL_M)]
    return triangles

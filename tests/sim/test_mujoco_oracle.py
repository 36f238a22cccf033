"""Ranges and contact against an independent implementation: MuJoCo's ray caster and geometry distances."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarmscope.sim.beams import make_beams
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.lidar import cast_static
from swarmscope.sim.world import WALL_M, Circle, Polygon, Wall, WorldSpec, compile_world

mujoco = pytest.importorskip(
    "mujoco", reason="MuJoCo is not installed: no independent check of lidar and contact"
)

SIDE_M, RANGE_M, BEAMS = 10.0, 5.0, 360
ROBOT_RADIUS_M = 0.15
SEEDS = range(24)


class Both:
    """One random world of cylinders, turned boxes and walls, for the simulator and for MuJoCo."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.obstacles: list[Circle | Polygon | Wall] = []
        self.geoms: list[str] = []
        for _ in range(25):
            self._add_cylinder()
        for _ in range(10):
            self._add_box()
        for _ in range(4):
            self._add_wall()
        self.world = compile_world(WorldSpec(obstacles=self.obstacles, bounds=(0, 0, SIDE_M, SIDE_M)))
        self.model = mujoco.MjModel.from_xml_string(
            f"""<mujoco><option ccd_iterations="200" ccd_tolerance="1e-9"/><worldbody>{"".join(self.geoms)}
            <body mocap="true" name="robot"><geom type="cylinder" size="{ROBOT_RADIUS_M} 0.2"/></body>
            </worldbody></mujoco>"""
        )
        self.data = mujoco.MjData(self.model)

    def _add_cylinder(self) -> None:
        (x, y), radius = self.rng.uniform(0, SIDE_M, 2), self.rng.uniform(0.1, 0.6)
        self.obstacles.append(Circle(center=(x, y), radius=radius))
        self.geoms.append(f'<geom type="cylinder" pos="{x:.17g} {y:.17g} 0" size="{radius:.17g} 1"/>')

    def _add_box(self) -> None:
        centre, half, yaw = (
            self.rng.uniform(0, SIDE_M, 2),
            self.rng.uniform(0.1, 0.8, 2),
            self.rng.uniform(-3, 3),
        )
        along, aside = half[0] * _unit(yaw), half[1] * _unit(yaw + math.pi / 2)
        corners = [
            centre + along + aside,
            centre - along + aside,
            centre - along - aside,
            centre + along - aside,
        ]
        self.obstacles.append(Polygon(points=corners))
        self._box(centre, half, yaw)

    def _add_wall(self) -> None:
        a, b = self.rng.uniform(0, SIDE_M, (2, 2))
        self.obstacles.append(Wall(points=[a, b]))
        yaw = math.atan2(b[1] - a[1], b[0] - a[0])
        half = 0.5 * WALL_M
        self._box(0.5 * (a + b), (0.5 * math.dist(a, b), half), yaw)
        for x, y in (a, b):
            self.geoms.append(f'<geom type="cylinder" pos="{x:.17g} {y:.17g} 0" size="{half:.17g} 1"/>')

    def _box(self, centre, half, yaw) -> None:
        turn = f"{math.cos(yaw / 2)!r} 0 0 {math.sin(yaw / 2)!r}"
        x, y, u, v = (float(value) for value in (*centre, *half))
        self.geoms.append(f'<geom type="box" pos="{x!r} {y!r} 0" size="{u!r} {v!r} 1" quat="{turn}"/>')

    def in_a_wall(self, x: float, y: float) -> bool:
        walls = [obstacle for obstacle in self.obstacles if isinstance(obstacle, Wall)]
        world = compile_world(WorldSpec(obstacles=walls, bounds=(0, 0, SIDE_M, SIDE_M)))
        return static_clearance(world, x, y, x, y, 1.0) == 0.0

    def put_robot(self, x: float, y: float) -> None:
        self.data.mocap_pos[0] = (x, y, 0.0)
        mujoco.mj_kinematics(self.model, self.data)

    def ranges(self, angles: np.ndarray) -> np.ndarray:
        rays = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
        found, which = np.zeros(len(angles)), np.zeros(len(angles), dtype=np.int32)
        point, robot = self.data.mocap_pos[0].reshape(3, 1), self.model.body("robot").id
        mujoco.mj_multiRay(
            self.model,
            self.data,
            point,
            rays.reshape(-1, 1),
            None,
            True,
            robot,
            which,
            found,
            None,
            len(angles),
            50.0,
        )
        return np.where((found < 0) | (found > RANGE_M), np.inf, found)

    def gap(self) -> float:
        """Return the smallest signed distance between the robot's cylinder and any geom [m], at most 2."""
        robot = self.model.ngeom - 1
        return min(
            mujoco.mj_geomDistance(self.model, self.data, geom, robot, 2.0, None) for geom in range(robot)
        )


def _unit(angle: float) -> np.ndarray:
    return np.array([math.cos(angle), math.sin(angle)])


def test_all_ranges_agree_with_mujoco():
    beams, out = make_beams(BEAMS, 2 * math.pi, RANGE_M), np.empty(BEAMS, dtype=np.float32)
    differing = total = 0
    for seed in SEEDS:
        both = Both(seed)
        for _ in range(10):
            x, y, yaw = *both.rng.uniform(0, SIDE_M, 2), both.rng.uniform(-math.pi, math.pi)
            if both.in_a_wall(x, y):
                continue  # where no robot can be
            both.put_robot(x, y)
            expected = both.ranges(yaw + beams.angle_min + beams.increment * np.arange(BEAMS))
            cast_static(both.world, x, y, yaw, beams, out)
            differing += np.count_nonzero(~np.isclose(out, expected, rtol=0, atol=1e-5))
            total += BEAMS
    print(f"{differing} of {total} ranges differ by more than 1e-5 m")
    assert differing <= 0.0002 * total  # rays that graze a surface


@pytest.mark.parametrize("seed", SEEDS)
def test_contact_agrees_with_mujoco(seed):
    both = Both(seed)
    touching = 0
    for _ in range(60):
        x, y = both.rng.uniform(0, SIDE_M, 2)
        both.put_robot(x, y)
        gap = both.gap()
        clearance = static_clearance(both.world, x, y, x, y, 1.0) - ROBOT_RADIUS_M
        if abs(gap) > 1e-4:
            assert (clearance < 0) == (gap < 0), f"clearance {clearance}, MuJoCo {gap} at {x}, {y}"
        if gap > 1e-4:
            assert clearance == pytest.approx(min(gap, 1.0 - ROBOT_RADIUS_M), abs=1e-4)
        touching += gap < 0
    assert 0 < touching < 60


def test_a_drive_touches_where_some_pose_of_it_touches():
    disagree = 0
    for seed in SEEDS:
        both = Both(seed)
        for _ in range(5):
            a = both.rng.uniform(0, SIDE_M, 2)
            b = a + both.rng.uniform(-0.5, 0.5, 2)
            gaps = []
            for share in np.linspace(0, 1, 25):
                both.put_robot(*(a + share * (b - a)))
                gaps.append(both.gap())
            clearance = static_clearance(both.world, *a, *b, 1.0) - ROBOT_RADIUS_M
            if abs(min(gaps)) > 0.03:  # between two poses the robot moves up to 0.03 m
                disagree += (clearance < 0) != (min(gaps) < 0)
    assert disagree == 0

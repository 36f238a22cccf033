"""Time one 360-beam scan and one clearance query, and compare the scan with a plain loop over all obstacles.

python benchmarks/bench_lidar.py
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numba
import numpy as np

from swarmscope.geometry import ray_circle
from swarmscope.sim.beams import Beams, make_beams
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.lidar import cast_static
from swarmscope.sim.maps import load_map, packaged_map
from swarmscope.sim.world import Circle, World, WorldSpec, compile_world

SIDE_M, CIRCLES, BEAMS, RANGE_M = 20.0, 140, 360, 5.0


def forest(seed: int = 0) -> World:
    """Return the world of the benchmark: 140 circles of radius 0.15 .. 0.35 m in 20 x 20 m."""
    rng = np.random.default_rng(seed)
    circles = [
        Circle(center=tuple(rng.uniform(0, SIDE_M, 2)), radius=rng.uniform(0.15, 0.35))
        for _ in range(CIRCLES)
    ]
    return compile_world(WorldSpec(obstacles=circles, bounds=(0, 0, SIDE_M, SIDE_M)))


@numba.njit
def scan_all(world: World, poses: np.ndarray, beams: Beams, out: np.ndarray) -> float:
    """Scan from every pose."""
    total = 0.0
    for i in range(poses.shape[0]):
        cast_static(world, poses[i, 0], poses[i, 1], poses[i, 2], beams, out)
        total += out[i % out.shape[0]]
    return total


@numba.njit(error_model="numpy")
def scan_all_plain(world: World, poses: np.ndarray, beams: Beams, out: np.ndarray) -> float:
    """Scan from every pose, asking every beam about every circle."""
    total = 0.0
    for i in range(poses.shape[0]):
        for n in range(out.shape[0]):
            angle = poses[i, 2] + beams.angle_min + n * beams.increment
            dx, dy = math.cos(angle), math.sin(angle)
            nearest = math.inf
            for k in range(world.circles.shape[0]):
                cx, cy = world.circles[k, 0] - poses[i, 0], world.circles[k, 1] - poses[i, 1]
                nearest = min(nearest, ray_circle(dx, dy, cx, cy, world.circles[k, 2]))
            out[n] = nearest if nearest <= beams.range_max else math.inf
        total += out[i % out.shape[0]]
    return total


@numba.njit
def clearance_all(world: World, poses: np.ndarray, limit: float) -> float:
    """Ask for the clearance of a short step from every pose."""
    total = 0.0
    for i in range(poses.shape[0]):
        x, y = poses[i, 0], poses[i, 1]
        total += static_clearance(world, x, y, x + 0.02, y + 0.01, limit)
    return total


def best_us(call: Callable[[], object], count: int, repeats: int = 7) -> float:
    """Return the best time per item [us] of several repeats."""
    call()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return 1e6 * min(times) / count


def random_poses(low: tuple[float, float], high: tuple[float, float], count: int) -> np.ndarray:
    """Return poses (count, 3) x y yaw spread over a rectangle."""
    rng = np.random.default_rng(1)
    return np.column_stack([rng.uniform(low, high, (count, 2)), rng.uniform(-math.pi, math.pi, count)])


def main() -> None:
    """Print the timings."""
    world, beams, out = forest(), make_beams(BEAMS, 2 * math.pi, RANGE_M), np.empty(BEAMS, dtype=np.float32)
    poses = random_poses((0, 0), (SIDE_M, SIDE_M), 4000)
    few = poses[:200]
    fast = best_us(lambda: scan_all(world, poses, beams, out), len(poses))
    plain = best_us(lambda: scan_all_plain(world, few, beams, out), len(few), repeats=3)
    print(f"forest, {CIRCLES} circles in {SIDE_M:g} x {SIDE_M:g} m, {BEAMS} beams, {RANGE_M:g} m")
    print(f"  scan            {fast:8.2f} us; plain loop over all {plain:.1f} us ({plain / fast:.0f} x)")
    print(f"  clearance 0.3 m {best_us(lambda: clearance_all(world, poses, 0.3), len(poses)):8.3f} us")
    grid = load_map(packaged_map("willow_garage_office"))
    office = compile_world(WorldSpec(obstacles=[grid], bounds=(0, 0, 58.4, 52.6)))
    poses = random_poses((0, 0), (58.4, 52.6), 20000)
    free = office.solid[(poses[:, 1] / 0.1).astype(int), (poses[:, 0] / 0.1).astype(int)] == 0
    poses = np.ascontiguousarray(poses[free])
    print(f"office map, {grid.width} x {grid.height} cells, {len(poses)} poses in free cells")
    print(f"  scan            {best_us(lambda: scan_all(office, poses, beams, out), len(poses)):8.2f} us")
    print(f"  clearance 0.3 m {best_us(lambda: clearance_all(office, poses, 0.3), len(poses)):8.3f} us")


if __name__ == "__main__":
    main()

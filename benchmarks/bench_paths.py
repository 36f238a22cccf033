"""Time the reference paths of 15 robots in 20 forests, and say how the three kinds of length compare.

Run: python benchmarks/bench_paths.py
"""

from __future__ import annotations

import time

import numpy as np

from swarmscope.judging.shortest_path import any_angle_paths, grid_paths, lengths_m, pulled_path
from swarmscope.sim.world import compile_world
from swarmscope.tasks import load_task

MAPS = 20
RADIUS_M = 0.15


def main() -> None:
    """Print one line per task: the median time of a map in ms, and the ratios of the lengths in percent."""
    for task in ("T1", "T2", "T3"):
        rows = [measure(task, seed) for seed in range(-1, MAPS)][1:]  # the first one compiles
        make, grid, exact = np.median([row[:3] for row in rows], axis=0) * 1e3
        above = np.concatenate([row[3] for row in rows])
        pulled = np.concatenate([row[4] for row in rows])
        print(
            f"{task}: make {make:.1f} ms, A* {grid:.0f} ms, any-angle {exact:.0f} ms (15 robots); "
            f"A* above exact: mean {above.mean():.2%}, at most {above.max():.2%}; "
            f"pulled A* above exact: mean {pulled.mean():.2%}, at most {pulled.max():.2%}"
        )


def measure(task: str, seed: int) -> tuple[float, float, float, np.ndarray, np.ndarray]:
    """Return seconds to make, for A* and for any-angle ways, and how far A* and pulled A* are above exact."""
    begin = time.perf_counter()
    setup = load_task(task).make(max(0, seed))
    made = time.perf_counter()
    grid = grid_paths(setup.world, setup.starts, setup.goals, RADIUS_M)
    searched = time.perf_counter()
    exact = lengths_m(any_angle_paths(setup.world, setup.starts, setup.goals, RADIUS_M))
    done = time.perf_counter()
    world = compile_world(setup.world)
    pulled = lengths_m([pulled_path(world, way, RADIUS_M) for way in grid])
    return made - begin, searched - made, done - searched, lengths_m(grid) / exact - 1.0, pulled / exact - 1.0


if __name__ == "__main__":
    main()

"""One tick of one robot, called from Python as on a real one, against the compiled step that is inside it.

Also what a robot needs to start, in a process of its own with the kernels on disk: time and memory. All times are CPU
times, so that another load on the machine does not count.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from swarmscope.onboard.body import Body
from swarmscope.onboard.lidar import Lidar
from swarmscope.onboard.planners import planner_names
from swarmscope.onboard.robot import Robot, Seen

TICKS = 50
REPEATS = 60
START = """
import resource, sys, time
begun = time.process_time()
from swarmscope.onboard.body import Body
from swarmscope.onboard.lidar import Lidar
from swarmscope.onboard.robot import Robot
robot = Robot(sys.argv[1], Body(), Lidar(), address=7)
ready = time.process_time()
done = robot.warm_up()
now = time.process_time()
robot.tick(scan=[1.0] * 360, now_s=0.0, goal=(0.0, 1.0), heading=0.0, speed=0.0, moved=(0.0, 0.0, 0.0))
first = time.process_time()
print(ready - begun, now - ready, first - now, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)
"""


def scene() -> np.ndarray:
    """Return a scan (360,) with something ahead and on the left."""
    angles = -np.pi + np.pi / 180.0 * np.arange(360)
    return np.where((angles > -0.2) & (angles < 1.5), 1.0 + 0.1 * np.sin(9.0 * angles), np.inf).astype(np.float32)


def tick_us(robot: Robot, scan_at: Callable[[int], Any], **more: Any) -> float:
    """Return the CPU time of a tick [us], best of the repeats."""
    robot.warm_up()
    best, k = np.inf, 0
    for _ in range(REPEATS):
        start = time.process_time_ns()
        for _ in range(TICKS):
            k += 1
            command = robot.tick(
                scan=scan_at(k), now_s=0.2 * k, goal=(0.1, 8.0), heading=0.3, speed=0.2, moved=(0.04, 0.0, 0.01), **more
            )
        best = min(best, (time.process_time_ns() - start) / 1e3 / TICKS)
        if not command.ok:
            raise SystemExit(command.reason)
    return best


def step_us(robot: Robot) -> float:
    """Return the CPU time of the compiled step with the rows as they are [us], best of the repeats."""
    best = np.inf
    for _ in range(REPEATS):
        start = time.process_time_ns()
        for _ in range(TICKS):
            robot.rows.step()
        best = min(best, (time.process_time_ns() - start) / 1e3 / TICKS)
    return best


def start_of(planner: str) -> list[float]:
    """Return CPU seconds of import and construction, of warming up and of the first tick, and MB of memory."""
    run = [sys.executable, "-c", START, planner]
    subprocess.run(run, check=True, stdout=subprocess.DEVNULL)
    return [float(v) for v in subprocess.run(run, check=True, capture_output=True, text=True).stdout.split()]


def new_robot(lidar: Lidar) -> Robot:
    """Return a robot with Nav-SCOPE."""
    return Robot("nav-scope", Body(), lidar, address=7)


def main() -> None:
    """Print the figures."""
    scan, usual = scene(), Lidar()
    as_list = scan.tolist()
    crowd = {"neighbours": [Seen(k, 1.0 + 0.3 * k, -2.0) for k in range(10)], "inbox": [bytes(42)] * 8}
    robot = new_robot(usual)
    print("one tick of Nav-SCOPE from Python, scan to command")
    print(f"  a scan (float32 array)                       {tick_us(robot, lambda k: scan):8.1f} us")
    print(f"    of which the compiled step, called once    {step_us(robot):8.1f} us")
    print(f"  a scan (list)                                {tick_us(new_robot(usual), lambda k: as_list):8.1f} us")
    crowded = tick_us(new_robot(usual), lambda k: scan, **crowd)
    print(f"  10 neighbours and 8 packets                  {crowded:8.1f} us")
    every_other = tick_us(new_robot(usual), lambda k: scan if k % 2 else None)
    print(f"  every other scan missing, moved on           {every_other:8.1f} us")
    off_centre = tick_us(new_robot(Lidar(mount=(0.1, 0.0, 0.0))), lambda k: scan)
    print(f"  sensor off the centre                        {off_centre:8.1f} us")
    print("start, kernels on disk: import and construction, warm_up(), first tick; memory of the process")
    for name in planner_names():
        if name in ("nav-scope", "dh-bug", "orca", "giwt"):
            made, warm, first, size = start_of(name)
            print(f"  {name:10s} {made:6.2f} s {warm:6.2f} s {1e3 * first:6.2f} ms {size:6.0f} MB")


if __name__ == "__main__":
    main()

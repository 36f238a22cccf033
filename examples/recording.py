"""One robot in the place of the one that recorded scans: what it would have done in every tick, and why.

python examples/recording.py [SCANS.npz | SCANS.csv]   (without a file: the packaged ones of a SICK LMS on a wheelchair)
"""

from __future__ import annotations

import math
import sys
from collections import Counter

import numpy as np

from swarmscope import Body, Lidar, Robot
from swarmscope.sim.scan_files import load_scans, scan_file

log = load_scans(scan_file(sys.argv[1] if len(sys.argv) > 1 else "malaga_telecom_2006_sick_lms"))
scans, beams = log.ranges_m.shape
poses = np.zeros((scans, 3)) if log.odom is None else log.odom
stamps = log.stamp_s if np.isfinite(log.stamp_s).all() else 0.25 * np.arange(scans)
end = poses[-1] if log.odom is not None else np.array([10.0, 0.0, 0.0])  # the goal: where the recording ends
step_deg, first_deg = math.degrees(abs(log.increment)), math.degrees(log.angle_min)
field_deg = 360.0 if step_deg * (beams + 0.5) > 360.0 else step_deg * (beams - 1)
lidar = Lidar(beams, min(5.0, log.range_max), log.range_min, field_deg, first_deg, clockwise=log.increment < 0.0)

robot = Robot("nav-scope", Body(radius_m=0.25, half_width_m=0.25, v_max_mps=1.5), lidar, address=7, rate_hz=4.0)
robot.warm_up(print)
said: Counter[str] = Counter()
before, before_s = poses[0], stamps[0] - 0.25
for scan, pose, now_s in zip(log.ranges_m, poses, stamps, strict=True):
    ahead, across, turn = pose - before
    c, s = math.cos(before[2]), math.sin(before[2])
    moved = (c * ahead + s * across, c * across - s * ahead, turn)
    left = end - pose
    goal = (math.atan2(left[1], left[0]) - pose[2], math.hypot(left[0], left[1]))
    speed = moved[0] / (now_s - before_s)
    command = robot.tick(scan=scan, scan_s=now_s, now_s=now_s, goal=goal, heading=pose[2], speed=speed, moved=moved)
    said[f"{command.state}: {command.reason}"] += 1
    before, before_s = pose, now_s
for words, ticks in said.most_common():
    print(f"{ticks:5d} ticks  {words}")

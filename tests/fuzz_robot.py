"""Throw random inputs at `Robot.tick` for every planner: nothing may raise, no command may leave its limits.

Kernels that read or write beside their arrays are found with NUMBA_BOUNDSCHECK=1; give such kernels a cache of their
own: NUMBA_BOUNDSCHECK=1 SWARMSCOPE_CACHE=/tmp/checked python tests/fuzz_robot.py --ticks 1000000 --seed 1
"""

from __future__ import annotations

import argparse
import math
import time
from typing import Any

import numpy as np

from swarmscope.errors import MissingExtraError
from swarmscope.onboard.body import Body
from swarmscope.onboard.lidar import Lidar
from swarmscope.onboard.planners import planner_names
from swarmscope.onboard.robot import Robot, Seen
from swarmscope.onboard.sharing.message import (
    MAX_PACKET_BYTES,
    Head,
    encode_directed_request,
    encode_exact_features,
    encode_features,
    encode_latent,
    encode_request,
)

BATCH = 512
"""Ticks whose inputs are drawn at once."""
ROBOTS = (
    (Body(), Lidar()),
    (Body(), Lidar(720, 12.0, range_min_m=0.1, first_deg=0.0, clockwise=True, mount=(0.1, -0.05, 0.3))),
    (Body(radius_m=0.3, half_width_m=0.2, v_max_mps=1.5), Lidar(181, 8.0, fov_deg=180.0, position_sigma=0.02)),
    (Body(radius_m=0.05, half_width_m=0.05), Lidar(32, 3.0)),
    (Body(), Lidar(1081, 30.0, fov_deg=270.0, mount=(0.0, 0.0, 0.8), range_sigma=0.02)),
    (Body(), Lidar(400, 5.0, 0.1, first_deg=9.0, upside_down=True, no_return_m=(0.0,), mount=(0.1, 0.0, 1.0),
                   masks_deg=((40.0, 50.0), (170.0, -150.0)), time_increment_s=0.0005)),
)  # fmt: skip
HOSTILE: tuple[Any, ...] = (
    math.nan, math.inf, -math.inf, 1e300, -1e300, 1e-320, 3e38, -0.0, 0, 10**30, 10**400, None, "x", b"", (), [], {},
    True, np.float32("nan"), np.int8(-3), np.array(1.0), np.array([1.0, 2.0]), 1j, object(), (math.nan, 1.0),
    (0.0, math.inf), (1.0, 2.0, 3.0), (math.nan,) * 3, [1e300] * 3, range(10**7), np.zeros(360), [math.nan] * 360,
)  # fmt: skip


class Inputs:
    """Draws inputs in batches: mostly sane, some of them hostile, few all hostile."""

    def __init__(self, seed: int, lidar: Lidar, body: Body) -> None:
        self.rng, self.lidar, self.body, self.left = np.random.default_rng(seed), lidar, body, 0
        self.now, self.batches = 0.0, 0

    def draw(self) -> None:
        """Draw the next batch."""
        rng, m, self.left = self.rng, self.lidar.beams, BATCH
        reach = self.lidar.range_m
        smooth = np.cumsum(rng.normal(0.0, 0.1, (64, m)), axis=1) + rng.uniform(0.2, reach, (64, 1))
        scans = np.concatenate([np.abs(smooth), rng.uniform(0.0, 1.3 * reach, (32, m)), np.full((32, m), np.inf)])
        odd = rng.random(scans.shape) < rng.choice([0.0, 0.0, 0.01, 0.3, 1.0], (128, 1))
        values = np.array([np.nan, np.inf, -np.inf, -1.0, 0.0, 1e300, 1e-30, reach, 0.05])
        scans[odd] = rng.choice(values, int(odd.sum()))
        with np.errstate(over="ignore"):
            self.scans = [scan.astype(np.float32) if k % 2 else scan for k, scan in enumerate(scans)]
        self.unit = rng.random((BATCH, 16)).tolist()
        self.pick = rng.integers(0, 2**31, (BATCH, 16)).tolist()
        if self.batches % 8 == 0:
            self.seen = [self._neighbours() for _ in range(64)]
            self.mail = [self._packets() for _ in range(64)]
        self.batches += 1

    def _neighbours(self) -> list[Seen]:
        rng = self.rng
        spread = rng.choice([0.3, 1.0, 3.0, 900.0])
        rows = rng.uniform(-spread, spread, (rng.choice([0, 1, 2, 4, 12, 40]), 3)).tolist()
        few = int(rng.choice([3, 8, 65536]))
        size = rng.choice([0.0, 0.1, 2.0])
        return [Seen(int(rng.integers(few)), x, y, yaw, radius_m=size or None) for x, y, yaw in rows]

    def _packets(self) -> list[bytes]:
        rng, out, packets = self.rng, np.zeros(MAX_PACKET_BYTES, np.uint8), []
        for _ in range(rng.choice([0, 1, 3, 9, 60])):
            head = tuple(int(v) for v in rng.integers(0, [8, 3, 40, 12]))
            angles, distances = rng.uniform(-9.0, 9.0, 16), rng.uniform(-1.0, 40.0, 16)
            n = int(rng.integers(0, 17))
            kind = int(rng.integers(0, 7))
            if kind < 5:
                length = _write(kind, head, angles, distances[:n], self.lidar.range_m, out)
                packets.append(out[:length].tobytes())
            else:
                packets.append(rng.bytes(int(rng.integers(0, 150))))
        return packets

    def next(self) -> dict[str, Any]:
        """Return the arguments of the next tick."""
        if self.left == 0:
            self.draw()
        self.left -= 1
        u, p = self.unit[self.left], self.pick[self.left]
        dt = (0.2, 0.2, 0.2, 0.21, 0.05, 0.9, 1e-6, 0.0, -3.0, 1e5)[p[0] % 10] if u[0] < 0.3 else 0.2
        self.now += dt
        speed = u[1] * self.body.v_max_mps
        values = {
            "scan": self.scans[p[1] % 128] if u[2] < 0.8 else None,
            "now_s": self.now,
            "goal": (7.0 * u[3] - 3.5, 12.0 * u[4] * u[5]),
            "heading": 8.0 * u[6] - 4.0,
            "speed": speed,
            "moved": (0.2 * speed, 0.02 * u[7] - 0.01, u[8] - 0.5),
            "neighbours": self.seen[p[2] % 64],
            "inbox": self.mail[p[3] % 64],
        }
        if u[9] < 0.3:
            values["scan_s"] = self.now - 0.8 * u[10]
        if u[11] < 0.15:
            names = list(values)
            for k in range(1 + p[4] % (8 if u[12] < 0.1 else 1)):
                values[names[p[5 + k] % len(names)]] = HOSTILE[p[5 + k] // 16 % len(HOSTILE)]
        return values


def _write(kind: int, head: tuple[int, int, int, int], angles: Any, distances: Any, reach: float, out: Any) -> int:
    """Write a packet of ``kind``; return its length."""
    answer = Head(*head)
    n = len(distances)
    if kind == 0:
        return int(encode_request(answer, out))
    if kind == 1:
        return int(encode_directed_request(answer, float(angles[0]), out))
    if kind == 2:
        return int(encode_features(answer, angles, distances, n, reach, out))
    if kind == 3:
        return int(encode_exact_features(answer, angles, distances, n, out))
    codes = np.floor(np.abs(np.tile(angles, 8)) * 28.0).astype(np.uint8)
    return int(encode_latent(answer, codes, 160, out))


def check(command: Any, robot: Robot, values: dict[str, Any]) -> None:
    """Fail unless a command is what a base can be given."""
    body = robot.body
    good = math.isfinite(command.v) and math.isfinite(command.w)
    good = good and 0.0 <= command.v <= body.v_max_mps and abs(command.w) <= body.w_max_radps
    if not good or (not command.ok and (command.v, command.w) != (0.0, 0.0)):
        raise SystemExit(f"{command} after {values}")
    if robot.faults["error"] or robot.faults["planner"]:
        raise SystemExit(f"{command.reason} after {values}")


def fuzz(name: str, ticks: int, seed: int) -> tuple[int, float]:
    """Run ``ticks`` ticks of a planner on every kind of robot; return how many drove, and ticks per second."""
    drove, begun, done = 0, time.perf_counter(), 0
    for k, (body, lidar) in enumerate(ROBOTS):
        robot, inputs = Robot(name, body, lidar, address=k, boot=0), Inputs(seed + 1000 * k, lidar, body)
        robot.warm_up()
        begun += time.perf_counter() - begun if k == 0 else 0.0
        for _ in range(math.ceil(ticks / len(ROBOTS))):
            values = inputs.next()
            command = robot.tick(**values)
            check(command, robot, values)
            drove += command.ok
            done += 1
    return drove, done / (time.perf_counter() - begun)


def main() -> None:
    """Run what the command line says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ticks", type=int, default=20_000, help="ticks of each planner")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--planners", nargs="*", default=[name for name in planner_names() if name != "oracle"])
    options = parser.parse_args()
    for name in options.planners:
        try:
            drove, rate = fuzz(name, options.ticks, options.seed)
        except MissingExtraError as error:
            print(f"{name:10s} skipped: {error}")
            continue
        print(f"{name:10s} {options.ticks} ticks, {drove} drove, all within limits; {rate:.0f} a second", flush=True)


if __name__ == "__main__":
    main()

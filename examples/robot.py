"""Two robots in one process, as they would run on two: each knows its own sensors and what the radio brings.

The world, the wheels and the radio are made up in this file; replace them by yours. Run it: python examples/robot.py
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope.onboard.body import Body
from swarmscope.onboard.lidar import Lidar
from swarmscope.onboard.percept import EVERYBODY
from swarmscope.onboard.robot import Command, Robot, Seen
from swarmscope.sim.beams import make_beams
from swarmscope.sim.lidar import cast_disc, cast_static
from swarmscope.sim.world import Circle, WorldSpec, compile_world

DT = 0.2
BODY, LIDAR = Body(radius_m=0.15), Lidar(beams=360, range_m=5.0)
BEAMS = make_beams(360, 2.0 * math.pi, 5.0)
OBSTACLES = [Circle(center=(2.5, 0.1), radius=0.6), Circle(center=(4.5, -0.7), radius=0.3)]
WORLD = compile_world(WorldSpec(obstacles=OBSTACLES, bounds=(-2.0, -4.0, 9.0, 4.0)))


class Base:
    """A base with wheels: where it is [m, rad], how fast it drives, and how it has moved since it was last asked."""

    def __init__(self, x: float, y: float, goal: tuple[float, float]) -> None:
        self.x, self.y, self.yaw, self.v, self.goal = x, y, 0.0, 0.0, goal
        self.moved = (0.0, 0.0, 0.0)

    def drive(self, command: Command) -> None:
        """Drive for one tick."""
        x, y, yaw = self.x, self.y, self.yaw
        for _ in range(20):
            change = BODY.a_max_mps2 * DT / 20
            self.v += max(-change, min(change, command.v - self.v))
            self.yaw += command.w * DT / 20
            self.x += self.v * DT / 20 * math.cos(self.yaw)
            self.y += self.v * DT / 20 * math.sin(self.yaw)
        dx, dy, c, s = self.x - x, self.y - y, math.cos(yaw), math.sin(yaw)
        self.moved = (c * dx + s * dy, c * dy - s * dx, self.yaw - yaw)

    def sees(self, other: Base) -> tuple[float, float]:
        """Return where another robot is, in this one's body frame [m]."""
        dx, dy, c, s = other.x - self.x, other.y - self.y, math.cos(self.yaw), math.sin(self.yaw)
        return c * dx + s * dy, c * dy - s * dx

    def scan(self, other: Base) -> np.ndarray:
        """Return what the LiDAR measures (360,) [m]."""
        ranges = np.full(360, np.inf, np.float32)
        cast_static(WORLD, self.x, self.y, self.yaw, BEAMS, ranges)
        cast_disc(*self.sees(other), BODY.radius_m, BEAMS, ranges)
        return ranges


def main() -> None:
    """Let both cross, and print whatever changes."""
    bases = {3: Base(0.0, 0.0, (7.0, 0.0)), 7: Base(0.6, 1.3, (7.0, -1.0))}
    robots = {address: Robot("nav-scope", BODY, LIDAR, address=address) for address in bases}
    for robot in robots.values():
        robot.warm_up(print)
    air: dict[int, list[bytes]] = {address: [] for address in bases}
    said = dict.fromkeys(bases, "")
    nearest = math.inf
    for tick in range(400):
        inbox, air = air, {address: [] for address in bases}
        commands = {}
        for address, base in bases.items():
            peer = next(a for a in bases if a != address)
            x, y = base.sees(bases[peer])
            gx, gy = base.goal[0] - base.x, base.goal[1] - base.y
            scan = base.scan(bases[peer])
            nearest = min(nearest, float(scan.min()))
            commands[address] = command = robots[address].tick(
                scan=scan if tick % 4 < 3 else None,  # every fourth scan is missing
                now_s=tick * DT,
                goal=(math.atan2(gy, gx) - base.yaw, math.hypot(gx, gy)),
                heading=base.yaw,
                speed=base.v,
                moved=base.moved,
                neighbours=[Seen(peer, x, y, bases[peer].yaw - base.yaw)],
                inbox=inbox[address],
            )
            for to, packet in command.outbox:
                print(f"{tick * DT:5.1f} s  {address} -> {to}: {len(packet)} bytes")
                for peer in bases if to == EVERYBODY else [to]:
                    if peer != address:
                        air[peer].append(packet)
            if command.reason != said[address]:
                print(f"{tick * DT:5.1f} s  {address} at ({base.x:.2f}, {base.y:.2f}): {command.reason}")
                said[address] = command.reason
        for address, base in bases.items():
            base.drive(commands[address])
        if all(command.state == "arrived" for command in commands.values()):
            break
    faults = {address: dict(robot.faults) for address, robot in robots.items()}
    print(f"both arrived after {tick * DT:.1f} s; nearest return {nearest:.2f} m; faults: {faults}")


if __name__ == "__main__":
    main()

"""Small things that many tests need: sensors, rigs, robots' rows, worlds, mirrors, runs."""

from __future__ import annotations

import math

import numpy as np

from swarmscope.onboard.body import Body
from swarmscope.onboard.percept import DECISION, PERCEPT, new_shared
from swarmscope.onboard.rig import make_rig
from swarmscope.onboard.sensor import Sensor
from swarmscope.sim.lidar import cast_static, make_beams
from swarmscope.sim.state import Clock, Noise, Radio, new_sim
from swarmscope.sim.world import Circle, WorldSpec, compile_world

DT = 0.2
BOUNDS = (-10.0, -10.0, 10.0, 10.0)


def make_sensor(beams=360, fov=2.0 * math.pi, range_max=5.0, range_min=0.0, **errors):
    """A sensor as robots know it, from the same beams that the world casts."""
    b = make_beams(beams, fov, range_max)
    values = {"range_sigma": 0.0, "position_sigma": 0.0} | errors
    return Sensor(beams, b.angle_min, b.increment, b.wraps, range_min, range_max, **values)


def rig_of(body=None, sensor=None, **options):
    return make_rig(body or Body(), sensor or make_sensor(), **options)


def beams_of(rig):
    sensor = rig.sensor
    fov = sensor.increment * (sensor.beams if sensor.wraps else sensor.beams - 1)
    return make_beams(sensor.beams, fov, sensor.range_max)


def world_of(*obstacles, bounds=BOUNDS):
    return compile_world(WorldSpec(obstacles=list(obstacles), bounds=bounds))


def circles_world(rows):
    return world_of(*(Circle(center=(float(x), float(y)), radius=float(r)) for x, y, r in rows))


def scan_at(world, rig, x=0.0, y=0.0, yaw=0.0):
    out = np.full(rig.sensor.beams, np.inf, np.float32)
    cast_static(world, float(x), float(y), float(yaw), beams_of(rig), out)
    return out


def mirrored(ranges):
    """The scan of the world reflected in the robot's x axis (full circle from -pi)."""
    return np.roll(ranges[::-1], 1).copy()


class Rows:
    """The rows of some robots outside any simulation: what a test fills in and kernels work on."""

    def __init__(self, rig, robots=1):
        self.rig = rig
        self.percepts = np.zeros(robots, PERCEPT)
        self.percepts["dt_s"] = DT
        self.percepts["id"] = np.arange(robots)
        self.decisions = np.zeros(robots, DECISION)
        self.decisions["p_self"] = self.decisions["p_left"] = np.nan
        self.shared = new_shared(robots)
        self.scratch = new_scratch(robots, rig)
        self.ranges = np.full((robots, rig.sensor.beams), np.inf, np.float32)

    @property
    def percept(self):
        return self.percepts[0]

    @property
    def decision(self):
        return self.decisions[0]

    @property
    def memory(self):
        return self.shared[0]

    def see(self, *neighbours):
        """Let robot 0 see neighbours (id, x, y, yaw), body frame."""
        self.percepts["n_neighbours"][0] = len(neighbours)
        for k, (name, x, y, yaw) in enumerate(neighbours):
            self.percepts["neighbour_id"][0, k] = name
            self.percepts["neighbour_x"][0, k], self.percepts["neighbour_y"][0, k] = x, y
            self.percepts["neighbour_yaw"][0, k] = yaw

    def receive(self, *packets):
        """Hand packets (bytes) to robot 0."""
        self.percepts["n_packets"][0] = len(packets)
        for k, packet in enumerate(packets):
            self.percepts["packet_length"][0, k] = len(packet)
            self.percepts["packet"][0, k, : len(packet)] = np.frombuffer(packet, np.uint8)


def place_sim(starts, goals=None, world=None, rig=None, noise=None, radio=None, **clock):
    """A simulation of robots at ``starts`` (x, y, yaw); goals default to the starts."""
    rig = rig or rig_of()
    starts = np.asarray(starts, float)
    goals = starts[:, :2] if goals is None else np.asarray(goals, float)
    clock = Clock(**({"seed": 0, "dt": DT, "substeps": 20} | clock))
    world = world_of() if world is None else world
    sim, shared, scratch = new_sim(
        world, BOUNDS, beams_of(rig), rig, starts, goals, noise or Noise(), radio or Radio(), clock
    )
    return sim, shared, scratch


def place_scenario(starts, goals, obstacles=(), bounds=BOUNDS, **more):
    """The scenario (a mapping) of a world written out."""
    place = {
        "world": {"obstacles": list(obstacles), "bounds": list(bounds)},
        "starts": [list(s) for s in starts],
        "goals": [list(g) for g in goals],
    }
    return {"place": place, "robots": len(starts), "limit_s": 120.0, "record_scans": "no"} | more


def run_scenario(values, threads=1):
    """Run a scenario given as a mapping; return its trace."""
    from swarmscope.scenarios.places import make_setup
    from swarmscope.scenarios.read import parse_scenario
    from swarmscope.scenarios.to_kernels import make_setting
    from swarmscope.sim.loop import run

    scenario = parse_scenario(values, "test")
    return run(make_setting(scenario, make_setup(scenario), threads))


def circle(x, y, radius):
    return {"type": "circle", "center": [x, y], "radius": radius}


def wall(*points):
    return {"type": "wall", "points": [list(p) for p in points]}

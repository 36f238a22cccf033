"""Small things that many tests need: sensors, rigs, robots' rows, worlds, mirrors, runs."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope.onboard.body import Body
from swarmscope.onboard.planners import load_planner
from swarmscope.onboard.rig import Guarding, Safety, Sharing, make_rig
from swarmscope.onboard.rows import Rows
from swarmscope.onboard.sensor import Sensor
from swarmscope.sim.beams import make_beams
from swarmscope.sim.lidar import cast_static
from swarmscope.sim.state import Clock, Conditions, Faults, Noise, Radio, Start, new_sim
from swarmscope.sim.world import Circle, WorldSpec, compile_world

DT = 0.2
BOUNDS = (-10.0, -10.0, 10.0, 10.0)


def make_sensor(beams=360, fov=2.0 * math.pi, range_max=5.0, range_min=0.0, **errors):
    """A sensor as robots know it, from the same beams that the world casts."""
    b = make_beams(beams, fov, range_max)
    values = {"range_sigma": 0.0, "position_sigma": 0.0} | errors
    return Sensor(beams, b.angle_min, b.increment, b.wraps, range_min, range_max, **values)


def rig_of(body=None, sensor=None, **options):
    """A robot's constants; ``options`` are fields of ``Guarding``, ``Safety`` and ``Sharing``.

    Margins are those of the top speed, and no scan is waited for, unless they say otherwise: tests put robots into a
    scene that stand there.
    """
    options = {"speed_step_mps": 0.0, "first_scans": 0} | options
    groups = []
    for kind in (Guarding, Safety, Sharing):
        groups.append(kind(**{name: options.pop(name) for name in kind._fields if name in options}))
    assert not options, options
    return make_rig(body or Body(), sensor or make_sensor(), *groups)


def beams_of(rig):
    """What the LiDAR of a rig casts: all beams of its sensor, or those of a limited field of view."""
    sensor = rig.sensor
    beams, closed = sensor.field or sensor.beams, sensor.wraps and sensor.field == 0
    return make_beams(beams, sensor.increment * (beams if closed else beams - 1), sensor.range_max)


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


class Seen(NamedTuple):
    """A neighbour as mutual positioning reports it, body frame."""

    address: int
    x: float
    y: float
    yaw: float


def seen(address, x, y, yaw=0.0):
    return Seen(address=int(address), x=float(x), y=float(y), yaw=float(yaw))


def one_robot(rig=None, planner="nav-scope", address=0, **params):
    """The rows of a robot that has seen nothing yet; ``planner`` is one, or its name."""
    chosen = load_planner(planner) if isinstance(planner, str) else planner
    rows = Rows(chosen, rig or rig_of(), chosen.params(params), address)
    rows.fill(dt_s=DT)
    return rows


def tick(rows):
    """Let a robot make one step and time go on; return what it decided."""
    rows.step()
    rows.percept["now_s"] += DT
    return rows.decision


def place_sim(starts, goals=None, world=None, rig=None, noise=None, radio=None, faults=None, **clock):
    """A simulation of robots at ``starts`` (x, y, yaw) and their rows; goals default to the starts."""
    rig = rig or rig_of()
    starts = np.asarray(starts, float)
    goals = starts[:, :2] if goals is None else np.asarray(goals, float)
    clock = Clock(**({"seed": 0, "dt": DT, "substeps": 20} | clock))
    world = world_of() if world is None else world
    start = Start(starts, goals, BOUNDS)
    conditions = Conditions(noise or Noise(), radio or Radio(), faults or Faults())
    return new_sim(world, beams_of(rig), rig, start, conditions, clock)


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

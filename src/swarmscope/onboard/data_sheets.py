"""What a robot is made of, checked once when it is put together: planner, parameters, body, address, options."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from swarmscope.errors import ConfigError, UnknownNameError
from swarmscope.onboard.body import Body, protection_model
from swarmscope.onboard.control.horizon import Horizon, horizon_of
from swarmscope.onboard.control.unseen import reaches_between
from swarmscope.onboard.edge import ADDRESSES, short
from swarmscope.onboard.lidar import LEAST_VIEW_DEG, Lidar, finite, sensor_of, sweep_s
from swarmscope.onboard.perception.features import MASKS
from swarmscope.onboard.perception.frames import STEP_RADII
from swarmscope.onboard.planners import Planner, load_planner
from swarmscope.onboard.rig import GUARDING, SAFETY, SHARING, Guarding, Rig, Safety, Sharing, make_rig
from swarmscope.onboard.scans import Scans
from swarmscope.onboard.sensor import Sensor, all_round

DEFAULTS: dict[str, Any] = {**GUARDING._asdict(), **SAFETY._asdict(), **SHARING._asdict()}
"""Options of a robot, by the keys of a scenario; nobody can do without the guard."""
del DEFAULTS["enabled"]
BOOTS = 65536
"""Boot numbers."""
MOST_FIRST_SCANS = 100
"""A robot may wait for so many scans; fewer than ticks are counted (``tracks.MOST_COUNTED``), or it never sets off."""


def planner_of(planner: str | Planner) -> Planner:
    """Return a planner that robots can run; raises an error that says why not."""
    if not isinstance(planner, str | Planner):
        raise ConfigError("planner", f"must be the name of a planner, not {short(planner)}")
    chosen = load_planner(planner) if isinstance(planner, str) else planner
    if chosen.told:
        raise ConfigError("planner", f"'{chosen.name}' is told the right side by somebody who knows the map")
    chosen.check_available()
    return chosen


def options_of(given: Mapping[str, float | None]) -> dict[str, Any]:
    """Return every option as a plain number; raises ConfigError or UnknownNameError."""
    checked = dict(DEFAULTS)
    for name, value in given.items():
        if name not in DEFAULTS:
            raise UnknownNameError("option", name, DEFAULTS, "Robot")
        if isinstance(DEFAULTS[name], bool):
            checked[name] = bool(value)
            continue
        checked[name] = finite(value, name)
        if checked[name] < 0.0:
            raise ConfigError(name, f"must be at least 0, not {value!r}")
    scans = checked["first_scans"]
    if scans != int(scans) or scans > MOST_FIRST_SCANS:
        raise ConfigError("first_scans", f"must be a whole number up to {MOST_FIRST_SCANS}, not {scans:g}")
    if checked["feature_mask"] not in (-1, *MASKS.values()):
        codes = ", ".join(f"{code} ({name})" for name, code in MASKS.items())
        raise ConfigError("feature_mask", f"must be one of {codes}")
    return checked


def check_body(body: Body) -> Body:
    """Return the data sheet with plain numbers; raises ConfigError with the field's name."""
    checked = Body(*(finite(value, f"body.{name}") for name, value in zip(Body._fields, body, strict=True)))
    try:
        protection = protection_model(checked)
    except ConfigError as error:
        raise ConfigError(error.where.replace("robot.", "body."), error.why) from None
    if not all(map(math.isfinite, protection)):
        raise ConfigError("body", "its protection model is not finite")
    return checked


def check_address(address: Any) -> int:
    """Return the radio address; raises ConfigError."""
    value = finite(address, "address")
    if value != int(value) or not 0 <= value < ADDRESSES:
        raise ConfigError("address", f"must be a whole number from 0 to {ADDRESSES - 1}, not {address!r}")
    return int(value)


def check_boot(boot: Any) -> int | None:
    """Return the boot number of a robot's first start, None if it is to be drawn; raises ConfigError."""
    if boot is None:
        return None
    value = finite(boot, "boot")
    if value != int(value) or not 0 <= value < BOOTS:
        raise ConfigError("boot", f"must be a whole number from 0 to {BOOTS - 1}, not {boot!r}")
    return int(value)


def check_rate(rate_hz: Any) -> float:
    """Return the rate of ticks [Hz]; raises ConfigError."""
    value = finite(rate_hz, "rate_hz")
    if not 0.0 < value <= 1000.0:
        raise ConfigError("rate_hz", f"must be above 0 and at most 1000 Hz, not {rate_hz!r}")
    return value


def core_of(body: Body, options: Mapping[str, Any]) -> float:
    """Return the radius of the body and the clearance round it [m]."""
    return float(body.radius_m + _part(Guarding, options).clearance_m)


def rig_of(body: Body, lidar: Lidar, scans: Scans, options: Mapping[str, Any]) -> Rig:
    """Return the robot's constants; raises ConfigError when LiDAR and body do not go together."""
    offset = math.hypot(lidar.mount[0], lidar.mount[1])
    if offset > body.radius_m:
        raise ConfigError("lidar.mount", f"{offset:g} m from the centre is outside the radius {body.radius_m:g} m")
    reach = protection_model(body).r + offset
    if lidar.range_m < reach:
        raise ConfigError("lidar.range_m", f"{lidar.range_m:g} m is less than this body needs to stop, {reach:.2f} m")
    guarding, safety, sharing = (_part(kind, options) for kind in (Guarding, Safety, Sharing))
    guarding = guarding._replace(latency_s=guarding.latency_s + sweep_s(lidar))  # the oldest reading counts
    if guarding.strangers_mps > 0.0 and lidar.masks_deg:
        raise ConfigError("lidar.masks_deg", "somebody may come where this LiDAR is masked: strangers_mps 0 would do")
    rig = make_rig(body, all_round(sensor_of(lidar, scans.grid)), guarding, safety, sharing)
    taken = rig.guarding
    horizon = horizon_of(taken.others_smallest_m, taken.strangers_m, rig.sensor, taken.thinnest_m, scans.gap)
    return rig._replace(horizon=Horizon(*(max(0.0, reach - offset) for reach in horizon)))  # it is the sensor's


def _part(kind: Any, options: Mapping[str, Any]) -> Any:
    """Return the options that a named tuple has."""
    return kind(**{name: options[name] for name in kind._fields if name in options})


SLOWEST_MPS = 0.1
"""A robot that may not be as fast as this, for what it sees, can hardly move."""


def check_horizon(rig: Rig, dt_s: float) -> None:
    """Raise ConfigError, with the number that would do, when a robot that decides every ``dt_s`` can hardly move.

    It has to stop within what it has seen (docs/safety.md): static things, and, unless nothing else moves, robots that
    come into view.
    """
    guarding, taken = rig.guarding, rig.body.radius_m + rig.guarding.clearance_m
    if guarding.strangers_mps > 0.0 and rig.sensor.field > 0:
        raise ConfigError(
            "guard.strangers_mps", "somebody may come from where this LiDAR does not look: lidar.fov_deg 360 would do"
        )
    view = math.degrees(rig.sensor.increment * (rig.sensor.field - 1))
    if rig.sensor.field > 0 and view < LEAST_VIEW_DEG - 1e-6:
        why = f"a view of {view:.0f} degrees shows too little of what is beside the way"
        raise ConfigError("lidar.fov_deg", f"{why}; {LEAST_VIEW_DEG:g} would do, seen from the body's centre")
    speed = min(SLOWEST_MPS, rig.body.v_max_mps)
    delay, brake = dt_s + guarding.latency_s, speed * speed / (2.0 * rig.body.a_max_mps2)
    need = taken + speed * delay + brake
    _check_range(rig, speed, need, "things")
    if rig.sensor.field > 0:
        need = max(need, _kept_beside(rig))
    _check_beams(rig, speed, need, "things", guarding.thinnest_m, 0.5 * guarding.thinnest_m)
    if guarding.strangers_mps > 0.0:
        gap = speed * delay + brake + guarding.strangers_mps * (delay + speed / rig.body.a_max_mps2)
        smallest = guarding.strangers_m
        _check_view(rig, speed, taken + gap, "people", 2.0 * smallest, smallest)
    if not guarding.others_mps > 0.0:
        return
    gap = 2.0 * (speed * delay + 2.0 * brake)
    if not guarding.others_yield:
        gap = speed * delay + brake + guarding.others_mps * (delay + speed / rig.body.a_max_mps2)
    smallest = guarding.others_smallest_m
    _check_view(rig, speed, taken + gap, "robots", 2.0 * smallest, smallest)


def _kept_beside(rig: Rig) -> float:
    """Return how far away a robot of limited view must have seen what is beside it now, a scan kept later [m]."""
    half = min(0.5 * math.pi, 0.5 * rig.sensor.increment * (rig.sensor.field - 1))
    beside = rig.body.radius_m + rig.guarding.clearance_m + reaches_between(rig.body.radius_m)
    way = STEP_RADII * rig.body.radius_m if half < 0.5 * math.pi else 0.0  # since the last scan that was kept
    return beside / math.sin(half) + way


def _check_view(rig: Rig, speed: float, need: float, what: str, width: float, nearer: float) -> None:
    """Raise ConfigError unless ``need`` [m] lies within range, and ``width`` [m] shows between two beams there."""
    _check_range(rig, speed, need, what)
    _check_beams(rig, speed, need, what, width, nearer)


def _check_range(rig: Rig, speed: float, need: float, what: str) -> None:
    """Raise ConfigError unless ``need`` [m] lies within range."""
    if rig.sensor.range_max < need:
        raise ConfigError("lidar.range_m", f"{_must_see(speed, what, need)}; {rig.sensor.range_max:g} m is too short")


def _must_see(speed: float, what: str, need: float) -> str:
    return f"to drive {speed:g} m/s this robot must see {what} {need:.2f} m away"


def _check_beams(rig: Rig, speed: float, need: float, what: str, width: float, nearer: float) -> None:
    """Raise ConfigError unless ``width`` [m] shows between two beams ``need`` [m] away."""
    finest = 2.0 * math.asin(min(1.0, 0.5 * width / (need + nearer))) if width > 0.0 else math.pi
    if rig.sensor.increment > finest:
        count, least = rig.sensor.field or rig.sensor.beams, _least_beams(rig.sensor, finest)
        raise ConfigError("lidar.beams", f"{_must_see(speed, what, need)}; {count} are too few, {least} would do")


def _least_beams(sensor: Sensor, finest: float) -> int:
    """Return how many beams over the same view are no more than ``finest`` [rad] apart."""
    whole = sensor.increment * sensor.beams
    if sensor.field == 0 and whole <= 2.0 * math.pi * (1.0 + 1e-9):
        return math.ceil(whole / finest)
    return 1 + math.ceil(sensor.increment * ((sensor.field or sensor.beams) - 1) / finest)

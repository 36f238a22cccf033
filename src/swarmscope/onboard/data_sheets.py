"""What a robot is made of, checked once when it is put together: planner, parameters, body, address, options."""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from swarmscope.errors import ConfigError, UnknownNameError
from swarmscope.onboard.body import Body, protection_model
from swarmscope.onboard.edge import ADDRESSES, short
from swarmscope.onboard.lidar import Lidar, finite, sensor_of
from swarmscope.onboard.percept import Rig, make_rig
from swarmscope.onboard.planning._contract import load_planner, make_params
from swarmscope.onboard.scans import Scans

DEFAULTS = {n: p.default for n, p in inspect.signature(make_rig).parameters.items() if p.kind is p.KEYWORD_ONLY}
"""Options of `make_rig`."""


def planner_of(name: str, model: Path | str | None) -> Any:
    """Return the planner ``name``; raises an error when no robot can run it."""
    planner = load_planner(name) if isinstance(name, str) else None
    if planner is None:
        raise ConfigError("planner", f"must be the name of a planner, not {short(name)}")
    if getattr(planner, "TOLD_SIDE", False):
        raise ConfigError("planner", f"'{name}' is told the right side by somebody who knows the map: not on a robot")
    chosen: Any = planner
    if model is not None:
        if not hasattr(planner, "with_model"):
            raise ConfigError("model", f"planner '{name}' has no network")
        chosen = planner.with_model(model)
    check = getattr(chosen, "check_available", None)
    if check is not None:
        check()
    return chosen


def params_of(planner: Any, values: Mapping[str, float]) -> Any:
    """Return the planner's parameters; raises ConfigError or UnknownNameError."""
    return make_params(planner, {name: finite(value, f"params.{name}") for name, value in values.items()})


def options_of(given: Mapping[str, float]) -> dict[str, Any]:
    """Return the options of ``make_rig`` as plain numbers; raises ConfigError or UnknownNameError."""
    checked: dict[str, Any] = {}
    for name, value in given.items():
        if name not in DEFAULTS:
            raise UnknownNameError("option", name, DEFAULTS, "Robot")
        if isinstance(DEFAULTS[name], bool):
            checked[name] = bool(value)
            continue
        checked[name] = finite(value, name)
        if checked[name] < 0.0:
            raise ConfigError(name, f"must be at least 0, not {value!r}")
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


def check_rate(rate_hz: Any) -> float:
    """Return the rate of ticks [Hz]; raises ConfigError."""
    value = finite(rate_hz, "rate_hz")
    if not 0.0 < value <= 1000.0:
        raise ConfigError("rate_hz", f"must be above 0 and at most 1000 Hz, not {rate_hz!r}")
    return value


def rig_of(body: Body, lidar: Lidar, scans: Scans, options: Mapping[str, Any]) -> Rig:
    """Return the robot's constants; raises ConfigError when LiDAR and body do not go together."""
    offset = math.hypot(lidar.mount[0], lidar.mount[1])
    if offset > body.radius_m:
        raise ConfigError("lidar.mount", f"{offset:g} m from the centre is outside the radius {body.radius_m:g} m")
    reach = protection_model(body).r + offset
    if lidar.range_m < reach:
        raise ConfigError("lidar.range_m", f"{lidar.range_m:g} m is less than this body needs to stop, {reach:.2f} m")
    every = {name: value if isinstance(value, bool) else float(value) for name, value in DEFAULTS.items()}
    return make_rig(body, sensor_of(lidar, scans.grid), **(every | dict(options)))

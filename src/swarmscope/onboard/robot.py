"""One real robot: from what its sensors and its radio say to wheel commands and packets, in one call a tick.

Everything is checked here, once (``edge``, ``scans``): what can be converted is, and what cannot be used brakes with a
reason. ``tick`` never raises, never compiles and never waits. Every field, unit and frame: docs/on-a-robot.md.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from swarmscope.errors import ConfigError, UnknownNameError
from swarmscope.onboard.body import Body, protection_model
from swarmscope.onboard.edge import (
    ADDRESSES,
    GOAL_M,
    Mail,
    Seen,
    Unusable,
    angle,
    fastest,
    nearest_neighbours,
    numbers,
    one_number,
    short,
)
from swarmscope.onboard.lidar import Lidar, check_lidar, finite, sensor_of
from swarmscope.onboard.perception.reproject import reproject, settle
from swarmscope.onboard.planners import Planner, load_planner
from swarmscope.onboard.reasons import STATE_NAMES
from swarmscope.onboard.rig import GUARDING, SAFETY, SHARING, Guarding, Rig, Safety, Sharing, make_rig
from swarmscope.onboard.rows import Rows
from swarmscope.onboard.scans import STALE_PERIODS, Scans
from swarmscope.onboard.trail import Pose, Trail, then

__all__ = ["Command", "Lidar", "Robot", "Seen", "WarmUp"]

JUMP_PERIODS = 5.0
"""A tick that comes later than this is a jump of the clock, or a robot that was asleep."""
JITTER = 1.01
"""A tick that comes at most this much later than it should is on time."""
LATEST_S = 1e11
"""Longest time since a clock's zero [s]."""
BRAKES = "brakes"
"""The state of a command after a fault."""
SIDES = {1: "left", -1: "right", 0: ""}


class Command(NamedTuple):
    """What to do until the next tick; behind the guard already."""

    v: float
    """Forward speed [m/s], 0 to the body's top speed."""
    w: float
    """Turn rate [rad/s], counter-clockwise."""
    outbox: list[tuple[int, bytes]]
    """Packets to send: (address, bytes)."""
    reason: str
    """Why, in words."""
    state: str
    """What the planner is doing, or "brakes" after a fault."""
    side: str
    """Side of the obstacle that is followed: "left", "right" or ""."""
    ok: bool
    """False when the robot brakes because an input could not be used."""


class WarmUp(NamedTuple):
    """What ``Robot.warm_up`` did."""

    seconds: float
    compiled: tuple[str, ...]
    """Kernels that were compiled; they are on disk now, and the next start loads them."""
    loaded: tuple[str, ...]
    """Kernels that were there, on disk or in this process."""


class Robot:
    """A planner at work on a robot with ``body`` and ``lidar`` and the radio ``address`` (0 to 65535).

    ``planner`` is a name, a FILE.py, or what ``load_planner`` returned; ``rate_hz`` is how often you will call ``tick``;
    ``params`` are the planner's (docs/planners.md); ``options`` are fields of ``rig.Guarding, Safety, Sharing`` (safe
    directions, guard, packets). Raises ConfigError with the field's name, UnknownNameError, MissingExtraError.
    """

    def __init__(
        self,
        planner: str | Planner,
        body: Body,
        lidar: Lidar,
        *,
        address: int,
        rate_hz: float = 5.0,
        params: Mapping[str, float] | None = None,
        **options: float,
    ) -> None:
        self._planner = _planner(planner)
        self.body, self.lidar = _check_body(body), check_lidar(lidar)
        self.address, self.rate_hz = _check_address(address), finite(rate_hz, "rate_hz")
        if not 0.0 < self.rate_hz <= 1000.0:
            raise ConfigError("rate_hz", f"must be above 0 and at most 1000 Hz, not {rate_hz!r}")
        self.params = self._planner.params(params)
        self._options = _options(options)
        self._period_s = 1.0 / self.rate_hz
        self.faults: Counter[str] = Counter()
        """How often what could not be used."""
        self.seen: list[Seen] = []
        """The neighbours of the last tick that drove."""
        self._warm = False
        self.reset()

    def reset(self) -> None:
        """Forget everything but the counts of faults: as after switching on."""
        self._scans, self.rows = self._set_up()
        self._mail = Mail()
        self._trail = Trail((STALE_PERIODS + JUMP_PERIODS) * self._period_s, self._period_s)
        self._last_s: float | None = None
        self._ahead_s = 0.0
        self._driven: Pose = (0.0, 0.0, 0.0)
        self.seen = []

    def warm_up(self, say: Callable[[str], None] | None = None) -> WarmUp:
        """Compile or load the kernels and networks that ``tick`` needs; ``say`` is told what it did."""
        begun = time.perf_counter()
        kernels = (*self._planner.kernels, settle, reproject)
        before = [_compiled(kernel) for kernel in kernels]
        _rehearse(*self._set_up())
        names = [getattr(kernel, "__name__", str(kernel)) for kernel in kernels]
        new = [_compiled(kernel) > count for kernel, count in zip(kernels, before, strict=True)]
        done = WarmUp(
            seconds=time.perf_counter() - begun,
            compiled=tuple(name for name, fresh in zip(names, new, strict=True) if fresh),
            loaded=tuple(name for name, fresh in zip(names, new, strict=True) if not fresh),
        )
        self._warm = True
        if say is not None:
            what = f"compiled {', '.join(done.compiled)}" if done.compiled else "all kernels were compiled already"
            say(f"{self._planner.name}: {what}; {done.seconds:.2f} s")
        return done

    def tick(  # noqa: PLR0913  all that a robot knows, by name
        self,
        *,
        scan: Any,
        now_s: float,
        goal: tuple[float, float] | None,
        heading: float,
        speed: float,
        moved: tuple[float, float, float],
        scan_s: float | None = None,
        neighbours: Any = (),
        inbox: Any = (),
    ) -> Command:
        """Return what to do until the next tick. Never raises: what cannot be used brakes, with a reason.

        ``scan`` (B,) [m] is a scan as the data sheet says, or what looks like a ROS LaserScan; None = no new one, the
        last is moved on. ``scan_s`` is its own stamp on the clock of ``now_s`` [s]. ``goal`` is (bearing [rad],
        distance [m]) and ``moved`` (dx, dy [m], dyaw [rad]) since the last tick, in the body frame of now and of the
        last tick; ``heading`` [rad] is by compass, 0 = east; ``speed`` [m/s] by the wheels. ``neighbours`` are
        ``Seen``, ``inbox`` the packets that came in.
        """
        try:
            self._mail.put(inbox, self.faults)
            if not self._warm:
                self.warm_up()
                self._last_s = None
                raise Unusable("not warmed up", "warm_up() was not called: kernels were loaded in this tick")
            self._take_time_and_motion(now_s, moved)
            if scan is not None:
                self._scans.take(scan, scan_s, float(now_s))
            self._fill(goal, heading, speed)
            self.seen = nearest_neighbours(neighbours, self.address, self.body.radius_m, self.faults)
            self._scans.write(self._trail, float(now_s), self.rows.scan)
            return self._decide()
        except Unusable as fault:
            return self._brake(fault.kind, fault.why)
        except Exception as error:  # a planner's library, or an input stranger than anybody thought of
            self._scans.forget()
            return self._brake("error", f"{type(error).__name__} in {_place(error)}")

    def _set_up(self) -> tuple[Scans, Rows]:
        """Return fresh scans and rows."""
        clearance = float(self._options["clearance_m"])
        scans = Scans(self.lidar, self._period_s, self.body.radius_m + clearance)
        rig = _rig(self.body, self.lidar, scans, self._options)
        return scans, Rows(self._planner, rig, self.params, self.address)

    def _take_time_and_motion(self, now_s: Any, moved: Any) -> None:
        """Take in clock and odometry; raises Unusable."""
        try:
            now, dt = self._take_time(now_s)
        except Unusable:
            self._trail.forget()
            self._scans.forget()
            raise
        try:
            dx, dy, dyaw = numbers(moved, 3, "moved", "moved must be three numbers (dx, dy, dyaw)")
            if math.hypot(dx, dy) > fastest(self.body.v_max_mps) * (dt + self._period_s):
                raise Unusable("moved", f"moved {math.hypot(dx, dy):.3g} m in {dt:.3g} s")
        except Unusable:
            self._trail.forget()
            self._trail.add(now, (0.0, 0.0, 0.0))
            raise
        step = dx, dy, angle(dyaw)
        self._trail.add(now, step)
        self._driven = then(self._driven, step) if any(self._driven) else step

    def _take_time(self, now_s: Any) -> tuple[float, float]:
        """Return the time and how long ago the last tick was [s]; raises Unusable when time does not pass."""
        now = one_number(now_s, "clock", "now_s must be a time [s]")
        if abs(now) > LATEST_S:
            raise Unusable("clock", f"now_s is {now:g}: not in seconds?")
        last, self._last_s = self._last_s, now
        if last is None:
            last = now - self._period_s
            self._ahead_s = now
        dt = now - last
        if not 0.0 < dt <= JUMP_PERIODS * self._period_s:
            self._ahead_s += dt - self._period_s
            raise Unusable("clock", f"the clock went from {last:.6g} to {now:.6g} s")
        late = dt > JITTER * self._period_s
        self.rows.fill(now_s=now - self._ahead_s, dt_s=dt if late else self._period_s)
        return now, dt

    def _fill(self, goal: Any, heading: Any, speed: Any) -> None:
        """Check and set goal, heading and speed; raises Unusable."""
        if goal is None:
            raise Unusable("no goal", "there is no goal")
        bearing, distance = numbers(goal, 2, "goal", "goal must be (bearing [rad], distance [m])")
        if not 0.0 <= distance <= GOAL_M:
            raise Unusable("goal", f"the goal is {distance:g} m away")
        compass = one_number(heading, "heading", "heading must be an angle [rad]")
        wheels = one_number(speed, "speed", "speed must be a number [m/s]")
        if abs(wheels) > fastest(self.body.v_max_mps):
            raise Unusable("speed", f"{wheels:g} m/s is no speed of this body")
        self.rows.fill(goal_bearing=angle(bearing), goal_distance=distance, compass=angle(compass), speed=wheels)

    def _decide(self) -> Command:
        """Run the planner and read its answer."""
        rows, body = self.rows, self.body
        rows.fill(odom_x=self._driven[0], odom_y=self._driven[1], odom_yaw=self._driven[2])
        rows.see(self.seen)
        rows.receive(self._mail.take())
        self._driven = (0.0, 0.0, 0.0)
        rows.step()
        v, w = rows.said("v"), rows.said("w")
        if not (0.0 <= v <= body.v_max_mps * 1.000001 and abs(w) <= body.w_max_radps * 1.000001):
            return self._brake("planner", f"the planner asked for {v:g} m/s, {w:g} rad/s")
        return Command(
            v=min(v, body.v_max_mps),
            w=min(max(w, -body.w_max_radps), body.w_max_radps),
            outbox=rows.outbox(),
            reason=self._planner.reasons[rows.said("reason")],
            state=STATE_NAMES[rows.said("state")],
            side=SIDES[rows.said("side")],
            ok=True,
        )

    def _brake(self, kind: str, why: str) -> Command:
        """Count a fault and return the command that stops."""
        self.faults[kind] += 1
        return Command(v=0.0, w=0.0, outbox=[], reason=f"brakes: {why}", state=BRAKES, side="", ok=False)


DEFAULTS: dict[str, Any] = {**GUARDING._asdict(), **SAFETY._asdict(), **SHARING._asdict()}
"""Options of a robot, by the keys of a scenario."""


def _planner(planner: str | Planner) -> Planner:
    """Return a planner that robots can run; raises an error that says why not."""
    if not isinstance(planner, str | Planner):
        raise ConfigError("planner", f"must be the name of a planner, not {short(planner)}")
    chosen = load_planner(planner) if isinstance(planner, str) else planner
    if chosen.told:
        raise ConfigError("planner", f"'{chosen.name}' is told the right side by somebody who knows the map")
    chosen.check_available()
    return chosen


def _options(given: Mapping[str, float]) -> dict[str, Any]:
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
    return checked


def _part(kind: Any, options: Mapping[str, Any]) -> Any:
    """Return the options that a named tuple has."""
    return kind(**{name: options[name] for name in kind._fields})


def _check_body(body: Body) -> Body:
    checked = Body(*(finite(value, f"body.{name}") for name, value in zip(Body._fields, body, strict=True)))
    try:
        protection = protection_model(checked)
    except ConfigError as error:
        raise ConfigError(error.where.replace("robot.", "body."), error.why) from None
    if not all(map(math.isfinite, protection)):
        raise ConfigError("body", "its protection model is not finite")
    return checked


def _check_address(address: Any) -> int:
    value = finite(address, "address")
    if value != int(value) or not 0 <= value < ADDRESSES:
        raise ConfigError("address", f"must be a whole number from 0 to {ADDRESSES - 1}, not {address!r}")
    return int(value)


def _rig(body: Body, lidar: Lidar, scans: Scans, options: Mapping[str, Any]) -> Rig:
    """Return the robot's constants; raises ConfigError when LiDAR and body do not go together."""
    offset = math.hypot(lidar.mount[0], lidar.mount[1])
    if offset > body.radius_m:
        raise ConfigError("lidar.mount", f"{offset:g} m from the centre is outside the radius {body.radius_m:g} m")
    reach = protection_model(body).r + offset
    if lidar.range_m < reach:
        raise ConfigError("lidar.range_m", f"{lidar.range_m:g} m is less than this body needs to stop, {reach:.2f} m")
    parts = (_part(kind, options) for kind in (Guarding, Safety, Sharing))
    return make_rig(body, sensor_of(lidar, scans.grid), *parts)


def _place(error: Exception) -> str:
    """Return where an error comes from."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return "?" if trace is None else f"{Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}"


def _compiled(kernel: Any) -> int:
    """Return how many versions of a kernel were compiled, not loaded, in this process."""
    misses = getattr(getattr(kernel, "stats", None), "cache_misses", None)
    return sum(misses.values()) if misses else 0


def _rehearse(scans: Scans, rows: Rows) -> None:
    """Let a robot that nobody will drive live through a few ticks of every kind."""
    trail = Trail(1e9, 1.0)
    rows.load()
    for k in range(4):
        now = float(k)
        trail.add(now, (0.01 * k, 0.0, 0.01))
        if k == 0:
            scans.rehearse(now)
        scans.write(trail, 0.0, rows.scan)
        rows.scan[: rows.scan.size // 2 if k == 2 else 0] = 1.0
        rows.fill(now_s=now, dt_s=0.2, goal_distance=5.0, goal_bearing=0.1 * k)
        rows.see([Seen(1, 1.0, 0.5)] if k > 1 else [])
        rows.step()

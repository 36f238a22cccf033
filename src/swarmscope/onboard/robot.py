"""One real robot: from what its sensors and its radio say to wheel commands and packets, in one call a tick.

Everything is checked here, once (``edge``, ``scans``): what can be converted is, and what cannot be used brakes with a
reason. ``tick`` never raises, never compiles and never waits. Every field, unit and frame: docs/on-a-robot.md.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from swarmscope.geometry import Pose
from swarmscope.onboard.body import Body
from swarmscope.onboard.data_sheets import (
    BOOTS,
    check_address,
    check_body,
    check_boot,
    check_horizon,
    check_rate,
    core_of,
    options_of,
    planner_of,
    rig_of,
)
from swarmscope.onboard.edge import (
    GOAL_M,
    Mail,
    Seen,
    Unusable,
    angle,
    fastest,
    nearest_neighbours,
    numbers,
    one_number,
)
from swarmscope.onboard.lidar import Lidar, check_lidar
from swarmscope.onboard.perception.clock import JUMP_PERIODS
from swarmscope.onboard.planners import Planner
from swarmscope.onboard.reasons import STATE_NAMES
from swarmscope.onboard.rows import Rows
from swarmscope.onboard.scans import STALE_PERIODS, Scans
from swarmscope.onboard.trail import Trail, then
from swarmscope.onboard.warm import WarmUp, warm_up

__all__ = ["Command", "Lidar", "Robot", "Seen", "WarmUp"]

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


class Robot:
    """A planner at work on a robot with ``body`` and ``lidar`` and the radio ``address`` (0 to 65535).

    ``planner`` is a name, a FILE.py, or what ``load_planner`` returned; ``rate_hz`` says how often ``tick`` is called;
    ``params`` are the planner's (docs/planners.md); ``options`` are fields of ``rig.Guarding, Safety, Sharing`` (safe
    directions, guard, packets), and ``boot``, the boot number of the first start, for runs that shall be repeated;
    without it every start draws one. Raises ConfigError with the field's name, UnknownNameError, MissingExtraError.
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
        **options: float | None,
    ) -> None:
        self._planner = planner_of(planner)
        self.body, self.lidar = check_body(body), check_lidar(lidar)
        self.address, self.rate_hz = check_address(address), check_rate(rate_hz)
        self.params = self._planner.params(params)
        self._next_boot = check_boot(options.pop("boot", None))
        self._options = options_of({"feature_mask": self._planner.feature_mask} | options)
        self._period_s = 1.0 / self.rate_hz
        self.faults: Counter[str] = Counter()
        """How often what could not be used."""
        self.seen: list[Seen] = []
        """The neighbours of the last tick that drove."""
        self._warm = False
        self.reset()

    def reset(self) -> None:
        """Forget everything but the counts of faults: as after switching on. Others know it by a new boot number."""
        self.boot = self._draw_boot()
        self._scans, self.rows = self._set_up()
        self._mail = Mail()
        self._trail = Trail((STALE_PERIODS + JUMP_PERIODS) * self._period_s, self._period_s)
        self._last_s: float | None = None
        self._ahead_s = 0.0
        self._driven: Pose = (0.0, 0.0, 0.0)
        self.seen = []

    def _draw_boot(self) -> int:
        """Return the boot number of this start."""
        if self._next_boot is None:
            return int.from_bytes(os.urandom(2), "little")
        boot, self._next_boot = self._next_boot, (self._next_boot + 1) % BOOTS
        return boot

    def warm_up(self, say: Callable[[str], None] | None = None) -> WarmUp:
        """Compile or load the kernels and networks that ``tick`` needs; ``say`` is told what it did."""
        done = warm_up(self._planner, *self._set_up())
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
        goal: tuple[float, float] | tuple[float, float, float] | None,
        heading: float,
        speed: float,
        moved: tuple[float, float, float],
        scan_s: float | None = None,
        neighbours: Any = (),
        inbox: Any = (),
    ) -> Command:
        """Return what to do until the next tick. Never raises: what cannot be used brakes, with a reason.

        ``scan`` (B,) [m] is a scan as the data sheet says, or what looks like a ROS LaserScan; None = no new one, the
        last is moved on. ``scan_s`` is the stamp of its first reading on the clock of ``now_s`` [s]. ``goal`` is
        (bearing [rad], distance [m]), or with the heading wanted there as a third [rad], in the body frame of now;
        ``moved`` (dx, dy [m], dyaw [rad]) since the last tick, in that of the last tick; ``heading`` [rad] is by
        compass, 0 = east; ``speed`` [m/s] by the wheels. ``neighbours`` are ``Seen``, ``inbox`` the packets that came
        in.
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
            self._scans.write(self._trail, float(now_s), self.rows.found)
            return self._decide()
        except Unusable as fault:
            return self._brake(fault.kind, fault.why)
        except Exception as error:  # a planner's library, or an input stranger than anybody thought of
            self._scans.forget()
            return self._brake("error", f"{type(error).__name__} in {_place(error)}")

    def _set_up(self) -> tuple[Scans, Rows]:
        """Return fresh scans and rows."""
        scans = Scans(self.lidar, self._period_s, core_of(self.body, self._options))
        rig = rig_of(self.body, self.lidar, scans, self._options)
        check_horizon(rig, self._period_s)
        scans.build_in(rig)
        return scans, Rows(self._planner, rig, self.params, self.address, self.boot)

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
        self.rows.set_time(now - self._ahead_s, dt if late else self._period_s)
        return now, dt

    def _fill(self, goal: Any, heading: Any, speed: Any) -> None:
        """Check and set goal, heading and speed; raises Unusable."""
        if goal is None:
            raise Unusable("no goal", "there is no goal")
        bearing, distance, *turn = numbers(
            goal, _count(goal), "goal", "goal must be (bearing [rad], distance [m]) or (bearing, distance, turn [rad])"
        )
        if not 0.0 <= distance <= GOAL_M:
            raise Unusable("goal", f"the goal is {distance:g} m away")
        compass = one_number(heading, "heading", "heading must be an angle [rad]")
        wheels = one_number(speed, "speed", "speed must be a number [m/s]")
        if abs(wheels) > fastest(self.body.v_max_mps):
            raise Unusable("speed", f"{wheels:g} m/s is no speed of this body")
        self.rows.fill(goal_turn=angle(turn[0]) if turn else math.nan)
        self.rows.fill(goal_bearing=angle(bearing), goal_distance=distance, compass=angle(compass), speed=wheels)

    def _decide(self) -> Command:
        """Run the planner and read its answer."""
        rows, body = self.rows, self.body
        rows.fill(odom_x=self._driven[0], odom_y=self._driven[1], odom_yaw=self._driven[2], scan_hides=True)
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


def _place(error: Exception) -> str:
    """Return where an error comes from."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return "?" if trace is None else f"{Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}"


def _count(goal: Any) -> int:
    """Return how many numbers a goal has: 3 with a heading."""
    try:
        return 3 if len(goal) == 3 else 2
    except Exception:  # an input stranger than anybody thought of: it will be said what it is not
        return 2

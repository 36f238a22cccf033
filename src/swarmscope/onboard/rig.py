"""Everything constant that a robot's kernels need: body, protection model, sensor, rules, tables."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit_inline
from swarmscope.onboard.body import Body, Protection, protection_model
from swarmscope.onboard.control.horizon import Horizon, horizon_of
from swarmscope.onboard.perception.features import MASK_MAXIMA
from swarmscope.onboard.perception.filters import feature_filter, printed_filter, window_half
from swarmscope.onboard.perception.safety import Rule, reach_table
from swarmscope.onboard.sensor import Sensor

AHEAD, NARROW, ESCAPE, PRINTED, FITS = range(5)
"""Rows of ``Rig.reach``. AHEAD: where planners drive. NARROW: gaps that the body fits through, free for a while.
ESCAPE: free within r. PRINTED: rule (3), the sector within l_th; it masks the features. FITS: room for the body
within l_th."""


class Guarding(NamedTuple):
    """What the guard and the footprint keep free."""

    clearance_m: float = 0.02
    """Kept free around the body by the guard."""
    footprint_clearance_m: float = 0.03
    """Added to the body's radius: what is swept."""
    persistence_s: float = 2.0
    """How long an unseen neighbour is remembered."""
    lost_s: float = 1.0
    """How long a return is kept that is lost while no beam has passed its place."""
    blind_s: float = 0.5
    """A robot brakes when its LiDAR has said nothing for so long, where something was."""
    latency_s: float = 0.0
    """Age of a scan when its command takes effect."""
    thinnest_m: float = 0.02
    """Width of the narrowest thing that must not be missed between two beams."""
    odometry_scale: float = 0.0
    """By what share wheels err, in the same way all the time (1 sigma, as all of these)."""
    odometry_drift_m: float = 0.0
    """By how much the place by odometry errs after 1 m, at random [m/√m]."""
    odometry_turn_rad: float = 0.0
    """By how much the heading by odometry errs after 1 m, at random [rad/√m]."""
    others_mps: float = -1.0
    """How fast others may be; below 0: as fast as this robot; 0: nothing else moves."""
    others_yield: bool = True
    """Whether others run the same guard."""
    others_smallest_m: float = -1.0
    """Radius of the smallest of them; 0 and below, or above this robot's own: that."""
    others_largest_m: float = -1.0
    """Radius of the largest; 0 and below: this robot's."""
    strangers_mps: float = -1.0
    """How fast those are that are no robots and do not yield, people; 0 and below: there are none."""
    strangers_m: float = -1.0
    """Radius of the smallest of them; 0 and below: `STRANGERS_M`."""
    first_scans: int = -1
    """A robot takes so many scans, and turns a little from one to the next, before it sets off; below 0: one. Three for
    a LiDAR that loses readings, or has beams that never see anything."""
    enabled: bool = True
    """Whether there is a guard at all: simulated robots of a study may go without."""


class Safety(NamedTuple):
    """Which directions are safe (docs/theory.md); sector and no look-ahead is the printed rule."""

    sector: bool = False
    """Use the sector of rule (3) within l_th."""
    look_ahead_m: float = 2.0
    """Directions keep ``margin_m`` from everything up to here."""
    margin_m: float = 0.04
    narrow_m: float = 1.2
    """How far ahead a gap must be free that the body just fits."""
    slow_mps: float = 0.5
    """At lower speeds margins are those of this one: they would open ways that close as soon as the robot speeds up."""
    speed_step_mps: float = 0.125
    """Above it margins follow the present speed in steps of this; 0: they are those of the top speed, as printed."""


class Sharing(NamedTuple):
    """How features travel."""

    exact_features: bool = False
    """Send float32 features instead of quantised ones (to measure what quantisation costs)."""
    max_age_s: float = 1.5
    """Features older than this are not used."""
    feature_mask: int = -1
    """Which extrema count in safe directions only: ``features.UNMASKED``, ``MASK_MAXIMA`` or ``MASK_ALL``; -1: as the
    planner's document has it."""
    printed_filter: bool = False
    """Whether filter (6) has as many taps as a scan has beams, as printed."""


STRANGERS_M = 0.2
"""Radius of a slim person [m]."""
SIGMAS = 3.0
"""Ranges and odometry may err by so many standard deviations."""
MOST_LEVELS = 32
"""Levels of speed, 5 kB of tables each."""
LEAST_MPS = 0.01
"""Margins of a robot that stands."""
ROUNDING_M = 0.0005
"""Of ranges and of motion."""
MOST_BESIDE = 0.75
"""Beams farther apart than so many rad make no difference any more."""
ROUNDING = 1.000001
"""A speed that is above a level by less than this factor belongs to it."""
GUARDING, SAFETY, SHARING = Guarding(), Safety(), Sharing()


class Rig(NamedTuple):
    """The constants of one kind of robot."""

    body: Body
    protection: Protection
    """At the top speed."""
    level_mps: np.ndarray
    """(L,): the levels of speed, the top speed last."""
    margins: np.ndarray
    """(L, 7): the protection model at each of them, a row each."""
    sensor: Sensor
    half: int
    """alpha/2 in beams."""
    footprint: float
    """Radius that is swept: the body's plus a clearance [m]."""
    horizon: Horizon
    guarding: Guarding
    sharing: Sharing
    look_ahead: float
    """Directions are free of obstacles up to here [m]."""
    reach: np.ndarray
    """(L, 5, BINS + 2) int16: what a return blocks at each level of speed by each of the rules named above."""
    cos: np.ndarray
    """(M,) of each beam."""
    sin: np.ndarray
    taps: np.ndarray


def make_rig(
    body: Body,
    sensor: Sensor,
    guarding: Guarding = GUARDING,
    safety: Safety = SAFETY,
    sharing: Sharing = SHARING,
) -> Rig:
    """Return the constants of a robot with ``body`` and ``sensor``; raises ConfigError for an impossible body.

    The longest range becomes the one that a scan can hold (float32): a beam that says it has seen nothing, not just a
    little less.
    """
    body = Body(*(float(v) for v in body))
    sensor = sensor._replace(range_max=float(np.float32(sensor.range_max)))
    protection = protection_model(body)
    angles = sensor.angle_min + sensor.increment * np.arange(sensor.beams)
    beside = keeps_beside(body, sensor)
    footprint = max(body.radius_m + guarding.footprint_clearance_m, beside)
    half = window_half(protection.alpha, sensor.increment)
    resolved = _resolved(guarding, body)
    slower = _slower(body, safety)
    levels = [protection_model(one) for one in slower]
    reach = [
        [reach_table(sensor.increment, sensor.range_max, footprint, rule) for rule in rules]
        for rules in (_rules(body.radius_m, level, protection, safety, beside) for level in levels)
    ]
    return Rig(
        body=body,
        protection=protection,
        level_mps=ROUNDING * np.array([one.v_max_mps for one in slower]),
        margins=np.array(levels),
        sensor=sensor,
        half=half,
        footprint=footprint,
        horizon=horizon_of(resolved.others_smallest_m, resolved.strangers_m, sensor, guarding.thinnest_m),
        guarding=resolved,
        sharing=Sharing(
            exact_features=bool(sharing.exact_features),
            max_age_s=float(sharing.max_age_s),
            feature_mask=int(sharing.feature_mask) if sharing.feature_mask >= 0 else MASK_MAXIMA,
            printed_filter=bool(sharing.printed_filter),
        ),
        look_ahead=float(safety.look_ahead_m),
        reach=np.array(reach),
        cos=np.cos(angles),
        sin=np.sin(angles),
        taps=printed_filter(half, sensor.beams) if sharing.printed_filter else feature_filter(half),
    )


@jit_inline
def level_of(speed: float, rig: Rig) -> int:
    """Return the lowest level of speed that is not below ``speed`` [m/s]."""
    levels = len(rig.reach)
    for k in range(levels - 1):
        if speed <= rig.level_mps[k]:
            return k
    return levels - 1


@jit_inline
def margins_at(level: int, rig: Rig) -> Protection:
    """Return the protection model at a level of speed."""
    m = rig.margins[level]
    return Protection(m[0], m[1], m[2], m[3], m[4], m[5], m[6])


def _slower(body: Body, safety: Safety) -> list[Body]:
    """Return the data sheet at each level of speed, the top speed last."""
    above, step = body.v_max_mps - safety.slow_mps, safety.speed_step_mps
    if not (above > 0.0 and step > 0.0):
        return [body]
    steps = min(MOST_LEVELS - 1, math.ceil(above / step - 1e-6))
    speeds = [max(safety.slow_mps, LEAST_MPS) + above * k / steps for k in range(steps)]
    width = min(body.half_width_m, body.radius_m)
    return [*(body._replace(v_max_mps=speed, half_width_m=width) for speed in speeds), body]


def _resolved(guarding: Guarding, body: Body) -> Guarding:
    """Return plain numbers, what is not said of others filled in."""
    own = {"others_mps": body.v_max_mps, "others_smallest_m": body.radius_m, "others_largest_m": body.radius_m}
    own |= {"strangers_mps": 0.0, "strangers_m": STRANGERS_M}
    scans = guarding.first_scans if guarding.first_scans >= 0 else 1
    switches = ("others_yield", "enabled", "first_scans")
    given = {name: float(value) for name, value in guarding._asdict().items() if name not in switches}
    unsaid = [name for name in own if not (given[name] > 0.0 or (given[name] == 0.0 and name.endswith("_mps")))]
    filled = given | {name: own[name] for name in unsaid}
    filled["others_smallest_m"] = min(filled["others_smallest_m"], body.radius_m)
    filled["others_largest_m"] = max(filled["others_largest_m"], filled["others_smallest_m"])
    yields, enabled = bool(guarding.others_yield), bool(guarding.enabled)
    return Guarding(**filled, others_yield=yields, enabled=enabled, first_scans=int(scans))


def keeps_beside(body: Body, sensor: Sensor) -> float:
    """Return how near a robot may pass by a return, for the thing may reach as far as the next beam [m].

    With few beams that is more than any margin: directions that the guard does not allow must not seem free.
    """
    return (body.radius_m + ROUNDING_M) / (1.0 - min(MOST_BESIDE, sensor.increment))


def _rules(
    radius: float, margins: Protection, fastest: Protection, safety: Safety, beside: float
) -> tuple[Rule, ...]:
    """Return the rules AHEAD to FITS at a level of speed; features keep one mask, that of the top speed."""
    r, l_th, half_alpha = margins.r, margins.l_th, 0.5 * margins.alpha
    sector = half_alpha if safety.sector else 0.0
    return (
        Rule(l_th, sector, safety.look_ahead_m, max(radius + safety.margin_m, beside)),
        Rule(safety.narrow_m or r),
        Rule(r),
        Rule(fastest.l_th, 0.5 * fastest.alpha),
        Rule(l_th),
    )

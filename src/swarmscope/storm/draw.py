"""What a run of a storm is: everything drawn from one random stream for (seed, number)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from swarmscope.errors import ConfigError, SwarmscopeError, UnsolvableWorldError
from swarmscope.onboard.data_sheets import check_horizon
from swarmscope.scenarios.overrides import set_path
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.plain import plain
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.scenario import Scenario
from swarmscope.scenarios.to_kernels import make_rig_of
from swarmscope.sim.world import WorldSpec
from swarmscope.storm.forger import KINDS, Forger
from swarmscope.storm.ranges import (
    ALL_ROUND,
    CALM,
    CHOICES,
    EACH,
    FAULT_PAIRS,
    FAULTS,
    FORGED_PER_TICK,
    LIMIT_S,
    NO_CLEARANCE,
    NOISE,
    OPEN,
    RADIO,
    REPEATED,
    ROBOTS,
    SHEET,
    TASK_OPTIONS,
    TRIES,
    VIEW_DEG,
    WORK,
    Span,
)
from swarmscope.storm.worlds import KINDS as OWN_WORLDS
from swarmscope.storm.worlds import make_world, number
from swarmscope.tasks import Setup, place_on_map, task_names

OFFICE = "willow_garage_office"
PLACES = ("task", "task", "task", *OWN_WORLDS, *OWN_WORLDS, "office")
"""Where runs are: three parts in tasks, two parts in each kind of world made here, one part in the packaged map."""
WHOLE = ("lidar.beams",)
"""Keys with whole numbers."""


@dataclass(frozen=True)
class Case:
    """A run: a scenario and who throws packets."""

    values: dict[str, Any]
    """The scenario's keys that have other values than by default."""
    forger: Forger | None = None


@dataclass(frozen=True)
class Draw:
    """A run as it was drawn."""

    case: Case
    where: str
    """What kind of place."""
    again: bool
    """Whether it is run twice, to compare."""
    refused: Mapping[str, int] = field(default_factory=dict)
    """Draws before this one that were no possible runs, by the key that says so."""
    setup: Setup | None = field(default=None, compare=False, repr=False)
    """Its place, so that it need not be made and checked again."""


def draw(seed: int, index: int, planners: Sequence[str], covered: bool = False) -> Draw | dict[str, int]:
    """Return run ``index`` of the storm ``seed``; what was refused where nothing possible was drawn in `TRIES`.

    Everything is drawn from ``np.random.default_rng([seed, index])``, in the order of this function; a draw that is
    refused is followed by the next one of the same stream. What storms are known to break is drawn, and then left out
    if only what is ``covered`` is wanted.
    """
    rng = np.random.default_rng([seed, index])
    refused: dict[str, int] = {}
    for _ in range(TRIES):
        where = PLACES[int(rng.integers(len(PLACES)))]
        values, forger, again = _draw_once(rng, where, planners)
        if covered:
            _leave_out(values)
        try:
            setup = _check(values, where, rng)
        except (ConfigError, UnsolvableWorldError) as error:
            key = _key_of(error)
            refused[key] = refused.get(key, 0) + 1
            continue
        return Draw(Case(values, forger), where, again, refused, setup)
    return refused


def _draw_once(
    rng: np.random.Generator, where: str, planners: Sequence[str]
) -> tuple[dict[str, Any], Forger | None, bool]:
    """Draw the keys of a run but for a world of our own."""
    values: dict[str, Any] = {"record_scans": "no", "seed": int(rng.integers(2**31))}
    values["robots"] = round(number(rng, ROBOTS))
    values["planner"] = {"name": planners[int(rng.integers(len(planners)))]}
    _set_each(values, rng, SHEET, 1.0)
    values["robot"]["half_width_m"] = values["robot"]["radius_m"]
    all_round, view = rng.random() < ALL_ROUND, number(rng, VIEW_DEG)
    values["lidar"]["fov_deg"] = 360.0 if all_round else view
    if rng.random() < NO_CLEARANCE:
        values["guard"] = {"clearance_m": 0.0}
    for spans in (NOISE, RADIO):
        if rng.random() >= CALM:
            _set_each(values, rng, spans, EACH)
    if rng.random() >= CALM:
        for pair in FAULT_PAIRS:
            if rng.random() < EACH:
                _set_each(values, rng, {key: FAULTS[key] for key in pair}, 1.0)
    forger = None
    if rng.random() >= CALM:
        kinds = tuple(kind for kind in KINDS if rng.random() < 0.5) or KINDS
        forger = Forger(int(rng.integers(2**31)), number(rng, FORGED_PER_TICK), kinds)
    again = bool(rng.random() < REPEATED)
    if where == "task":
        values["task"] = _draw_task(rng)
    elif where == "office":
        values["map"] = {"file": OFFICE, "min_distance_m": number(rng, Span(2.0, 8.0))}
        values["robots"] = min(values["robots"], 12)
    return values, forger, again


def _leave_out(values: dict[str, Any]) -> None:
    """Keep the keys in `OPEN` within what storms have not broken."""
    for name, span in OPEN.items():
        group, _, key = name.partition(".")
        value = values.get(group, {}).pop(key, None)
        if value is not None and span is not None:
            values[group][key] = min(span.high, max(span.low, value))
    values["robot"]["half_width_m"] = values["robot"]["radius_m"]


def _draw_task(rng: np.random.Generator) -> dict[str, Any]:
    """Draw a task and its options."""
    names = task_names()
    name = names[int(rng.integers(len(names)))]
    options: dict[str, Any] = {key: number(rng, span) for key, span in TASK_OPTIONS.get(name, {}).items()}
    for key, words in CHOICES.get(name, {}).items():
        options[key] = words[int(rng.integers(len(words)))]
    for key in ("fewest", "most"):
        if key in options:
            options[key] = round(options[key])
    return {"name": name, "options": options}


def _set_each(values: dict[str, Any], rng: np.random.Generator, spans: Mapping[str, Span], share: float) -> None:
    """Draw each key with the probability ``share``; every key takes as many numbers of the stream either way."""
    for key, span in spans.items():
        wanted, drawn = rng.random() < share, number(rng, span)
        if wanted:
            set_path(values, key.split("."), round(drawn) if key in WHOLE else drawn, "storm")


def _check(values: dict[str, Any], where: str, rng: np.random.Generator) -> Setup:
    """Make and return the place of a run, cheap questions first. Errors: ConfigError, UnsolvableWorldError."""
    _check_sheet(values)
    if where in OWN_WORLDS:
        radius = values["robot"]["radius_m"]
        world = make_world(rng, where, radius)
        least = number(rng, Span(0.5, 4.0))
        setup = place_on_map(WorldSpec.model_validate(world), values["seed"], values["robots"], radius, least)
        values["place"] = _written(setup)
    scenario = parse_scenario(values, "storm")
    setup = make_setup(scenario)
    values["limit_s"] = _limit_s(scenario, setup)
    return setup


def _check_sheet(values: dict[str, Any]) -> None:
    """Raise a ConfigError for a data sheet with which a robot can hardly move."""
    scenario = parse_scenario({k: v for k, v in values.items() if k != "map"} | {"task": {"name": "T1"}}, "storm")
    check_horizon(make_rig_of(scenario), 1.0 / scenario.lidar.rate_hz)


def _limit_s(scenario: Scenario, setup: Setup) -> float:
    """Return how long a run may take: about three times the longest way there can be, within bounds."""
    x0, y0, x1, y1 = setup.world.bounds
    wanted = 3.0 * math.hypot(x1 - x0, y1 - y0) / scenario.widest.v_max_mps + 10.0
    per_s = scenario.robots * scenario.lidar.rate_hz * (scenario.lidar.beams + 200)
    return float(f"{min(LIMIT_S.high, max(LIMIT_S.low, wanted), max(5.0, WORK / per_s)):.4g}")


def _written(setup: Setup) -> dict[str, Any]:
    """Return a setup as a scenario's ``place``."""
    place = {"world": setup.world.model_dump(mode="json"), "starts": setup.starts, "goals": setup.goals}
    plain_place: dict[str, Any] = plain(place)
    return plain_place


def written_place(values: dict[str, Any]) -> dict[str, Any]:
    """Return the same run with its world, starts and goals written out."""
    setup = make_setup(parse_scenario(values, "storm"))
    return {k: v for k, v in values.items() if k not in ("task", "map")} | {"place": _written(setup)}


def _key_of(error: SwarmscopeError) -> str:
    """Return by which key a run was refused."""
    if isinstance(error, ConfigError):
        return error.where.removeprefix("storm: ")
    return "world"

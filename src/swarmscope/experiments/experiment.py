"""An experiment: worlds x planners x seeds, what was published, and what its report shows; one typed YAML file.

``docs/experiments.md`` explains the file. Everything that makes a run is a scenario (``scenario.py``): an
experiment's ``scenario`` is the common part, a place and a planner add their keys to it, a sweep one more.
"""

from __future__ import annotations

import copy
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from swarmscope.errors import ConfigError, UnknownNameError, nearest_hint
from swarmscope.experiments.seeds import seed_set
from swarmscope.judging.metrics import BETWEEN, COUNTED, METRICS
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.scenarios.read import find_user_files, parse_scenario
from swarmscope.scenarios.scenario import Scenario
from swarmscope.texts import read_yaml

Name = Annotated[str, Field(min_length=1, max_length=60, pattern=r"^[^/\\\n]+$")]
Keys = dict[str, Any]


class _Strict(BaseModel):
    """No unknown keys, nothing changed after loading."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Sweep(_Strict):
    """One planner with several values of one key."""

    name: Name
    planner: Name
    """Label of the planner that is varied."""
    key: str
    """Key of a scenario, such as ``planner.params.w_i``."""
    values: Annotated[list[float], Field(min_length=1)]


class Published(_Strict):
    """One published table, one figure of it."""

    source: str
    """Document and table."""
    metric: str
    values: dict[str, dict[str, float]]
    """Place -> planner -> value, in the metric's unit (shares as shares: 0.051)."""


class Target(_Strict):
    """What a planner is to reach."""

    planner: Name
    place: Name
    metric: str
    at_most: float | None = None
    at_least: float | None = None

    @model_validator(mode="after")
    def _one_bound(self) -> Self:
        if (self.at_most is None) == (self.at_least is None):
            raise ValueError("give exactly one of 'at_most' and 'at_least'")
        return self


class WeightEstimate(_Strict):
    """How w_i is estimated from data (Nav-SCOPE V-C 4)."""

    place: Name
    planner: Name
    seeds: str = "playground"
    keys: Keys = {}
    """Keys of a scenario above those of the planner: what belongs to us, not to P_a, is taken out by them."""


class Gap(_Strict):
    """Two planners between whose path lengths the others are placed (GIWT 5.3)."""

    worst: Name
    """Reductions are counted from this one."""
    best: Name | None = None
    """The bound: this one closes the gap; without it the true shortest way does."""


FIGURES = ("boxes", "paths", "sweeps", "field", "cases", "weight", "resources", "flow_time")
Figure = Literal["boxes", "paths", "sweeps", "field", "cases", "weight", "resources", "flow_time"]


class Experiment(_Strict):
    """A whole experiment."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]{0,39}$")]
    title: str
    about: str = ""
    seeds: str = "evaluation"
    """A set of seeds.yaml, 'first-last', or a list of these."""
    preset: str | None = None
    """For every planner that has a preset of this name (``planner.preset``) and names none itself."""
    scenario: Keys = {}
    places: Annotated[dict[Name, Keys], Field(min_length=1)]
    planners: Annotated[dict[Name, Keys], Field(min_length=1)]
    sweeps: list[Sweep] = []
    ours: Name | None = None
    """Label of the planner that the others are compared with, map by map."""
    metrics: list[str] = ["path_redundancy", "arrival_rate", "duration_s"]
    """Figures of the main tables."""
    published: list[Published] = []
    order: list[Name] = []
    """Planners from worst to best in the published tables."""
    targets: list[Target] = []
    figures: list[Figure] = ["boxes", "paths"]
    weight: WeightEstimate | None = None
    gap: Gap | None = None
    flow_time: Name | None = None
    """Planner whose flow-time increases stand beside those of 'ours' (figure ``flow_time``)."""
    notes: list[str] = []
    """Sentences that the report shows under its tables: known differences to the publication."""

    @model_validator(mode="after")
    def _names_exist(self) -> Self:
        for sweep in self.sweeps:
            _known("planner", sweep.planner, self.planners, f"sweep {sweep.name}")
        if self.ours is not None:
            _known("planner", self.ours, self.planners, "ours")
        for target in self.targets:
            _known("planner", target.planner, self.planners, "targets")
            _known("place", target.place, self.places, "targets")
        if self.weight is not None:
            _known("planner", self.weight.planner, self.planners, "weight")
            _known("place", self.weight.place, self.places, "weight")
        if self.gap is not None:
            _known("planner", self.gap.worst, self.planners, "gap")
            if self.gap.best is not None:
                _known("planner", self.gap.best, self.planners, "gap")
            if self.gap.worst == self.gap.best:
                raise ValueError("gap: 'worst' and 'best' are the same planner")
        if self.flow_time is not None:
            _known("planner", self.flow_time, self.planners, "flow_time")
        known = [m.name for m in (*METRICS, *COUNTED)]
        for metric in (*self.metrics, *(p.metric for p in self.published)):
            _known("metric", metric, known, "metrics")
        for target in self.targets:
            more = [] if self.gap is None else [m.name for m in BETWEEN]
            _known("metric", target.metric, [*known, *more], "targets")
        return self


class Unit(NamedTuple):
    """One run of an experiment."""

    place: str
    planner: str
    """Label; of a sweep's run 'label key=value'."""
    seed: int
    scenario: Scenario


def _known(kind: str, name: str, valid: Any, where: str) -> None:
    if name not in valid:
        raise ValueError(f"{where}: unknown {kind} '{name}'{nearest_hint(name, valid)}")


def shipped_experiments() -> list[str]:
    """Return the names of the experiments that come with the package."""
    folder = files("swarmscope") / "data" / "experiments"
    return sorted(entry.name.removesuffix(".yaml") for entry in folder.iterdir() if entry.name.endswith(".yaml"))


def shipped_experiment(name: str) -> Path:
    """Return the file of an experiment that comes with the package."""
    if name not in shipped_experiments():
        raise UnknownNameError("experiment", name, shipped_experiments())
    return Path(str(files("swarmscope") / "data" / "experiments" / f"{name}.yaml"))


def load_experiment(path: Path, preset: str | None = None) -> Experiment:
    """Return the experiment in YAML file ``path``, every scenario of it checked.

    With a ``preset`` it is an experiment of its own: name and title say so, figures published are the same.
    """
    values = read_yaml(path)
    if isinstance(values, dict):
        if preset is not None:
            values |= {"preset": preset, "name": f"{values.get('name')}-{preset}"}
            values["title"] = f"{values.get('title')} (preset {preset})"
        for keys in _scenarios_in(values):
            find_user_files(keys, path.parent)
    return parse_experiment(values, str(path))


def _scenarios_in(values: Keys) -> list[Keys]:
    """Return the keys of scenarios in an experiment that is not checked yet."""
    groups = [values.get("scenario"), *_values_of(values.get("places")), *_values_of(values.get("planners"))]
    return [keys for keys in groups if isinstance(keys, dict)]


def _values_of(group: Any) -> list[Any]:
    return list(group.values()) if isinstance(group, dict) else []


def parse_experiment(values: Any, where: str) -> Experiment:
    """Return the experiment in ``values``; a ConfigError names place, problem and the nearest valid key."""
    if not isinstance(values, dict):
        raise ConfigError(where, "an experiment is a mapping of keys to values")
    try:
        experiment = Experiment.model_validate(values)
    except ValidationError as error:
        raise _first_problem(error, where) from None
    try:
        seeds = seed_set(experiment.seeds)
    except ConfigError as error:
        raise ConfigError(f"{where}: {error.where}", error.why) from None
    except UnknownNameError as error:
        raise UnknownNameError(error.kind, error.name, error.valid, f"{where}: seeds") from None
    _check_preset(experiment, where)
    for place, planner, keys in _variants(experiment):
        parse_scenario(keys | {"seed": seeds[0]}, f"{where}: {place}, {planner}")
    return experiment


def units(experiment: Experiment, maps: int | None = None) -> list[Unit]:
    """Return every run, planner by planner, the first ``maps`` seeds of each.

    Runs in one world lie far apart: what the first planner's run finds out about it (reference ways) is known to
    the others.
    """
    seeds = seed_set(experiment.seeds)[:maps]
    found = []
    for place, planner, keys in _variants(experiment):
        first = parse_scenario(keys, f"{experiment.name}: {place}, {planner}")
        found += [Unit(place, planner, seed, first.model_copy(update={"seed": seed})) for seed in seeds]
    return found


def _variants(experiment: Experiment) -> list[tuple[str, str, Keys]]:
    """Return (place, label, scenario keys) of every planner and of every value of every sweep, in every place."""
    labels: list[tuple[str, Keys]] = [(label, planner_keys(experiment, label)) for label in experiment.planners]
    for sweep in experiment.sweeps:
        for value in sweep.values:
            changed = copy.deepcopy(planner_keys(experiment, sweep.planner))
            set_path(changed, sweep.key, value)
            labels.append((sweep_label(sweep, value), changed))
    common = {"record_scans": "no"} | experiment.scenario
    return [
        (place, label, merged(merged(common, place_keys), keys))
        for label, keys in labels
        for place, place_keys in experiment.places.items()
    ]


def planner_keys(experiment: Experiment, label: str) -> Keys:
    """Return the keys of a planner of the experiment, with the experiment's preset if the planner has it."""
    keys = experiment.planners[label]
    if experiment.preset is None or experiment.preset not in _presets_of(keys):
        return keys
    return merged({"planner": {"preset": experiment.preset}}, keys)


def _presets_of(keys: Keys) -> list[str]:
    """Return the presets of the planner that the keys name, none where they name none that is known."""
    group = keys.get("planner")
    name = group.get("name", "nav-scope") if isinstance(group, dict) else ""
    return list(load_planner(name).presets) if name in planner_names() else []


def _check_preset(experiment: Experiment, where: str) -> None:
    known = sorted({preset for keys in experiment.planners.values() for preset in _presets_of(keys)})
    if experiment.preset is not None and experiment.preset not in known:
        raise UnknownNameError("preset", experiment.preset, known, f"{where}: preset")


def sweep_label(sweep: Sweep, value: float) -> str:
    """Return the label of one value of a sweep."""
    return f"{sweep.planner} {sweep.name}={value:g}"


def merged(base: Keys, over: Keys) -> Keys:
    """Return ``base`` with the keys of ``over``, group by group."""
    both = copy.deepcopy(base)
    for key, value in over.items():
        here = both.get(key)
        both[key] = merged(here, value) if isinstance(here, dict) and isinstance(value, dict) else copy.deepcopy(value)
    return both


def set_path(keys: Keys, path: str, value: Any) -> None:
    """Set ``a.b.c`` in nested mappings."""
    *groups, last = path.split(".")
    for group in groups:
        keys = keys.setdefault(group, {})
        if not isinstance(keys, dict):
            raise ConfigError(path, f"'{group}' is not a group of keys")
    keys[last] = value


def _first_problem(error: ValidationError, where: str) -> ConfigError:
    """Turn pydantic's first error into ours."""
    problem = error.errors()[0]
    place = ".".join(str(p) for p in problem["loc"]) or "(top)"
    message = str(problem["msg"]).removeprefix("Value error, ")
    if problem["type"] == "extra_forbidden":
        kinds: dict[str, type[BaseModel]] = {
            "sweeps": Sweep, "published": Published, "targets": Target, "weight": WeightEstimate,
            "gap": Gap,
        }  # fmt: skip
        model = kinds.get(str(problem["loc"][0]), Experiment) if len(problem["loc"]) > 1 else Experiment
        message = f"unknown key{nearest_hint(str(problem['loc'][-1]), model.model_fields)}"
    return ConfigError(f"{where}: {place}", message)



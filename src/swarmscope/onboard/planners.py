"""What a planner is, and how one is found by its name.

A planner file defines ``NAME``, ``SUMMARY`` and ``NEEDS`` (what it is given); ``Params``, a NamedTuple of numbers with
defaults; ``MEMORY``, the dtype of what one robot remembers; and ``decide(see, memory, params)``, compiled or not, which
runs once a tick for each robot between perception and guard (``tick.py``). It may define

``new_memory(robots)``  fresh memory that is not all zeros
``REASONS``             words of its own for why a robot does what it does; their codes begin at ``reasons.FIRST_OWN``
``VARIANTS``            planners that differ from it by fixed parameters: a mapping of names to ``Variant``
``decide_all(first, last, swarm, memories, params)``  instead of ``decide``: all robots at once, for libraries
``PRESETS``             keys of a scenario that hold where it says nothing (``planner.preset``): for each name a
                        mapping such as ``{"safety.sector": True}``; ``printed`` is what the document prints
``FEATURE_MASK``        which extrema its document masks (``features.MASK_MAXIMA`` unless it says so)
``check_available()``   raises an error where a library or a model is missing
``MODELS``              of planners that run a network: the ``network.model.Model`` of each, which ``decide_all`` is
                        given after ``params``
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from swarmscope.bounds import Field, converted, fields_of
from swarmscope.errors import ConfigError, InputFileError
from swarmscope.held import Held
from swarmscope.members import Kind, Need, check, find, is_text, load, names_of, text
from swarmscope.onboard.loops import Step, batch_step, compiled_step, is_compiled, plain_step
from swarmscope.onboard.perception.features import MASK_MAXIMA, MASKS
from swarmscope.onboard.reasons import REASON_NAMES, STATE_NAMES
from swarmscope.onboard.tick import guard_all, perceive_all
from swarmscope.onboard.view import Swarm
from swarmscope.user_files import guarded

STILL_S = 0.6
"""A neighbour that has not moved for so long [s] is an obstacle, for planners without a parameter ``still_s``."""
NOTHING = np.dtype([("nothing", np.uint8)])
"""Memory of planners that remember nothing."""


class Variant(NamedTuple):
    """A planner that differs from its file's first one by numbers."""

    summary: str
    needs: str
    fixed: Mapping[str, float] = {}
    """Parameters that nobody can set."""
    told: bool = False
    """It is told the side of the shortest way, in ``memory["told"]``: an oracle, not for robots."""


class NoParams(NamedTuple):
    """Parameters of planners that have none of their own."""

    still_s: float = STILL_S
    """A neighbour that has not moved for so long is an obstacle."""


@dataclass(frozen=True)
class Planner:
    """A planner, whatever its file leaves out filled in."""

    name: str
    summary: str
    needs: str
    module: ModuleType = field(repr=False)
    fixed: Mapping[str, float] = field(default_factory=dict)
    told: bool = False
    model: Any = None
    """Its network (``network.model.Model``), None without."""

    @property
    def params_type(self) -> Any:
        """Its ``Params``."""
        return getattr(self.module, "Params", NoParams)

    @cached_property
    def fields(self) -> dict[str, Field]:
        """What can be set."""
        every = fields_of(self.params_type, f"planner '{self.name}'")
        return {name: field for name, field in every.items() if name not in self.fixed}

    @property
    def defaults(self) -> dict[str, Any]:
        """What can be set, with defaults."""
        return {name: field.default for name, field in self.fields.items()}

    def settings(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return everything that can be set, with ``values`` set; errors name key, value, bounds and unit."""
        for key in values:
            if key in self.fixed:
                raise ConfigError(f"planner '{self.name}': {key}", f"is fixed at {self.fixed[key]:g}")
        return dict(converted(self.fields, values, f"planner '{self.name}'", "parameter"))

    def params(self, values: Mapping[str, Any] | None = None) -> Any:
        """Return its parameters with ``values`` set."""
        kinds = self.params_type._field_defaults
        fixed = {name: type(kinds[name])(value) for name, value in self.fixed.items()}
        return self.params_type(**fixed, **self.settings(values or {}))

    @property
    def is_told(self) -> bool:
        """Whether its memory has a place for the side of the shortest way, and it may look there."""
        return self.told or "told" in self.params_type._fields

    def new_memory(self, robots: int) -> np.ndarray:
        """Return the memory of ``robots`` robots that have seen nothing yet."""
        make = getattr(self.module, "new_memory", None)
        memory: np.ndarray = np.zeros(robots, getattr(self.module, "MEMORY", NOTHING)) if make is None else make(robots)
        return memory

    @property
    def presets(self) -> dict[str, dict[str, Any]]:
        """Its sets of keys by name, without the parameters that are fixed."""
        fixed = {f"planner.params.{name}" for name in self.fixed}
        every: Mapping[str, Mapping[str, Any]] = getattr(self.module, "PRESETS", {})
        return {name: {key: keys[key] for key in keys if key not in fixed} for name, keys in every.items()}

    @property
    def feature_mask(self) -> int:
        """Which extrema of a scan count in safe directions only, as its document has it (7)."""
        return int(getattr(self.module, "FEATURE_MASK", MASK_MAXIMA))

    @property
    def reasons(self) -> tuple[str, ...]:
        """The words for its reasons, by their codes."""
        return (*REASON_NAMES, *getattr(self.module, "REASONS", ()))

    @cached_property
    def _step(self) -> Step:
        decide_all = getattr(self.module, "decide_all", None)
        if decide_all is not None:
            return batch_step(decide_all, *([] if self.model is None else [self.model]))
        if is_compiled(self.module.decide):
            return compiled_step(self.module.decide, self.module)
        return plain_step(self.module.decide)

    def step_all(self, first: int, last: int, held: Held[Swarm], memories: np.ndarray, params: Any) -> None:
        """Run one tick of robots ``first`` to ``last - 1``, from scan to command; for none it loads the kernels.

        What is wrong with a planner from outside raises InputFileError with its file and line.
        """
        still_s = float(getattr(params, "still_s", STILL_S))
        if not self._from_outside:
            self._step(first, last, held, memories, params, still_s)
            return
        guarded(lambda: self._step(first, last, held, memories, params, still_s), self._place)
        self._check_words(held.what.decisions[first:last])

    @property
    def _place(self) -> Path:
        """Its file, or the name of a module that has none."""
        return Path(getattr(self.module, "__file__", None) or self.module.__name__)

    @property
    def _from_outside(self) -> bool:
        """Whether its file is not one of this package."""
        return not self.module.__name__.startswith("swarmscope.")

    def _check_words(self, decisions: np.ndarray) -> None:
        """Raise InputFileError when a decision has a state or a reason for which there are no words."""
        for what, names in (("state", STATE_NAMES), ("reason", self.reasons)):
            if (decisions[what] >= len(names)).any():
                why = f"decide set {what} {decisions[what].max()}, there are 0 to {len(names) - 1}"
                raise InputFileError(self._place, why)

    @property
    def kernels(self) -> tuple[Any, ...]:
        """The kernels that are compiled when it first runs."""
        if is_compiled(self._step):
            return (self._step,)
        own = (getattr(self.module, name, None) for name in ("prepare_all", "command_all"))
        return (perceive_all, guard_all, *(kernel for kernel in own if kernel is not None))

    def check_available(self) -> None:
        """Raise an error when its library or its network is not here."""
        check = getattr(self.module, "check_available", None) if self.model is None else self.model.check
        if check is not None:
            check()

    def with_model(self, folder: Path | str) -> Planner:
        """Return the same planner with the network in ``folder``; raises ConfigError for one that runs none."""
        if self.model is None:
            raise ConfigError(f"planner '{self.name}'", "runs no network")
        return replace(self, model=self.model.at(folder))


@cache
def planners_in(module: ModuleType) -> tuple[Planner, ...]:
    """Return the planners of a file: the one that it is named for, and its variants."""
    _name_params(module)
    models = getattr(module, "MODELS", {})
    variants = getattr(module, "VARIANTS", {})
    first = Variant(module.SUMMARY, module.NEEDS)
    return tuple(
        Planner(name, variant.summary, variant.needs, module, variant.fixed, variant.told, models.get(name))
        for name, variant in {module.NAME: first, **variants}.items()
    )


def _name_params(module: ModuleType) -> None:
    """Name a file's ``Params`` after it.

    Numba tells named tuples apart by class name and types of the fields only: two planners' ``Params`` with equally
    many floats would be one type, and every call of the one loaded later would take a detour of 0.7 ms.
    """
    kind = getattr(module, "Params", None)
    if kind is not None and kind.__name__ == "Params":
        kind.__name__ = f"Params_{module.__name__.rpartition('.')[2]}"


def _is_dtype(value: Any) -> bool:
    return isinstance(value, np.dtype) and value.names is not None


def _takes(value: Any, count: int) -> bool:
    """Tell whether this can be called with so many arguments."""
    try:
        inspect.signature(getattr(value, "py_func", value)).bind(*[None] * count)
    except (TypeError, ValueError):
        return False
    return True


def _is_params(value: Any) -> bool:
    return isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_field_defaults")


def _is_presets(value: Any) -> bool:
    """Tell whether this is a mapping of names to mappings of keys."""
    return isinstance(value, Mapping) and all(
        isinstance(keys, Mapping) and all(map(is_text, (name, *keys))) for name, keys in value.items()
    )


KIND = Kind(
    word="planner",
    package="swarmscope.onboard.planning",
    group="swarmscope.planners",
    needs=(text("NAME"), text("SUMMARY"), text("NEEDS")),
)
OPTIONAL = (
    Need("Params", "a NamedTuple with defaults", _is_params),
    Need("MEMORY", "a numpy dtype with fields", _is_dtype),
    Need("decide", "a function (see, memory, params)", lambda v: _takes(v, 3)),
    Need("decide_all", "a function (first, last, swarm, memories, params)", lambda v: _takes(v, 5) or _takes(v, 6)),
    Need("new_memory", "a function (robots)", callable),
    Need("FEATURE_MASK", "one of features.UNMASKED, MASK_MAXIMA, MASK_ALL", lambda v: v in MASKS.values()),
    Need("PRESETS", "a mapping of names to keys of a scenario and their values", _is_presets),
    Need("REASONS", "a tuple of texts", lambda v: isinstance(v, tuple) and all(map(is_text, v))),
)


def planner_names() -> list[str]:
    """Return the names of all planners."""
    return names_of(KIND)


def planner_file(name: str) -> Path:
    """Return the file of a planner, without importing it."""
    return find(KIND, name).file


def all_planners() -> dict[str, Planner]:
    """Return every planner by its name, in alphabetical order."""
    return {name: load_planner(name) for name in planner_names()}


def load_planner(name: str) -> Planner:
    """Return the planner called ``name``, or the one in a ``FILE.py``.

    Errors: UnknownNameError with the nearest name; InputFileError for a file that defines no planner.
    """
    module = load(KIND, name)
    optional = tuple(need for need in OPTIONAL if hasattr(module, need.name))
    check(module, KIND._replace(needs=optional), Path(str(module.__file__)))
    if not hasattr(module, "decide") and not hasattr(module, "decide_all"):
        raise InputFileError(str(module.__file__), "has no decide(see, memory, params), which every planner defines")
    found = {planner.name: planner for planner in planners_in(module)}
    return found.get(name, found[module.NAME])

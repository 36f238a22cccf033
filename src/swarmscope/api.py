"""The front door for scripts and notebooks: ``simulate``, ``load_run`` and the ``Run`` that both return."""

from __future__ import annotations

import os
import sys
import tempfile
import webbrowser
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from swarmscope.errors import ConfigError, InputFileError, nearest_hint
from swarmscope.experiments.warm_up import COMPILING, kernels_are_cold
from swarmscope.judging.references import References, reference_ways
from swarmscope.judging.run import Contents, contents, play
from swarmscope.judging.run_folder import WORLD, read_config, read_user_files, read_world, write_run
from swarmscope.judging.run_names import headline
from swarmscope.scenarios.overrides import choose, leave_only, override
from swarmscope.scenarios.plain import plain
from swarmscope.scenarios.read import parse_scenario, read_scenario_file
from swarmscope.scenarios.scenario import Scenario
from swarmscope.sim.world import WorldSpec
from swarmscope.tasks import Setup
from swarmscope.viewing.frames import as_frame, check_frame, robot_columns, tick_columns
from swarmscope.viewing.pictures import write_picture
from swarmscope.viewing.progress import QUIET_S, progress_bar
from swarmscope.viewing.replay import write_replay
from swarmscope.viewing.run_data import ONLY_WHERE_THINGS_MOVE
from swarmscope.viewing.run_data import load_run as read_run
from swarmscope.viewing.trace import Trace

Place = str | Path | Mapping[str, Any] | Scenario
"""Where to run: the name of a task, a scenario file (.yaml), or a scenario, checked or not."""
KEY_FIGURES = (
    ("arrival_rate", "{:.1%} arrived"),
    ("collisions", "{:.0f} collisions"),
    ("path_redundancy", "path redundancy {:.2%}"),
    ("duration_s", "last arrival {:.1f} s"),
)


class _Figures(dict[str, Any]):
    """The figures by name; a KeyError names the nearest."""

    def __missing__(self, name: str) -> Any:
        """Say which figures there are."""
        raise KeyError(f"no figure '{name}'{nearest_hint(str(name), sorted(self))}")


class Run:
    """A finished run: what was asked for, what happened, and how to look at it."""

    def __init__(self, found: Contents, references: References | None = None) -> None:
        self._found, self._references = found, references
        self._metrics = _Figures(found.metrics)

    @property
    def scenario(self) -> dict[str, Any]:
        """The complete scenario, every default written out, as in ``config.yaml``."""
        return self._found.config

    @property
    def metrics(self) -> dict[str, Any]:
        """The figures, as in ``metrics.json``."""
        return self._metrics

    @property
    def world(self) -> dict[str, Any]:
        """Bounds, obstacles, and each robot's start and goal, as in ``world.json``."""
        return self._found.world

    @cached_property
    def trace(self) -> Trace:
        """What happened: the arrays of ``trajectory.npz`` by name."""
        return Trace(self._found.trajectory)

    def frame(self, of: str = "robots") -> Any:
        """Return a pandas DataFrame with a row for each robot, or, of ``"ticks"``, for each tick and robot."""
        check_frame(of)
        return as_frame(tick_columns(self.trace) if of == "ticks" else self.robots)

    @cached_property
    def robots(self) -> dict[str, np.ndarray]:
        """One row for each robot as columns: start, goal, shortest way, way travelled, arrival, reason at the end."""
        return robot_columns(self.trace, self.world, self._shortest_m())

    def show(self, open: bool = True) -> Path:
        """Open the replay page in the browser and return its path; without a browser print it."""
        page = self._page
        if open and not (_has_display() and webbrowser.open(page.as_uri())):
            print(page)
        return page

    def save(self, folder: Path | str, pictures: bool = True) -> Path:
        """Write the run folder that ``swarmscope run`` writes and return its path; an earlier run there is replaced."""
        return write_run(Path(folder), *self._found, add_pictures if pictures else None)

    @cached_property
    def _page(self) -> Path:
        """The replay page, in a folder for temporary files."""
        folder = Path(tempfile.mkdtemp(prefix="swarmscope-"))
        return write_replay(self.save(folder / "run", pictures=False))

    def _shortest_m(self) -> np.ndarray:
        """Return the shortest ways (N,): true ones, A* on the grid where those were not found."""
        radii = [robot["radius"] for robot in self.world["robots"]]
        found = self._references or reference_ways(_setup_of(self.world), radii)
        self._references = found
        exact = np.isfinite(found.any_angle_m).any()
        return found.any_angle_m if exact else found.shortest_m

    def __repr__(self) -> str:
        """Return one line with the key figures."""
        about, values = self.metrics.get("run") or {}, self.metrics
        figures = [form.format(values[key]) for key, form in KEY_FIGURES if values.get(key) is not None]
        return f"<Run {headline(about, len(self.world['robots']))}: {', '.join(figures)}>"


def simulate(
    place: Place = "T1",
    *,
    planner: str | None = None,
    robots: int | None = None,
    seed: int | None = None,
    progress: bool = True,
    **overrides: Any,
) -> Run:
    """Run one scenario and return what came out.

    ``place`` is a task's name, a scenario file, a mapping or a ``Scenario``. What is not given is as the file says,
    else nav-scope, 15 robots, seed 0 (docs/scenario.md). ``overrides`` are keys of a scenario, with ``__`` for the
    dot (``robot__v_max_mps=1.0``) or as groups (``robot={"v_max_mps": 1.0}``). A run that takes longer than two
    seconds shows its progress on a terminal. Errors: children of ``SwarmscopeError``, as on the command line.
    """
    scenario = _scenario(place, {"planner": planner, "robots": robots, "seed": seed}, overrides)
    with _reporting(scenario, progress and sys.stderr.isatty()) as report:
        outcome = play(scenario, progress=report)
    return Run(_as_read(contents(outcome)), outcome.references)


def load_run(folder: Path | str) -> Run:
    """Return the run in a run folder, as ``simulate`` returned it; errors: InputFileError."""
    data = read_run(Path(folder))
    recorded = data.trajectory._asdict().items()
    arrays = {name: array for name, array in recorded if name not in ONLY_WHERE_THINGS_MOVE or array.size}
    files = read_user_files(data.folder)
    return Run(Contents(read_config(data.folder), read_world(data.folder), arrays, data.metrics, files))


def add_pictures(folder: Path) -> None:
    """Add the picture and the replay page to a run folder."""
    write_picture(folder)
    write_replay(folder)


def _scenario(place: Place, options: Mapping[str, Any], overrides: Mapping[str, Any]) -> Scenario:
    """Return the scenario of ``place``, changed by ``options`` and then by ``overrides``."""
    where = str(place) if _is_file(place) else "simulate"
    values = _values_of(place)
    if options["planner"] is not None:
        choose(values, "planner", "name", options["planner"])
    values |= {key: plain(options[key]) for key in ("robots", "seed") if options[key] is not None}
    if any(name.partition("__")[0] == "map" for name in overrides):
        leave_only(values, "map")
    override(values, overrides, where)
    return parse_scenario(values, where)


def _is_file(place: Place) -> bool:
    return isinstance(place, Path) or (isinstance(place, str) and place.endswith((".yaml", ".yml")))


def _values_of(place: Place) -> dict[str, Any]:
    """Return the scenario as nested mappings of its own, not checked yet."""
    if isinstance(place, Scenario):
        return place.model_dump(mode="json", exclude_none=True)
    if isinstance(place, Mapping):
        return dict(plain(place))
    if _is_file(place):
        return read_scenario_file(Path(place))
    if isinstance(place, str):
        return {"task": {"name": place}}
    raise ConfigError("simulate", f"needs a task's name, a scenario file or a scenario, not {type(place).__name__}")


@contextmanager
def _reporting(scenario: Scenario, wanted: bool) -> Iterator[Callable[[float, int], None] | None]:
    """Say how far the run is, if that is wanted and it takes long."""
    if not wanted:
        yield None
        return
    if kernels_are_cold(scenario.planner.name):
        print(COMPILING, file=sys.stderr)
    with progress_bar(scenario, QUIET_S) as report:
        yield report


def _as_read(found: Contents) -> Contents:
    """Return the contents as they are read back from a run folder: plain numbers, None for what is not finite."""
    config, world, metrics = (
        plain(part, finite=finite)
        for part, finite in ((found.config, False), (found.world, True), (found.metrics, True))
    )
    return Contents(config, world, found.trajectory, metrics, found.files)


def _setup_of(world: Mapping[str, Any]) -> Setup:
    """Return world, starts and goals that ``world.json`` holds."""
    try:
        spec = WorldSpec.model_validate({"obstacles": world["obstacles"], "bounds": world["bounds"]})
    except ValidationError as error:
        raise InputFileError(WORLD, str(error.errors()[0]["msg"])) from None
    starts, goals = (np.array([robot[key] for robot in world["robots"]], float) for key in ("start", "goal"))
    return Setup(spec, starts, goals)


def _has_display() -> bool:
    """Tell whether a browser can show anything: without a display Python would start a text browser."""
    if not sys.platform.startswith("linux"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or os.environ.get("BROWSER"))

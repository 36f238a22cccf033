"""An MCAP file for a run that is being played, or from the folder of one that was."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

from swarmscope.errors import ConfigError, MissingExtraError
from swarmscope.judging.run_folder import CONFIG, read_config
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.scenario import Scenario
from swarmscope.viewing.bag.exact import Exact
from swarmscope.viewing.progress import progress_bar, steps_bar
from swarmscope.viewing.run_data import load_run

NAME = "run.mcap"
"""What the file is called in a run folder."""


def check_packages() -> None:
    """Raise a MissingExtraError unless what writes MCAP files is installed."""
    if find_spec("mcap") is None or find_spec("rosbags") is None:
        raise MissingExtraError("an MCAP file", "bags")


def adder(exact: Exact) -> Callable[[Path], None]:
    """Return what adds the file to the folder of the run that ``exact`` looked on."""
    return lambda folder: _write(folder, exact, folder / NAME)


def scenario_of(run_dir: Path) -> Scenario:
    """Return the scenario of a finished run."""
    return parse_scenario(read_config(run_dir), str(run_dir / CONFIG))


def make_mcap(run_dir: Path, scenario: Scenario, out: Path | None = None, threads: int = 1) -> Path:
    """Play a finished run of ``scenario`` again and write its MCAP file; its folder is where it lies by default."""
    from swarmscope.viewing.bag.again import play_again

    path = run_dir / NAME if out is None else out
    if path.suffix != ".mcap":
        raise ConfigError(str(path), "an MCAP file's name ends with .mcap")
    if not path.parent.is_dir():
        raise ConfigError(str(path.parent), "no such folder")
    found = load_run(run_dir)
    with progress_bar(scenario, 0.0) as progress:
        exact = play_again(found, scenario, threads, progress)
    _write(run_dir, exact, path)
    return path


def _write(run_dir: Path, exact: Exact, path: Path) -> None:
    from swarmscope.viewing.bag.file import write_mcap

    with steps_bar(path.name) as progress:
        write_mcap(load_run(run_dir), exact, path, progress)

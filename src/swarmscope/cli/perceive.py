"""``swarmscope perceive``."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.table import Table

from swarmscope.cli._console import PlainConsole
from swarmscope.errors import ConfigError
from swarmscope.experiments.lay_out_scans import Use
from swarmscope.experiments.perceive import Perception, perceive, write_features
from swarmscope.scenarios.overrides import set_key, set_path
from swarmscope.scenarios.read import parse_scenario, read_scenario_file
from swarmscope.scenarios.to_kernels import sheet_of, sigmas_of
from swarmscope.sim.scan_files import ScanLog, load_scans, scan_file
from swarmscope.sim.scan_read import Ask

LIDAR_KEYS = ("range_m", "range_min_m")
GROUPS = ("robot", "guard", "safety", "noise", "radio")
"""What of a scenario says how a robot perceives."""


def perceive_command(scans: str, out: Path | None, ask: Ask, use: Use) -> None:
    """Print what a robot makes of recorded scans; with ``out`` write features and a picture there."""
    if out is not None and out.exists() and not out.is_dir():
        raise ConfigError(f"--out {out}", "is a file; features and the picture go into a folder")
    log = load_scans(scan_file(scans), ask)
    for note in log.notes:
        print(f"{scans}: {note}", file=sys.stderr)
    seen = perceive(log, use)
    _print_table(log, seen)
    if seen.counts.below_blocks.any():
        print("readings below range_min block; where zeros mean that there was no return: --no-return 0")
    if seen.counts.inside.any():
        print("returns from within the robot block; where it sees its own posts: --mask FROM..TO")
    if out is not None:
        for path in write_results(out, seen, log.name):
            print(path)


def sheet_of_options(
    scenario: Path | None, changes: Sequence[str], range_m: float | None, radius_m: float | None
) -> Use:
    """Return the robot's data sheet: of a scenario file, changed by key.path=value, ``--range`` and ``--radius``."""
    values = {} if scenario is None else read_scenario_file(scenario)
    for change in changes:
        _check_matters(change)
        set_key(values, change)
    if radius_m is not None:
        set_path(values, ["robot", "radius_m"], radius_m, "--radius")
        set_path(values, ["robot", "half_width_m"], radius_m, "--radius")
    if range_m is not None:
        set_path(values, ["lidar", "range_m"], range_m, "--range")
    if scenario is None:
        values |= {"task": {"name": "T1"}, "planner": {"name": "nav-scope"}}
    checked = parse_scenario(values, "perceive" if scenario is None else str(scenario))
    body, guarding, safety, sharing = sheet_of(checked)
    range_sigma, position_sigma = sigmas_of(checked)
    return Use(
        range_m=checked.lidar.range_m,
        range_min_m=checked.lidar.range_min_m,
        body=body,
        guarding=guarding,
        safety=safety,
        sharing=sharing,
        range_sigma=range_sigma,
        position_sigma=position_sigma,
    )


def _check_matters(change: str) -> None:
    """Raise a ConfigError when a change is of what has no part in this."""
    group, _, rest = change.partition("=")[0].partition(".")
    if group == "lidar" and rest not in LIDAR_KEYS:
        raise ConfigError(f"--set {change}", "the recording says it; of the LiDAR only range_m and range_min_m count")
    if group not in (*GROUPS, "lidar"):
        raise ConfigError(f"--set {change}", f"has no part in perception; keys are of {', '.join((*GROUPS, 'lidar'))}")


def read_mask(text: str) -> tuple[float, float]:
    """Return FROM..TO [degrees]."""
    first, dots, last = text.partition("..")
    try:
        mask = float(first), float(last)
    except ValueError:
        dots = ""
    if not dots or not np.isfinite(mask).all():
        raise ConfigError(f"--mask {text}", "must look like FROM..TO, degrees counter-clockwise from straight ahead")
    return mask


def write_results(out: Path, seen: Perception, title: str) -> tuple[Path, Path]:
    """Write ``features.csv`` and ``perceive.png`` into folder ``out`` and return their paths."""
    from swarmscope.viewing.perceive_picture import write_perceive_picture

    table = write_features(out / "features.csv", seen)
    return table, write_perceive_picture(out / "perceive.png", seen, title)


def _print_table(log: ScanLog, seen: Perception) -> None:
    scans, beams = seen.safe.shape
    fov = np.degrees(seen.rig.sensor.increment * (beams if seen.rig.sensor.wraps else beams - 1))
    safe = seen.safe.sum(axis=1)
    found = np.array([len(pairs) for pairs in seen.features])
    table = Table(title=log.name, show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    table.add_row("scans", f"{scans}")
    table.add_row("beams of a scan", f"{beams} over {fov:.0f} degrees")
    table.add_row("range used", f"{seen.rig.sensor.range_max:g} m")
    for name, words in _counted(log, seen):
        table.add_row(name, words)
    table.add_row("safe directions, mean per scan", f"{safe.mean():.1f} of {beams}")
    table.add_row("scans without any", f"{int((safe == 0).sum())}")
    table.add_row("features, mean and most", f"{found.mean():.1f}, {found.max()}")
    table.add_row("message, mean and most", f"{seen.packet_bytes.mean():.1f}, {seen.packet_bytes.max()} bytes")
    for percent, words in ((50, "median"), (99, "99 %")):
        table.add_row(f"time of a scan, {words}", f"{np.percentile(seen.us, percent):.2f} us")
    PlainConsole().print(table)


def _counted(log: ScanLog, seen: Perception) -> list[tuple[str, str]]:
    """Return rows that say what was wrong with the readings, and what was done."""
    counts, beams = seen.counts, seen.safe.shape[1]
    rows = [("no return, mean per scan", f"{_few(counts.open.mean())} of {beams}")]
    least = f"{seen.rig.sensor.range_min:g} m"
    for name, found, blocks in (
        ("the robot itself, mean per scan", counts.own, counts.own_blocks),
        ("broken, mean per scan", counts.broken, counts.broken_blocks),
        (f"below range_min ({least}) or in the body", counts.below, counts.below_blocks),
    ):
        if found.any():
            rows.append((name, _done(found, blocks, beams)))
    if counts.inside.any():
        words = f"{_few(counts.inside.mean())} of {beams}"
        rows.append((f"within the robot's radius ({seen.rig.body.radius_m:g} m)", words))
    if counts.moved:
        rows.append(("put right for the robot's own motion", f"{counts.moved}"))
    elif log.time_increment != 0.0:
        sweep = abs(log.time_increment) * (log.ranges_m.shape[1] - 1)
        rows.append(("not put right for motion", f"a scan takes {sweep:.3g} s; see --speed, --turn-rate"))
    if counts.turned:
        rows.append(("scans along other rays than most", f"{counts.turned}"))
    return rows


def _done(found: np.ndarray, blocks: np.ndarray, beams: int) -> str:
    """Return how many readings were bridged, and how many block."""
    parts = ((found - blocks).mean(), "bridged"), (blocks.mean(), "block")
    done = ", ".join(f"{_few(number)} {what}" for number, what in parts if number > 0.0)
    return f"{_few(found.mean())} of {beams}: {done}"


def _few(number: float) -> str:
    return f"{round(number, 1 if number >= 0.1 else 3):g}"

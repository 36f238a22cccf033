"""``swarmscope perceive``."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from rich.table import Table

from swarmscope.cli._console import PlainConsole
from swarmscope.errors import ConfigError
from swarmscope.experiments.perceive import Perception, Use, perceive, write_features
from swarmscope.sim.scan_files import ScanLog, load_scans, scan_file


def perceive_command(scans: str, out: Path | None, use: Use) -> None:
    """Print what a robot makes of recorded scans; with ``out`` write features and a picture there."""
    log = load_scans(scan_file(scans))
    for note in log.notes:
        print(f"{scans}: {note}", file=sys.stderr)
    seen = perceive(log, use)
    _print_table(log, seen)
    if out is not None:
        for path in write_results(out, seen, log.name):
            print(path)


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
    if seen.masked:
        table.add_row("beams that see the robot itself", f"{seen.masked}, bridged")
    if seen.below.any():
        words = f"{seen.below.mean():.1f} of {beams}, wide holes block (--no-return 0: they are none)"
        table.add_row("below the shortest range, mean per scan", words)
    broken = seen.broken - seen.below - seen.masked
    if (broken > 0).any():
        table.add_row("broken readings, mean per scan", f"{broken.mean():.1f}, bridged where no body fits")
    table.add_row("safe directions, mean per scan", f"{safe.mean():.1f} of {beams}")
    table.add_row("scans without any", f"{int((safe == 0).sum())}")
    table.add_row("features, mean and most", f"{found.mean():.1f}, {found.max()}")
    table.add_row("message, mean and most", f"{seen.packet_bytes.mean():.1f}, {seen.packet_bytes.max()} bytes")
    for percent, words in ((50, "median"), (99, "99 %")):
        table.add_row(f"time of a scan, {words}", f"{np.percentile(seen.us, percent):.2f} us")
    PlainConsole().print(table)

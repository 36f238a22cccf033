"""What a scenario costs in memory, checked before anything is made: products of keys that each may be large."""

from __future__ import annotations

from swarmscope.errors import ConfigError
from swarmscope.scenarios.scenario import Scenario

MOST_ROUND = 32_000
"""Beams as close as those of the LiDAR, on the whole circle."""
MOST_BEAMS = 100_000_000
"""Of all robots' LiDARs, on the whole circle: 3 GB."""
MOST_ROWS = 500_000_000
"""Robots times ticks: 20 GB."""
MOST_READINGS = 4_000_000_000
"""Robots times ticks times beams that are recorded: 4.5 GB."""


def check_costs(scenario: Scenario, where: str) -> None:
    """Raise a ConfigError that names the keys whose product is too large."""
    lidar, robots = scenario.lidar, scenario.robots
    around = lidar.beams * 360.0 / lidar.fov_deg
    if around > MOST_ROUND:
        why = f"{lidar.beams} beams in {lidar.fov_deg:g} degrees are too close: a whole circle would have {around:.0f}"
        raise ConfigError(f"{where}: lidar.fov_deg", f"{why}, more than {MOST_ROUND}; widen it, or lower lidar.beams")
    if robots * around > MOST_BEAMS:
        why = f"{robots} robots with {lidar.beams} beams each need more than 3 GB"
        raise ConfigError(f"{where}: robots", f"{why}: lower it, or lidar.beams")
    ticks = scenario.limit_s * lidar.rate_hz
    if robots * ticks > MOST_ROWS:
        why = f"{robots} robots for {ticks:.0f} scans need more than 20 GB"
        raise ConfigError(f"{where}: limit_s", f"{why}: lower it, or robots, or lidar.rate_hz")
    if scenario.record_scans == "yes" and robots * ticks * lidar.beams > MOST_READINGS:
        why = f"{robots} robots, {ticks:.0f} scans of {lidar.beams} beams need more than 4 GB"
        raise ConfigError(f"{where}: record_scans", f"{why}: say auto or no, or lower limit_s")

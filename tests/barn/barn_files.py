"""Worlds of our own in the forms of the challenge's files."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from swarmscope.barn.worlds import GOAL, START, metres

CYLINDER = """
    <model name='{name}'>
      <static>1</static>
      <pose frame=''>{pose}</pose>
      <link name='link'>
        <collision name='collision'><geometry>{shape}</geometry></collision>
        <visual name='visual'><geometry><cylinder><radius>9</radius></cylinder></geometry></visual>
      </link>
    </model>"""
GROUND = """
    <include><uri>model://sun</uri></include>
    <model name='ground_plane'>
      <link name='link'><collision name='c'><geometry><plane><size>100 100</size></plane></geometry></collision></link>
    </model>"""
ROUND = "<cylinder><radius>0.075</radius><length>1</length></cylinder>"
WAY = np.array([[15, 0], [15, 10], [16, 20], [15, 29]])
"""Cells of a way through the clutter: column, row."""


def model(x, y, name="unit_cylinder_0", shape=ROUND, pose="{} {} 0 0 0 0"):
    return CYLINDER.format(name=name, pose=pose.format(x, y), shape=shape)


def world_text(*models, more=""):
    return f"<sdf version='1.6'>\n  <world name='default'>{GROUND}{''.join(models)}{more}\n  </world>\n</sdf>\n"


def clutter(seed, count=12):
    """Centres of discs beside and in the way, to the millimetre."""
    rng = np.random.default_rng(seed)
    x = rng.choice([-1.0, 1.0], count) * rng.uniform(0.2, 1.6, count) + START[0]
    return np.column_stack([x, np.linspace(5.0, 10.0, count)]).round(3)


def shut():
    """A ring round the goal: nobody gets in."""
    angles = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    return (np.array(GOAL) + 1.6 * np.column_stack([np.cos(angles), np.sin(angles)])).round(3)


def path_m(cells=WAY):
    points = np.vstack([START[:2], metres(cells.astype(float)), GOAL])
    return float(sum(np.hypot(*(b - a)) for a, b in pairwise(points)))


def write_folder(folder: Path, worlds, paths=True) -> Path:
    """Write ``{number: centres}`` as the challenge does."""
    for place in ("world_files", "path_files"):
        (folder / place).mkdir(parents=True)
    for number, centres in worlds.items():
        models = [model(x, y, f"unit_cylinder_{k}") for k, (x, y) in enumerate(centres)]
        (folder / f"world_files/world_{number}.world").write_text(world_text(*models))
        if paths:
            np.save(folder / f"path_files/path_{number}.npy", WAY)
    return folder


def arrays_of(worlds):
    """The same as arrays of a ``.npz``."""
    centres = list(worlds.values())
    return {
        "world": np.array(list(worlds)),
        "offsets": np.cumsum([0, *map(len, centres)]),
        "centers_m": np.concatenate(centres),
        "radius_m": np.array(0.075),
        "start": np.array(START),
        "goal": np.array(GOAL),
        "path_length_m": np.full(len(centres), path_m()),
    }


def write_npz(file: Path, worlds, **changed) -> Path:
    arrays = {key: value for key, value in (arrays_of(worlds) | changed).items() if value is not None}
    np.savez(file, **arrays)
    return file

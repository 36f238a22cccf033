"""Throw mutated files at the commands: no traceback, nothing over 10 s or 4 GB, every message names file, key or line.

    python tests/fuzz_inputs.py --runs 100000 --seed 1            # in this process
    python tests/fuzz_inputs.py --processes 1000 --seed 1         # each as the command that a user types
    python tests/fuzz_inputs.py --seed 1 --only 4711 --keep here  # one of them again, its files kept

Scenarios, maps, scans, experiments, run folders, worlds of BARN, storms' files and maps of the unit disk are valid at
first; then values become extreme, types change, keys are renamed and given twice, bytes flip, files are torn. A run
that is accepted really begins: its first ticks are played, then it ends as if the time were over. Expensive and valid
is no fault: numbers of robots and sizes between what is cheap and what is refused are not drawn.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import dataclasses
import faulthandler
import functools
import io
import json
import math
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from PIL import Image

SLOW_S, STUCK_S, MOST_GB = 10.0, 120, 4.0
REFUSED, FAULT = 2, 70
"""Exit codes: of a message to the user, and of an error that nobody thought of."""
TICKS = 3
"""Ticks of a run that is accepted."""
TASKS = {
    "T1": {"size_m": 6.0}, "T2": {"size_m": 6.0, "obstacles": "rocks"}, "T3": {"size_m": 6.0}, "swap": {"size_m": 6.0},
    "corridor": {"length_m": 4.0}, "depository": {}, "doorway": {}, "GIWT_1": {"size_m": 12.0, "apart_m": 3.0},
    "GIWT_2": {"size_m": 12.0}, "GIWT_lab": {}, "intersection": {}, "long_wall": {}, "u_trap": {},
}  # fmt: skip
NUMBERS: tuple[Any, ...] = (
    0, -1, 1, 2, 3, 7, 0.5, 1e-300, 1e-9, 1e-4, 1e9, 1e30, 1e300, -1e300, math.nan, math.inf, -math.inf, 2**31, 2**63,
    10**30, -0.0, 4097, 200001, 90000.0, 1e5, 12345678.9,
)  # fmt: skip
OTHERS: tuple[Any, ...] = (
    True, None, "", "x", "1_0", "0x10", "1e3", "yes", "\u0663\u0664", "a\0b", "../..", "/dev/zero", "/dev/null",
    "\U0001f600" * 50, "</script><img src=x onerror=alert(1)>", "x" * 5000,
    [], {}, [1], [[]], {"a": 1}, [None], [[1, 2, 3]] * 3,
    "FIFO", "LOOP", "m.png", "s.yaml", "~nobody/x",
)  # fmt: skip
PLAIN_TEXT = (
    "1_0",
    "1:30",
    "2020-13-45",
    "0o17",
    "!!python/object:os.system x",
    "&a [*a]",
    "*a",
    ".nan",
    "\u00bd",
    "<<: {}",
)
BOMB = "a: &a [1,1,1,1,1,1,1,1,1]\n" + "".join(
    f"{chr(98 + i)}: &{chr(98 + i)} [{','.join(['*' + chr(97 + i)] * 9)}]\n" for i in range(9)
)


DEAR_KEYS = r"robots|size_m|length_m|width_m|room_m|way_m|density|most"
"""Keys whose larger values are valid and expensive."""


class Case(NamedTuple):
    """Files by name, and the words of the command."""

    files: dict[str, bytes]
    words: list[str]


class _EnoughError(Exception):
    """The input was accepted and work has begun."""


# -- valid inputs ----------------------------------------------------------------------------------------------------


def _scenario(rng: random.Random) -> dict[str, Any]:
    values: dict[str, Any] = {"robots": rng.choice([1, 2, 3]), "limit_s": 2.0, "seed": rng.randrange(50)}
    kind = rng.choice(["task", "task", "map", "place"])
    if kind == "task":
        name = rng.choice(list(TASKS))
        values["task"] = {"name": name, "options": dict(TASKS[name])}
        if name == "depository":
            values |= {"robots": 2, "robot": {"radius_m": 0.3, "half_width_m": 0.25}}
    elif kind == "map":
        values["map"] = {"file": rng.choice(["m.yaml", "m.yaml", "m.map", "m.png", "m.npz"]), "min_distance_m": 2.0}
        if values["map"]["file"] != "m.yaml":
            values["map"]["resolution_m"] = 0.1
        if values["map"]["file"] == "m.npz":
            values["map"]["number"] = 7
        if values["map"]["file"] == "m.map" and rng.random() < 0.5:
            values["map"]["trips"] = "m.scen"
        if rng.random() < 0.4:
            values["map"] |= {"starts": [[1.0, 1.0, 0.0], None], "goals": [[3.0, 3.0]]}
    else:
        values |= {"robots": 2, "place": _place()}
    for group, keys in _GROUPS.items():
        if rng.random() < 0.4:
            values.setdefault(group, {})
            values[group] |= {key: value for key, value in keys.items() if rng.random() < 0.5}
    if rng.random() < 0.4:
        values["planner"] = {"name": rng.choice(["nav-scope", "dh-bug", "sfm-mas", "nav-i"]), "params": {}}
        if rng.random() < 0.5:
            values["planner"]["preset"] = "printed"
    if rng.random() < 0.1:
        values["guard"] = False
    return values


def _place() -> dict[str, Any]:
    obstacles = [
        {"type": "circle", "center": [0.0, 2.0], "radius": 0.4},
        {"type": "polygon", "points": [[-1.0, -2.0], [1.0, -2.0], [0.0, -3.0]]},
        {"type": "wall", "points": [[-4.0, 4.0], [4.0, 4.0], [4.0, 3.0]]},
        {
            "type": "grid",
            "resolution": 0.1,
            "origin": [5.0, 5.0],
            "width": 4,
            "height": 3,
            "rows": [[0, 1, 2], [2, 0, 3]],
        },
    ]
    world = {"bounds": [-6.0, -6.0, 6.0, 6.0], "obstacles": obstacles}
    return {"world": world, "starts": [[-3.0, 0.0, 0.0], [-3.0, 1.0, 0.0]], "goals": [[3.0, 0.0], [3.0, 1.0]]}


_GROUPS: dict[str, dict[str, Any]] = {}
"""The keys of a scenario with their defaults, filled once."""


def _fill_groups() -> None:
    from swarmscope.scenarios.scenario import Scenario

    if not _GROUPS:
        dumped = Scenario.model_validate({"task": {"name": "T1"}}).model_dump()
        _GROUPS.update(
            {key: value for key, value in dumped.items() if isinstance(value, dict) and key not in ("task", "planner")}
        )


def _cells() -> np.ndarray:
    cells = np.full((40, 40), 254, np.uint8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1], cells[15:20, 20] = 0, 0, 0, 0, 0
    return cells


def _picture(kind: str) -> bytes:
    file = io.BytesIO()
    Image.fromarray(_cells()).save(file, kind)
    return file.getvalue()


def _npz(**arrays: Any) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def _maps(rng: random.Random) -> dict[str, bytes]:
    about = {"image": rng.choice(["m.png", "m.pgm"]), "resolution": 0.1, "origin": [0.0, 0.0, 0.0], "negate": 0,
             "occupied_thresh": 0.65, "free_thresh": 0.196}  # fmt: skip
    rows = "\n".join("".join("." if cell else "@" for cell in row) for row in _cells())
    maze = np.zeros((1, 40, 40), np.uint8)
    maze[0][_cells() == 0] = 127
    maze[0, 5, 5], maze[0, 30, 30], maze[0, 5, 10], maze[0, 30, 20] = 208, 50, 209, 51
    return {
        "m.yaml": _yaml(about), "m.png": _picture("PNG"), "m.pgm": _picture("PPM"),
        "m.map": f"type octile\nheight 40\nwidth 40\nmap\n{rows}\n".encode(),
        "m.scen": b"version 1\n0\tm.map\t40\t40\t5\t5\t30\t30\t36.0\n0\tm.map\t40\t40\t5\t10\t20\t30\t36.0\n",
        "m.npz": _npz(map=np.array([7]), true=maze),
    }  # fmt: skip


def _scan(rng: random.Random) -> tuple[str, bytes]:
    beams, scans = 60, 4
    ranges = np.round(np.random.default_rng(rng.randrange(99)).uniform(0.5, 4.0, (scans, beams)), 3)
    about = {"angle_min": -math.pi, "angle_increment": 2 * math.pi / beams, "range_min": 0.05, "range_max": 5.0}
    kind = rng.choice(["csv", "npz", "log", "ros"])
    if kind == "npz":
        return "s.npz", _npz(
            ranges=ranges.astype(np.float32), **{key: np.float64(value) for key, value in about.items()}
        )
    if kind == "log":
        lines = [f"FLASER 180 {' '.join(['2.0'] * 180)} 0 0 0 0 0 0 {k}.0 robot {k}.0" for k in range(3)]
        return "s.log", ("\n".join(lines) + "\n").encode()
    if kind == "ros":
        names = [
            "%time",
            "field.angle_min",
            "field.angle_max",
            "field.angle_increment",
            "field.range_min",
            "field.range_max",
        ]
        head = ",".join(names + [f"field.ranges{k}" for k in range(beams)])
        row = ",".join(map(str, [1, -math.pi, math.pi, 2 * math.pi / beams, 0.05, 5.0, *ranges[0]]))
        return "s.csv", f"{head}\n{row}\n".encode()
    lines = [f"# {key}: {value}" for key, value in about.items()] + [",".join(map(str, row)) for row in ranges]
    return "s.csv", ("\n".join(lines) + "\n").encode()


def _experiment() -> dict[str, Any]:
    return {
        "name": "small", "title": "A small experiment", "seeds": "1000-1001",
        "preset": "printed", "scenario": {"robots": 2, "limit_s": 2.0},
        "places": {"near": {"task": {"name": "T1", "options": {"size_m": 5.0}}}, "ring": {"task": {"name": "T3"}}},
        "planners": {"alone": {"planner": {"name": "nav-scope", "params": {"w_i": 0.0}}}, "ours": {}},
        "sweeps": [{"name": "w_i", "planner": "ours", "key": "planner.params.w_i", "values": [0.0, 2.0]}],
        "ours": "ours", "published": [{"source": "x", "metric": "spl", "values": {"near": {"ours": 0.5}}}],
        "targets": [{"planner": "ours", "place": "near", "metric": "spl", "at_least": 0.1}], "order": ["alone", "ours"],
        "weight": {"place": "near", "planner": "ours", "keys": {"planner": {"params": {"prior": 0.0}}}},
        "gap": {"worst": "alone", "best": "ours"}, "notes": ["a"],
    }  # fmt: skip


def _barn() -> dict[str, bytes]:
    model = ("<model name='c{0}'><pose>{1} 7 0 0 0 0</pose><link name='l'><collision name='c'><geometry><cylinder>"
             "<radius>0.075</radius><length>1</length></cylinder></geometry></collision></link></model>")  # fmt: skip
    world = f"<sdf version='1.6'><world name='default'>{model.format(0, -2.5)}{model.format(1, -1.5)}</world></sdf>"
    path = io.BytesIO()
    np.save(path, np.array([[15, 0], [15, 10], [16, 20], [15, 29]]))
    return {"b/world_0.world": world.encode(), "b/path_0.npy": path.getvalue()}


def _yaml(values: Any) -> bytes:
    return yaml.safe_dump(values, sort_keys=False, allow_unicode=True, default_flow_style=None).encode(
        "utf-8", "replace"
    )


# -- mutations -------------------------------------------------------------------------------------------------------


def _paths(values: Any, here: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the way to every value in nested mappings and lists."""
    parts = values.items() if isinstance(values, dict) else enumerate(values) if isinstance(values, list) else ()
    for key, value in parts:
        yield (*here, key)
        yield from _paths(value, (*here, key))


def _value(rng: random.Random, key: Any, old: Any) -> Any:
    """Return another value for a key; numbers that are valid and expensive are left out."""
    choice = rng.random()
    if choice < 0.25:
        return copy.deepcopy(rng.choice(OTHERS))
    if choice < 0.4 and isinstance(old, list):
        return old + copy.deepcopy(old[:1]) * rng.choice([1, 2, 50])
    new = rng.choice(NUMBERS)
    if choice > 0.7 and isinstance(old, int | float) and not isinstance(old, bool):
        new = old * rng.choice([-1, 0.5, 2, 3, 10, 1e3, 1e6, 1e-3])
    dear = {
        "robots": 20,
        "size_m": 60,
        "length_m": 200,
        "width_m": 60,
        "room_m": 200,
        "way_m": 60,
        "density": 3,
        "most": 60,
    }
    if isinstance(new, int | float) and dear.get(key, math.inf) < new < 1001 + 199_000 * (key == "robots"):
        return old
    return new


def _mutated(rng: random.Random, values: Any) -> Any:
    """Return nested values with some of them changed, keys renamed, deleted or added."""
    values = json.loads(json.dumps(values))
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        paths = list(_paths(values))
        if not paths:
            break
        *groups, last = rng.choice(paths)
        inner = values
        for key in groups:
            inner = inner[key]
        what = rng.random()
        if what < 0.72:
            inner[last] = _value(rng, last, inner[last])
        elif what < 0.8:
            del inner[last]
        elif isinstance(inner, dict):
            new = rng.choice(
                [f"{last}x", str(last).upper(), 1, "", None, True, "a\0", "</script><img src=x>", "\u00e9"]
            )
            inner[new] = inner.pop(last) if what < 0.9 else copy.deepcopy(rng.choice([*NUMBERS, *OTHERS]))
        else:
            inner.insert(int(last), copy.deepcopy(rng.choice([*NUMBERS, *OTHERS])))
    return values


def _torn(rng: random.Random, content: bytes) -> bytes:
    """Return bytes with some flipped, inserted, left out or doubled."""
    data = bytearray(content)
    for _ in range(rng.choice([1, 1, 2, 8])):
        if not data:
            break
        at, what = rng.randrange(len(data)), rng.randrange(7)
        if what == 0:
            data[at] ^= 1 << rng.randrange(8)
        elif what == 1:
            data[at] = rng.randrange(256)
        elif what == 2:
            del data[at:]
        elif what == 3:
            del data[at : at + rng.choice([1, 4, 100])]
        elif what == 4:
            data[at:at] = rng.choice(
                [b"\0", b"\xff", b"\t", b"9" * 30, b"[" * 600, b"-", b"e9", b"\n", b",", b"nan", b"*a", b"&a "]
            )
        elif what == 5:
            data[at:at] = data[at : at + 200]
        else:
            data[at : at + 4] = rng.choice([b"\xff\xff\xff\xff", b"\0\0\0\0", b"\x7f\xff\xff\xff", b"9999"])
    return bytes(data)


def _torn_text(rng: random.Random, content: bytes) -> bytes:
    """Return the text of a YAML file, or another one, with lines changed."""
    lines = content.decode("utf-8", "replace").splitlines()
    at, what = rng.randrange(len(lines) or 1), rng.randrange(8)
    if what == 0 and lines:
        lines.insert(at, lines[at])
    elif what == 1 and lines and not re.search(DEAR_KEYS, lines[at]):
        lines[at] = re.sub(r"(-?\d[\d.e+-]*)", lambda m: str(rng.choice([*NUMBERS, *PLAIN_TEXT])), lines[at], count=1)
    elif what == 2:
        lines.insert(at, BOMB)
    elif what == 3:
        lines.insert(at, "deep: " + "[" * 600 + "]" * 600)
    elif what == 4:
        return "\n".join(lines).encode(rng.choice(["utf-16", "utf-8-sig", "latin-1", "utf-32"]), "replace")
    elif what == 5:
        lines[at : at + 1] = ["\t" + line for line in lines[at : at + 1]]
    elif what == 6:
        return _torn(rng, content)
    else:
        return rng.choice(
            [b"", b"\n", b"---\n---\n", b"[]", b"null", b"1", b"- - - -", b"\xff\xfe", b"{" * 600, b"? " * 600]
        )
    return "\n".join(lines).encode("utf-8", "surrogateescape") + b"\n"


# -- cases -----------------------------------------------------------------------------------------------------------


def _yaml_file(rng: random.Random, values: Any) -> bytes:
    if rng.random() < 0.75:
        return _yaml(_mutated(rng, values))
    return _torn_text(rng, _yaml(values))


def _run_scenario(rng: random.Random) -> Case:
    words = ["run", "s.yaml"]
    if rng.random() < 0.3:
        place = rng.choice(list(_paths(_scenario(rng))))
        dear = re.search(DEAR_KEYS, str(place[-1]))
        value = rng.choice(OTHERS[:20] if dear else [*NUMBERS, *OTHERS[:20]])
        words += ["--set", f"{'.'.join(map(str, place))}={value}".replace("\0", "")]
    return Case({"s.yaml": _yaml_file(rng, _scenario(rng))} | _maps(rng), words)


def _run_map(rng: random.Random) -> Case:
    files = _maps(rng)
    name = rng.choice(list(files))
    about = yaml.safe_load(files["m.yaml"])
    files[name] = _yaml_file(rng, about) if name == "m.yaml" else rng.choice([_torn, _torn_text])(rng, files[name])
    words = ["run", "--map", rng.choice([name, name, "m.yaml"]) if name != "m.scen" else "m.map", "--robots", "2"]
    if name == "m.scen":
        words += ["--trips", "m.scen"]
    if not words[2].endswith("yaml"):
        words += ["--resolution", rng.choice(["0.1", "0.1", "0.1", "1e-9", "nan", "1e9", "-1", "x"])]
    if words[2].endswith("npz"):
        words += ["--number", rng.choice(["7", "7", "7", "8", "-1", "1e9"])]
    if rng.random() < 0.2:
        places = ["1,1", "1,1,90", "1e30,1", "nan,0", "1", "", "1,1,1,1", "a,b", "1_0,1", "-5,-5", "99999,9"]
        words += ["--start", rng.choice(places), "--goal", rng.choice(places)]
    return Case(files, words)


def _perceive(rng: random.Random) -> Case:
    name, content = _scan(rng)
    words = ["perceive", name]
    if rng.random() < 0.3:
        option = rng.choice(["--range", "--radius", "--beam-step", "--no-return", "--mask"])
        words += [
            option,
            rng.choice(["0", "-1", "1e300", "1e-300", "nan", "3", "0.2", "1..2", "1..nan", "9999..-9", "x"]),
        ]
    return Case({name: rng.choice([_torn, _torn_text])(rng, content)}, words)


def _experiments(rng: random.Random) -> Case:
    word = rng.choice(["status", "run", "report", "export"])
    words = ["experiment", word, "e.yaml", "--store", "results.sqlite"]
    words += ["--engine", "in-process", "--maps", "1"] if word == "run" else []
    words += ["--csv", "out.csv"] if word == "export" else []
    files = {"e.yaml": _yaml_file(rng, _experiment())}
    if word != "run":
        files["results.sqlite"] = rng.choice([b"", b"x", b"SQLite format 3\0" + bytes(84)])
    return Case(files, words)


def _replay(rng: random.Random, made: dict[str, bytes]) -> Case:
    files = dict(made)
    name = rng.choice(["config.yaml", "world.json", "metrics.json", "trajectory.npz"])
    if name.endswith("json") and rng.random() < 0.7:
        files[name] = json.dumps(_mutated(rng, json.loads(files[name]))).encode("utf-8", "replace")
    else:
        files[name] = rng.choice([_torn, _torn_text])(rng, files[name])
    return Case({f"r/{key}": value for key, value in files.items()}, ["replay", "r"])


def _disk(rng: random.Random) -> Case:
    values = {"obstacles": [{"center": [0.0, 0.0], "radius": 0.1}, {"center": [0.5, 0.2], "radius": 0.1}], "name": "x"}
    words = ["disk", "run", rng.choice(["report", "reactive", "report:obstacle_buffer=0.005"]), "--map", "d.yaml"]
    if rng.random() < 0.3:
        option = rng.choice(["--permutation", "--robots", "--radius"])
        words += [option, rng.choice(["0,1,2,3,4", "0", "1e9", "nan", "-1", "200", "0.05", "x", "1e-300", "0,0,0,0,0"])]
    return Case({"d.yaml": _yaml_file(rng, values)}, words)


def _barn_world(rng: random.Random) -> Case:
    files = _barn()
    name = rng.choice(list(files))
    files[name] = rng.choice([_torn, _torn_text])(rng, files[name])
    if rng.random() < 0.3:
        text = files["b/world_0.world"].decode("utf-8", "replace")
        number = str(rng.choice(NUMBERS))
        files["b/world_0.world"] = re.sub(r"0\.075|-2\.5", number, text, count=1).encode("utf-8", "replace")
    return Case(files, ["barn", "b", "--write-scenario", rng.choice(["0", "0", "0", "1", "-1"]), "w.yaml"])


def _storm(rng: random.Random) -> Case:
    values = {"adversary": {"seed": 1, "per_tick": 2.0, "kinds": ["noise"]}, "scenario": _scenario(rng)}
    if rng.random() < 0.5:
        values = values["scenario"]
    return Case({"s.yaml": _yaml_file(rng, values)} | _maps(rng), ["storm", "--replay", "s.yaml"])


def draw(seed: int, number: int, made: dict[str, bytes]) -> Case:
    """Return the case of a number."""
    _fill_groups()
    rng = random.Random(f"{seed}:{number}")
    kinds: list[Callable[[random.Random], Case]] = [_run_scenario] * 8 + [_run_map] * 4 + [_perceive] * 3
    kinds += [_experiments, _experiments, _disk, _barn_world, _storm]
    kinds += [lambda rng: _replay(rng, made)] * (1 if made else 0)
    return rng.choice(kinds)(rng)


# -- playing ---------------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def short_runs() -> Iterator[None]:
    """Let a run that is accepted end after its first ticks, and what is not a run's as soon as work begins."""
    from swarmscope.cli import disk as disk_cli
    from swarmscope.cli import storm as storm_cli
    from swarmscope.judging import run as judging
    from swarmscope.sim import loop

    def first_ticks(setting: Any, *hooks: Any) -> Any:
        return loop.run(dataclasses.replace(setting, limit_s=min(setting.limit_s, TICKS * setting.dt)), *hooks)

    def enough(*_: Any) -> Any:
        raise _EnoughError

    kept = judging.run, disk_cli.play_batch, storm_cli.watched
    judging.run, disk_cli.play_batch, storm_cli.watched = first_ticks, enough, enough  # type: ignore[assignment]
    try:
        yield
    finally:
        judging.run, disk_cli.play_batch, storm_cli.watched = kept


class Played(NamedTuple):
    """What came of a case."""

    code: int
    said: str
    seconds: float


@functools.cache
def _command() -> Any:
    """Return the command of all commands, which takes longer to build than to run."""
    import typer

    from swarmscope.cli.main import app

    return typer.main.get_command(app)


def _written(case: Case, place: Path) -> None:
    for name, content in case.files.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_bytes(content)
    os.mkfifo(place / "FIFO")
    (place / "LOOP").symlink_to("LOOP")


def _words(case: Case) -> list[str]:
    more = ["--no-pictures", "--force", "--out", "out"] if case.words[0] == "run" else []
    return [*case.words, *more]


def play(case: Case, place: Path) -> Played:
    """Play a case in this process, in the folder ``place``."""
    command = _command()
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    _written(case, place)
    here, out, err = os.getcwd(), io.StringIO(), io.StringIO()
    os.chdir(place)
    begun, code = time.perf_counter(), 0
    with (
        warnings.catch_warnings(record=True) as warned,
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        warnings.simplefilter("always")
        try:
            command(_words(case), prog_name="swarmscope")
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        except BaseException:
            code = -1
            traceback.print_exc(file=err)
        finally:
            os.chdir(here)
    said = err.getvalue() + "".join(f"Warning: {one.message} ({one.filename}:{one.lineno})\n" for one in warned)
    return Played(code, said, time.perf_counter() - begun)


def play_as_process(case: Case, place: Path) -> Played:
    """Play a case as the command that a user types, for a simulated second."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    _written(case, place)
    words = _words(case) + (["--limit", "1"] if case.words[0] == "run" else [])
    begun = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "swarmscope", *words], cwd=place, capture_output=True, check=False, timeout=STUCK_S,
        preexec_fn=_bounded, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    return Played(done.returncode, done.stderr.decode("utf-8", "replace"), time.perf_counter() - begun)


def _bounded() -> None:
    size = int((MOST_GB + 4.0) * 2**30)  # what is mapped, the libraries included
    resource.setrlimit(resource.RLIMIT_AS, (size, size))


def fault(case: Case, played: Played) -> str:
    """Return what is wrong with how a command ended, an empty string if nothing is."""
    if played.code == FAULT and "_EnoughError" in played.said:
        return ""
    unforeseen = re.search(r"Traceback|Error: .*\(\w+, line \d+\)", played.said)
    silent = played.code == REFUSED and not _names_something(case, played.said)
    found = {
        "a traceback, or a fault that nobody thought of": unforeseen or played.code not in _ends(case),
        "a library's warning": "Warning" in played.said,
        f"took {played.seconds:.1f} s": played.seconds > SLOW_S,
        "a message that names neither file nor key nor line": silent,
    }
    return next((why for why, is_so in found.items() if is_so), "")


def _ends(case: Case) -> tuple[int, ...]:
    """Return the exit codes that are no fault: a controller of the disk that collides or leaves it ends with 1."""
    return (0, 1, REFUSED) if case.words[:2] == ["disk", "run"] else (0, REFUSED)


def _names_something(case: Case, said: str) -> bool:
    words = {word for word in re.findall(r"[\w.-]+", " ".join(case.words)) if len(word) > 2} | set(case.files)
    keys = {key for group, keys in _GROUPS.items() for key in (group, *keys)} | {
        "task",
        "planner",
        "map",
        "place",
        "line",
    }
    options = {key for options in TASKS.values() for key in options} | {
        "obstacles",
        "robot ",
        "density",
        "radius",
        "permutation",
    }
    if re.search(r"--[a-z]|(^|\s)\S*/\S*: ", said):
        return True
    named = re.search(r"^swarmscope: (.+?): ", said, re.MULTILINE)  # a file whose name was mutated
    if named and any(named[1].encode() in content for content in case.files.values()):
        return True
    return any(word in said for word in words | keys | options)


def made_run(place: Path) -> dict[str, bytes]:
    """Return the files of a small finished run."""
    case = Case(
        {"s.yaml": _yaml({"task": {"name": "T1", "options": {"size_m": 5.0}}, "robots": 2, "limit_s": 2.0})},
        ["run", "s.yaml"],
    )
    played = play(case, place)
    if played.code != 0:
        raise SystemExit(played.said)
    return {file.name: file.read_bytes() for file in (place / "out").iterdir()}


def fuzz(numbers: range, seed: int, show: Callable[[str], None] = print, processes: bool = False) -> Counter[str]:
    """Play cases; return how many ended how, faults with their numbers as keys of their own."""
    base = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None  # noqa: S108
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory(dir=base) as folder, short_runs():
        place = Path(folder) / "p"
        made = made_run(place)
        for number in numbers:
            faulthandler.dump_traceback_later(2 * STUCK_S, exit=True)
            case = draw(seed, number, made)
            try:
                played = (play_as_process if processes else play)(case, place)
            except subprocess.TimeoutExpired:
                played = Played(-1, "stuck", STUCK_S)
            why = fault(case, played)
            found[f"{case.words[0]}: exit code {played.code}" if not why else "FAULTS"] += 1
            if number % 5000 == 4999:
                show(f"{number + 1 - numbers.start} inputs, {found['FAULTS']} faults")
            if why:
                show(f"{seed}:{number}: {why}: {' '.join(_words(case))}\n{played.said[-1500:]}")
        faulthandler.cancel_dump_traceback_later()
    return found


def main() -> int:
    """Run what the command line says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=2000, help="inputs in this process")
    parser.add_argument("--processes", type=int, default=0, help="inputs as processes of their own, instead")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first input")
    parser.add_argument("--only", type=int, help="play this input alone")
    parser.add_argument("--keep", type=Path, help="folder for the files of --only")
    asked = parser.parse_args()
    first = asked.first if asked.only is None else asked.only
    count = 1 if asked.only is not None else asked.processes or asked.runs
    if asked.keep is not None:
        with tempfile.TemporaryDirectory() as folder, short_runs():
            case = draw(asked.seed, first, made_run(Path(folder) / "p"))
        asked.keep.mkdir(parents=True)
        _written(case, asked.keep)
        print("swarmscope", *_words(case))
        return 0
    begun = time.perf_counter()
    if not asked.processes:
        _bounded()
    found = fuzz(range(first, first + count), asked.seed, lambda text: print(text, flush=True), bool(asked.processes))
    for what, many in sorted(found.items()):
        print(f"{many:8d}  {what}")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN if asked.processes else resource.RUSAGE_SELF)
    wall_s, cpu_s, most_gb = time.perf_counter() - begun, peak.ru_utime, peak.ru_maxrss / 2**20
    print(f"{count} inputs, {wall_s:.0f} s ({cpu_s:.0f} s of computing), largest memory {most_gb:.2f} GB")
    return int(found["FAULTS"] > 0 or most_gb > MOST_GB)


if __name__ == "__main__":
    sys.exit(main())

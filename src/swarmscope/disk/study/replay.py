"""The replay page of a run in the unit disk: one HTML file, by one controller or several side by side."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Sequence
from importlib import resources
from typing import Any, NamedTuple

import numpy as np

from swarmscope.disk.runs import COLLISIONS, STATUS_WORDS, Film, Outcome, Problem
from swarmscope.disk.study.pictures import robot_colour

UNITS = 30_000
"""Positions are stored as whole numbers of 1/30000 of the disk's radius: none is off by more than 1.7e-5."""


class Shown(NamedTuple):
    """The run by one controller."""

    label: str
    outcome: Outcome
    film: Film


def replay_page(of: Problem, shown: Sequence[Shown], bound: int) -> str:
    """Return the page of a problem with one run; the same run gives the same page."""
    template = resources.files("swarmscope.disk.study").joinpath("replay_template.html").read_text("utf-8")
    payload = json.dumps(page_data(of, shown, bound), allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    head, tail = template.split("@DATA@")
    return head.replace("@TITLE@", html.escape(_title(of))) + payload.replace("<", "\\u003c") + tail


def page_data(of: Problem, shown: Sequence[Shown], bound: int) -> dict[str, Any]:
    """Return what the page is given, ready for JSON."""
    return {
        "map": of.maps[of.map_of[0]].name,
        "obstacles": of.maps[of.map_of[0]].obstacles.tolist(),
        "r": of.rules.r,
        "n": of.rules.n,
        "goals": of.goal[0].tolist(),
        "colours": [robot_colour(k) for k in range(of.rules.n)],
        "bound": int(bound),
        "units": UNITS,
        "runs": [_run(one) for one in shown],
    }


def _run(one: Shown) -> dict[str, Any]:
    where = np.array([picture[0] for picture in one.film.positions])
    steps = np.minimum(np.arange(len(where)) * one.film.every, one.outcome.steps[0])
    whole = np.clip(np.rint(where * UNITS), -32_768, 32_767).astype("<i2")
    hit = [int(k) for k in one.outcome.involved[0]] if one.outcome.status[0] in COLLISIONS else []
    return {
        "label": one.label,
        "ended": STATUS_WORDS[one.outcome.status[0]],
        "steps": int(one.outcome.steps[0]),
        "every": one.film.every,
        "at": steps.tolist()[-2:],
        "frames": len(where),
        "arrival": one.outcome.arrival[0].tolist(),
        "hit": hit[:1],
        "places": base64.b64encode(whole.tobytes()).decode("ascii"),
    }


def _title(of: Problem) -> str:
    name = of.maps[of.map_of[0]].name
    if of.rules.n > 10:
        return f"{of.rules.n} robots on {name}"
    return f"{name}, goals {','.join(str(k) for k in of.permutation[0])}"

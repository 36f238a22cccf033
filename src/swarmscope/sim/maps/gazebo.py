"""Gazebo world files: upright cylinders and boxes, and cylinders that move as DynaBARN's plugins say.

A moving model names a plugin, ``libobs_7.so``; where it goes stands in the plugin's source, ``obs_7.cc``, as key
frames. Gazebo sends it from the last of them to the first in no time; here it walks back, and straight between them.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

from pydantic import ValidationError

from swarmscope.bounds import number_of
from swarmscope.errors import InputFileError
from swarmscope.sim.world import Circle, Obstacle, Polygon, WorldSpec
from swarmscope.texts import read_text

EMPTY_FRAME = re.compile(r"<pose\s+frame\s*=\s*>")
"""What DynaBARN's files say instead of an attribute; it is no XML."""
NUMBER = r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*"
KEY_FRAME = re.compile(rf"CreateKeyFrame\({NUMBER}\).*?Vector3d\({NUMBER},{NUMBER},", re.DOTALL)
PLUGIN = re.compile(r"lib(\w{1,100})\.so")
STANDS = "0 0 0 0 0 0"
HARMLESS = {"model://sun", "model://ground_plane"}
"""What worlds include that no robot runs into."""
MARGIN_M = 1.0
"""Of the bounds round everything."""
DEEP = 3
"""Sources of plugins are looked for in so many folders above the world's, and in all that is in them."""
MOST_FILES = 20_000


class _Plain(TreeBuilder):
    """Builds a tree and refuses document types: with them come entities, of which few bytes make gigabytes."""

    def doctype(self, name: str, pubid: str | None, system: str | None) -> NoReturn:
        """Refuse."""
        raise ValueError(f"declares the document type '{name}', which no world file needs")


def world_in(text: str) -> Element:
    """Return the ``<world>`` of a world file that needs no other file. Errors: ParseError, ValueError."""
    parser = XMLParser(target=_Plain())  # noqa: S314  document types, and so entities, are refused
    parser.feed(text)
    root: Element = parser.close()
    world = root.find("world") if root.tag == "sdf" else None
    if world is None:
        raise ValueError(f"is no world file of Gazebo: no <sdf> with a <world>, but <{root.tag[:40]}>")
    for uri in world.iterfind("include/uri"):
        if (uri.text or "").strip() not in HARMLESS:
            raise ValueError(f"includes {uri.text}, which is another file; only what is written out is read")
    return world


def numbers_in(text: str | None, count: int, where: str) -> list[float]:
    """Return the ``count`` numbers that a text consists of. Errors: ValueError."""
    words = (text or "").split()
    values = [number_of(word) for word in words]
    if len(values) != count or not all(map(math.isfinite, values)):
        raise ValueError(f"{where} must be {count} finite number{'s' * (count > 1)}, not '{' '.join(words)[:60]}'")
    return values


def load_world(path: Path) -> WorldSpec:
    """Return what stands and moves in a world file. Errors: InputFileError."""
    try:
        world = world_in(EMPTY_FRAME.sub("<pose>", read_text(path)))
        obstacles = [one for model in world.findall("model") for one in _model(model, path)]
        if not obstacles:
            raise ValueError("holds no cylinder and no box")
        return WorldSpec(obstacles=obstacles, bounds=_bounds(obstacles))
    except ParseError as error:
        raise InputFileError(path, f"torn, or no XML ({error})") from None
    except ValidationError as error:
        raise InputFileError(path, str(error.errors()[0]["msg"]).removeprefix("Value error, ")) from None
    except ValueError as error:
        raise InputFileError(path, str(error)) from None


def _model(model: Element, path: Path) -> Iterator[Obstacle]:
    """Return the obstacles of a model."""
    name = model.get("name", "")[:60]
    x, y, _, roll, pitch, yaw = numbers_in(model.findtext("pose") or STANDS, 6, f"model '{name}': <pose>")
    if max(abs(roll), abs(pitch)) > 1e-6:
        raise ValueError(f"model '{name}' is tilted")
    plugin = model.find("plugin")
    for part in ("link", "link/collision"):
        for inner in model.iterfind(part):
            aside = numbers_in(inner.findtext("pose") or STANDS, 6, f"model '{name}': <pose>")
            if any(aside[k] for k in (0, 1, 3, 4, 5)):
                raise ValueError(f"model '{name}': its <{inner.tag}> stands aside of it, which is not read")
    if model.find("model") is not None or model.find("include") is not None:
        raise ValueError(f"model '{name}' holds other models, which are not read")
    for shape in model.iterfind("link/collision/geometry/*"):
        if shape.tag == "cylinder":
            radius = numbers_in(shape.findtext("radius"), 1, f"model '{name}': <radius>")[0]
            yield _cylinder(x, y, radius, None if plugin is None else plugin.get("filename", ""), path)
        elif shape.tag == "box" and plugin is not None:
            raise ValueError(f"model '{name}' is a box that moves; cylinders are read")
        elif shape.tag == "box":
            length, width, _ = numbers_in(shape.findtext("size"), 3, f"model '{name}': <size>")
            c, s, u, v = math.cos(yaw), math.sin(yaw), 0.5 * length, 0.5 * width
            corners = ((u, v), (-u, v), (-u, -v), (u, -v))
            yield Polygon(points=[(x + c * a - s * b, y + s * a + c * b) for a, b in corners])
        elif shape.tag != "plane":
            raise ValueError(f"model '{name}' is a {shape.tag[:40]}; cylinders and boxes are read")


def _cylinder(x: float, y: float, radius: float, plugin: str | None, path: Path) -> Circle:
    """Return a disc that stands, or goes where the source of its plugin says."""
    if plugin is None:
        return Circle(center=(x, y), radius=radius)
    named = PLUGIN.fullmatch(plugin)
    if named is None:
        raise ValueError(f"plugin '{plugin[:60]}' is not called libNAME.so")
    frames = _key_frames(_source(path, f"{named[1]}.cc"))
    way = {"way": [frame[1:] for frame in frames[1:]], "times_s": [frame[0] for frame in frames[1:]]}
    return Circle.model_validate({"center": frames[0][1:], "radius": radius, "repeat": "back", **way})


def _source(path: Path, name: str) -> Path:
    """Return the source of a plugin, beside the world file or near it."""
    folder, looked = path.resolve().parent, 0
    for place in (folder, *list(folder.parents)[:DEEP]):
        if place in (Path(place.anchor), Path.home().resolve(), Path("/tmp")):  # noqa: S108  never searched
            break
        for at, folders, files in os.walk(place):
            if name in files:
                return Path(at) / name
            looked += len(folders) + len(files)
            if looked > MOST_FILES:
                folders.clear()
    raise ValueError(f"moves by a plugin whose source {name} is not beside it, nor in the {DEEP} folders above it")


def _key_frames(source: Path) -> list[tuple[float, float, float]]:
    """Return when a plugin's model is where: seconds from 0, x, y [m]."""
    text = read_text(source)
    written = KEY_FRAME.findall(text)
    if text.count("CreateKeyFrame(") != len(written):
        raise ValueError(f"{source.name} holds key frames that are not written in numbers")
    found: list[tuple[float, float, float]] = []
    for t, x, y in (map(float, numbers) for numbers in written):
        if not found or t > found[-1][0] + 1e-9:
            found.append((t, x, y))
    if len(found) < 2:
        raise ValueError(f"{source.name} holds no two key frames one after the other")
    return [(t - found[0][0], x, y) for t, x, y in found]


def _bounds(obstacles: list[Any]) -> tuple[float, float, float, float]:
    """Return what is drawn, and where robots start: the box round all that stands."""
    points = [point for one in obstacles for point in _extent(one)]
    xs, ys = [x for x, _ in points], [y for _, y in points]
    return min(xs) - MARGIN_M, min(ys) - MARGIN_M, max(xs) + MARGIN_M, max(ys) + MARGIN_M


def _extent(one: Circle | Polygon) -> list[tuple[float, float]]:
    return [*one.points] if isinstance(one, Polygon) else [one.center, *(one.way or [])]

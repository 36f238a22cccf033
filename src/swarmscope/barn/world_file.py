"""A world file of the challenge (Gazebo's SDF): the upright cylinders in it, as discs.

``<world>`` holds a ``<model>`` for each cylinder, with its ``<pose>`` (x y z roll pitch yaw) and the ``<radius>`` of
its collision. A ``<state>``, as Gazebo saves it, moves the models that it names. A plane is the ground. Anything else
that a robot could touch is refused, since it would be missing here.
"""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import numpy as np
from numpy.typing import NDArray

from swarmscope.bounds import number_of
from swarmscope.errors import InputFileError
from swarmscope.sim.maps.gazebo import parse_xml
from swarmscope.texts import check_regular

MOST_BYTES = 32 << 20
"""Larger files are refused; the challenge's have half a megabyte."""
UPRIGHT_RAD = 1e-6
FLAT = {"plane"}
HARMLESS = {"model://sun", "model://ground_plane"}
"""What worlds include that no robot runs into."""


class _Bad(Exception):
    """Why a file is refused; carries the reason up to where the path is known."""


def read_world_file(path: Path) -> NDArray[np.float64]:
    """Return the discs (K, 3) x, y, radius [m] of a world file. Errors: InputFileError."""
    try:
        return _discs(_tree(path))
    except ParseError as error:
        raise InputFileError(path, f"torn, or no XML ({error})") from None
    except OSError as error:
        raise InputFileError(path, error.strerror or "cannot be read") from None
    except _Bad as why:
        raise InputFileError(path, str(why)) from None


def _tree(path: Path) -> Element:
    check_regular(path, MOST_BYTES)
    try:
        return parse_xml(path.read_bytes().decode("utf-8", "replace"))
    except ValueError as why:
        raise _Bad(str(why)) from None


def _discs(root: Element) -> NDArray[np.float64]:
    world = root.find("world") if root.tag == "sdf" else None
    if world is None:
        raise _Bad(f"is no world file of Gazebo: no <sdf> with a <world>, but <{root.tag[:40]}>")
    for uri in world.findall("include/uri"):
        if (uri.text or "").strip() not in HARMLESS:
            raise _Bad(f"includes {uri.text}, which is another file; only cylinders written out are read")
    moved = {_name(model): model for model in world.findall("state/model")}
    found = [disc for model in world.findall("model") for disc in _model(model, moved.get(_name(model), model))]
    if not found:
        raise _Bad("holds no cylinder")
    return np.array(found)


def _model(model: Element, stands: Element) -> list[tuple[float, float, float]]:
    """Return the discs of a model that stands where the ``<pose>`` of ``stands`` says."""
    where = f"model '{_name(model)}'"
    radii = [radius for shape in model.iter("collision") for radius in _radii(shape, where)]
    if not radii:
        return []
    for part in ("link", "link/collision"):
        for inner in model.findall(part):
            if any(_pose(inner, where)[:2]):
                raise _Bad(f"{where}: <{inner.tag}> stands aside of its model, which is not read")
    x, y, _, roll, pitch, _ = _pose(stands, where)
    if max(abs(roll), abs(pitch)) > UPRIGHT_RAD:
        raise _Bad(f"{where}: the cylinder is tilted")
    return [(x, y, radius) for radius in radii]


def _radii(shape: Element, where: str) -> list[float]:
    """Return the radius [m] of a collision that is a cylinder; nothing for the ground."""
    kinds = [one for geometry in shape.findall("geometry") for one in geometry]
    for one in kinds:
        if one.tag not in FLAT | {"cylinder"}:
            raise _Bad(f"{where}: is a {one.tag}; only cylinders are read")
    found = [_numbers(one.findtext("radius"), 1, f"{where}: <radius>")[0] for one in kinds if one.tag == "cylinder"]
    if any(radius <= 0.0 for radius in found):
        raise _Bad(f"{where}: <radius> must be more than 0")
    return found


def _pose(at: Element, where: str) -> list[float]:
    """Return x, y, z [m], roll, pitch, yaw [rad]; all 0 without a ``<pose>``, as in SDF."""
    pose = at.find("pose")
    return [0.0] * 6 if pose is None else _numbers(pose.text, 6, f"{where}: <pose>")


def _numbers(text: str | None, count: int, where: str) -> list[float]:
    words = (text or "").split()
    values = [number_of(word) for word in words]
    if len(values) != count or not all(map(math.isfinite, values)):
        raise _Bad(f"{where} must be {count} finite number{'s' * (count > 1)}, not '{' '.join(words)[:60]}'")
    return values


def _name(model: Element) -> str:
    return model.get("name", "")

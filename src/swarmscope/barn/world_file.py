"""A world file of the challenge (Gazebo's SDF): the upright cylinders in it, as discs.

``<world>`` holds a ``<model>`` for each cylinder, with its ``<pose>`` (x y z roll pitch yaw) and the ``<radius>`` of
its collision. A ``<state>``, as Gazebo saves it, moves the models that it names. A plane is the ground. Anything else
that a robot could touch is refused, since it would be missing here.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import InputFileError
from swarmscope.sim.maps.gazebo import numbers_in, world_in
from swarmscope.texts import check_regular

MOST_BYTES = 32 << 20
"""Larger files are refused; the challenge's have half a megabyte."""
UPRIGHT_RAD = 1e-6
FLAT = {"plane"}


def read_world_file(path: Path) -> NDArray[np.float64]:
    """Return the discs (K, 3) x, y, radius [m] of a world file. Errors: InputFileError."""
    try:
        return _discs(path)
    except ParseError as error:
        raise InputFileError(path, f"torn, or no XML ({error})") from None
    except OSError as error:
        raise InputFileError(path, error.strerror or "cannot be read") from None
    except ValueError as why:
        raise InputFileError(path, str(why)) from None


def _discs(path: Path) -> NDArray[np.float64]:
    check_regular(path, MOST_BYTES)
    world = world_in(path.read_bytes().decode("utf-8", "replace"))
    moved = {_name(model): model for model in world.findall("state/model")}
    found = [disc for model in world.findall("model") for disc in _model(model, moved.get(_name(model), model))]
    if not found:
        raise ValueError("holds no cylinder")
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
                raise ValueError(f"{where}: <{inner.tag}> stands aside of its model, which is not read")
    x, y, _, roll, pitch, _ = _pose(stands, where)
    if max(abs(roll), abs(pitch)) > UPRIGHT_RAD:
        raise ValueError(f"{where}: the cylinder is tilted")
    return [(x, y, radius) for radius in radii]


def _radii(shape: Element, where: str) -> list[float]:
    """Return the radius [m] of a collision that is a cylinder; nothing for the ground."""
    kinds = [one for geometry in shape.findall("geometry") for one in geometry]
    for one in kinds:
        if one.tag not in FLAT | {"cylinder"}:
            raise ValueError(f"{where}: is a {one.tag}; only cylinders are read")
    found = [numbers_in(one.findtext("radius"), 1, f"{where}: <radius>")[0] for one in kinds if one.tag == "cylinder"]
    if any(radius <= 0.0 for radius in found):
        raise ValueError(f"{where}: <radius> must be more than 0")
    return found


def _pose(at: Element, where: str) -> list[float]:
    """Return x, y, z [m], roll, pitch, yaw [rad]; all 0 without a ``<pose>``, as in SDF."""
    pose = at.find("pose")
    return [0.0] * 6 if pose is None else numbers_in(pose.text, 6, f"{where}: <pose>")


def _name(model: Element) -> str:
    return model.get("name", "")

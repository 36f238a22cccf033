"""Maps that come with the package."""

from __future__ import annotations

from pathlib import Path

from swarmscope.errors import UnknownNameError

MAP_FOLDER = Path(__file__).parent.parent.parent / "data" / "maps"


def packaged_map(name: str) -> Path:
    """Return the YAML file of a map that comes with the package, for instance ``willow_garage_office``."""
    names = {path.stem: path for path in MAP_FOLDER.glob("*.yaml")}
    if name not in names:
        raise UnknownNameError("map", name, names)
    return names[name]

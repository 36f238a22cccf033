"""Maps that come with the package."""

from __future__ import annotations

from pathlib import Path

from swarmscope.errors import InputFileError, UnknownNameError

MAP_FOLDER = Path(__file__).parent.parent.parent / "data" / "maps"


def packaged_map(name: str) -> Path:
    """Return the YAML file of a map that comes with the package, for instance ``willow_garage_office``."""
    names = {path.stem: path for path in MAP_FOLDER.glob("*.yaml")}
    if name not in names and Path(name).exists():
        file = "has no ending that says what kind of map it is, such as .yaml or .png"
        raise InputFileError(name, "is a folder; a map is a file" if Path(name).is_dir() else file)
    if name not in names:
        raise UnknownNameError("map", name, names)
    return names[name]

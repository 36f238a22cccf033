"""The colours of pictures, of videos and of what other programs draw."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

INK, FAINT, GROUND = "#2b333b", "#7b8590", "#fbfaf7"
SOLID, SOLID_EDGE = "#c9d2c4", "#a4b19d"
WALL = "#8c9a86"
MOVER = "#d9b48f"
CRASH = "#c23b22"
SAFE = "#0f8a6a"
PACKET = "#3d8f7d"


def robot_colours(robots: int) -> npt.NDArray[np.float64]:
    """Return a colour (N, 4) for each robot, red, green, blue, opacity within 0..1."""
    from matplotlib import colormaps

    return np.asarray(colormaps["plasma"](np.linspace(0.0, 0.84, robots)))

"""How figures are drawn: one style, two forms (SVG that follows the page's light or dark, PNG at twice the size)."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from swarmscope.lettering import drawing
from swarmscope.sim.world import Obstacle
from swarmscope.viewing.colours import CRASH, FAINT, GROUND, INK, SOLID, SOLID_EDGE
from swarmscope.viewing.pictures import draw_obstacles
from swarmscope.viewing.report.blocks import Picture, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAPER, GRID, FRAME, WALL = "#fffffe", "#e6e8ea", "#c4c9cd", "#8c9a86"
PX_PER_INCH = 96
MANY_SHAPES = 1000
SYMBOL = r"(?<![\w.])([NPfwtσ])_(ni|ai|dir|plan|a|u|i)(?!\w)"
"""Symbols with an index."""
GREEK = {"σ": r"\sigma"}
DARK = {
    INK: "#e4e7ea",
    FAINT: "#98a3ad",
    PAPER: "#15191d",
    GRID: "#2b3238",
    FRAME: "#4a535b",
    GROUND: "#1a1f24",
    SOLID: "#3d463f",
    SOLID_EDGE: "#566056",
    WALL: "#76836f",
    CRASH: "#ff6b52",
    "#0072b2": "#4aa5e8",
    "#009e73": "#2fc49a",
    "#7a6fb0": "#a79be0",
    "#8c6d1f": "#c9a545",
    "#6c757d": "#9aa5ae",
    "#a3475c": "#d98095",
    "#4f7a28": "#8dbb62",
}
"""What a colour becomes on a dark page; others stay."""


@contextmanager
def style() -> Iterator[None]:
    """Draw with matplotlib's defaults, whatever the user's settings, in the report's type and colours."""
    import matplotlib as mpl

    with drawing():
        mpl.rcParams.update(
            {
                "font.size": 9.0,
                "text.color": INK,
                "axes.labelcolor": INK,
                "axes.edgecolor": FRAME,
                "axes.facecolor": "none",
                "axes.titlesize": 10.0,
                "axes.titlecolor": INK,
                "axes.spines.top": False,
                "axes.spines.right": False,
                "axes.axisbelow": True,
                "xtick.color": FAINT,
                "ytick.color": FAINT,
                "xtick.labelcolor": INK,
                "ytick.labelcolor": INK,
                "grid.color": GRID,
                "legend.frameon": False,
                "svg.fonttype": "path",
                "svg.hashsalt": "swarmscope",
                "path.simplify_threshold": 0.3,
            }
        )
        yield


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure without any global state."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def picture(figure: Figure, name: str, caption: str, alt: str, beside: Table | None = None) -> Picture:
    """Return the finished figure in both forms; the same figure gives the same bytes."""
    svg, png = io.StringIO(), io.BytesIO()
    none = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    figure.savefig(svg, format="svg", dpi=2 * PX_PER_INCH, transparent=True, metadata=none)
    figure.savefig(png, format="png", dpi=2 * PX_PER_INCH, facecolor="white", metadata={"Software": None})
    width = round(figure.get_figwidth() * PX_PER_INCH)
    return Picture(name, caption, alt, _themed(svg.getvalue()), png.getvalue(), width, beside)


def data_uri(svg: str) -> str:
    """Return the drawing as an address that holds all of it."""
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode("ascii")


def draw_world(axes: Axes, obstacles: list[Obstacle]) -> None:
    """Draw obstacles; the many rectangles of an occupancy grid become one image within the drawing."""
    draw_obstacles(axes, obstacles)
    for collection in axes.collections:
        if len(collection.get_paths()) > MANY_SHAPES:
            collection.set_rasterized(True)


def note_grid(axes: Axes) -> None:
    """Draw light horizontal lines behind the data."""
    axes.grid(axis="y", linewidth=0.8)
    axes.tick_params(length=0)


def symbols(text: str) -> str:
    """Return ``text`` with symbols such as w_i set as formulas."""
    return re.sub(SYMBOL, lambda m: rf"${GREEK.get(m[1], m[1])}_{{{m[2]}}}$", text)


def _themed(svg: str) -> str:
    """Return the drawing with colours that follow light and dark, and coordinates of two decimals."""
    svg = re.sub(r'\bd="[^"]*"', lambda m: re.sub(r"(\.\d\d)\d+", r"\1", m[0]), svg)
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.S)
    names = {light: f"c{k}" for k, light in enumerate(DARK)}
    for light, name in names.items():
        svg = re.sub(re.escape(light), f"var(--{name})", svg, flags=re.I)
    plain = "".join(f"--{name}:{light};" for light, name in names.items())
    dark = "".join(f"--{name}:{DARK[light]};" for light, name in names.items())
    rules = f"svg{{{plain}}}@media screen and (prefers-color-scheme:dark){{svg{{{dark}}}image{{opacity:.3}}}}"
    start = svg.index(">", svg.index("<svg")) + 1
    return f"{svg[:start]}<style>{rules}</style>{svg[start:]}"

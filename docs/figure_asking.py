"""Makes docs/pictures/asking.png, a convoy in a warehouse, mute and asking: ``python docs/figure_asking.py [SEED]``.

Who goes where is coloured by the order of departure; the numbers in the titles are what all drove together, and when
the last one arrived.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from figure_style import STYLE
from figure_worlds import draw_world, played

SEED = 15
"""Of 0 to 19 the one in which asking saves most nearly what it saves on average."""
PLANNERS = {"mute": "atlas-mute", "asking": "atlas"}
OUT = Path(__file__).resolve().parent / "pictures" / "asking.png"


def picture(seed: int) -> plt.Figure:
    """Play the convoy with both planners and draw the ways."""
    figure, panels = plt.subplots(1, 2, figsize=(11.0, 6.6))
    for ax, (word, planner) in zip(panels, PLANNERS.items(), strict=True):
        keys = {
            "task": {"name": "warehouse", "options": {"depart": "convoy"}},
            "planner": {"name": planner},
            "radio": {"range_m": 10.0},
            "limit_s": 900.0,
        }
        outcome = played(keys, seed)
        draw_world(ax, outcome)
        records, robots = outcome.trace.records, outcome.trace.robots
        colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.92, len(robots)))
        for i, colour in enumerate(colours):
            ax.plot(records.x[:, i], records.y[:, i], color=colour, lw=1.3)
            ax.plot(*outcome.setup.goals[i, :2], "o", color=colour, ms=4.5, mec="white", mew=0.6)
        metres, last = robots["length"].sum(), robots["arrival_s"].max()
        ax.set_title(f"{word}: {metres:.0f} m driven together, the last arrives after {last:.0f} s", fontsize=10.5)
    figure.tight_layout()
    return figure


if __name__ == "__main__":
    with plt.rc_context(STYLE):
        picture(int(sys.argv[1]) if len(sys.argv) > 1 else SEED).savefig(OUT, dpi=80)
    print(OUT)

"""Cases of convergence and divergence, drawn and with their numbers (Nav-SCOPE Fig. 4, SFM-MAS Fig. 6 and Table II)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from swarmscope.errors import SwarmscopeError
from swarmscope.experiments.results import Run
from swarmscope.onboard.body import protection_model
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import body_of
from swarmscope.viewing.colours import FAINT, INK
from swarmscope.viewing.report import words
from swarmscope.viewing.report.again import Again, Played
from swarmscope.viewing.report.blocks import Block, Line, Picture, Row, Table, Text, cell
from swarmscope.viewing.report.drawing import FRAME, PAPER, draw_world, new_figure, picture, symbols
from swarmscope.viewing.report.material import ALL, OURS_COLOUR, Material

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Case = dict[str, Any]
BEFORE = "#d55e00"
NEIGHBOUR = "#009e73"
AFTER_S = 14.0
"""Path shown after the choice [s]."""
BEFORE_S = 5.0
KINDS = {
    "convergence": "it went to the side of the neighbour that weighed most, which sees open space",
    "divergence": "it went to the other side than the neighbour that weighed most, which sees obstacles",
}


def strongest(material: Material, kind: str) -> tuple[Run, Case] | None:
    """Return the case in which the neighbours moved the opinion most, over all runs of ours."""
    found = [(run, case) for run in material.of(ALL, material.leading()) for case in run.cases if case["kind"] == kind]
    return max(found, key=lambda pair: abs(pair[1]["p_left"] - pair[1]["p_self"]), default=None)


def case_blocks(material: Material, again: Again, progress: Callable[[str], None]) -> list[Block]:
    """Return the strongest convergence and the strongest divergence, and how often each was found."""
    runs = material.of(ALL, material.leading())
    counts = {kind: sum(case["kind"] == kind for run in runs for case in run.cases) for kind in KINDS}
    blocks: list[Block] = [
        Text(
            f"A choice of a side is turned round when the robot's own opinion P_a and the fused one P_dir lie on "
            f"different sides of 1/2. Over {words.count(len(runs), 'run')} of {material.leading()} the strongest of "
            f"each run were kept: {words.count(counts['convergence'], 'convergence', 'convergences')} and "
            f"{words.count(counts['divergence'], 'divergence', 'divergences')}. Shown is the strongest of each kind."
        )
    ]
    for kind in KINDS:
        best = strongest(material, kind)
        if best is None:
            blocks.append(Text(f"No {kind} was found.", "note"))
            continue
        progress(f"case of {kind}")
        try:
            blocks.append(case_picture(*best, again))
        except SwarmscopeError as error:
            blocks.append(Text(f"The {kind} could not be drawn: {error}", "note"))
    return blocks


def case_picture(run: Run, case: Case, again: Again) -> Picture:
    """Return one case: the place around the robot at that moment, and the numbers of the fusion beside it."""
    played = again.of(run)
    figure = new_figure(5.0, 5.0)
    axes = figure.subplots()
    _draw_place(axes, run, case, played)
    side, other = ("left", "right") if case["side"] > 0 else ("right", "left")
    caption = (
        f"{case['kind'].capitalize()}: {run.place}, seed {run.seed}, robot {case['robot']} at {case['t_s']:.1f} s. "
        f"Alone it would have gone {other} (P_a = {case['p_self']:.3f}, dashed arrow); with its neighbours it "
        f"went {side} (P_dir = {case['p_left']:.3f}, arrow): {KINDS[case['kind']]}. Grey arrow: direction of the goal. "
        f"Green: neighbours that took part, the wider the link the larger f_ai; grey discs: other robots; dotted "
        f"rings: pass band. Line: its path in the {AFTER_S:g} s after, dotted before."
    )
    return picture(figure, f"case_{case['kind']}", caption, f"A case of {case['kind']}", case_table(case))


def case_table(case: Case) -> Table:
    """Return robot, side, P, weight and vote of everybody in the fusion (15)."""
    own = case["p_self"] - 0.5
    rows = [_vote(f"{case['robot']} (itself)", MISSING_SIDE, case["p_self"], 1.0, own)]
    for n in case["neighbours"]:
        name = f"{n['id']} (decisive)" if n["id"] == case["decisive"] else str(n["id"])
        rows.append(_vote(name, n["side"], n["p"], n["f"], n["f"] * (n["p"] - 0.5)))
    total = own + sum(n["f"] * (n["p"] - 0.5) for n in case["neighbours"])
    rows.append(
        Row([cell("P_dir"), cell("left" if case["side"] > 0 else "right"), cell(f"{case['p_left']:.3f}"),
             cell(f"{1.0 + sum(n['f'] for n in case['neighbours']):.3f}"), cell(_signed(total))], True)
    )  # fmt: skip
    note = "P: probability that left is better. Contribution: f (P − 1/2), positive to the left; its sum decides."
    header = ["robot", "side", "P_a, P_ni", "weight f_ai", "contribution"]
    return Table("The fusion in numbers.", header, rows, note)


MISSING_SIDE = 0


def _vote(name: str, side: int, p: float, weight: float, vote: float) -> Row:
    where = {1: "left", -1: "right"}.get(side, words.MISSING)
    return Row([cell(name), [Line(where, "plain")], cell(f"{p:.3f}"), cell(f"{weight:.3f}"), cell(_signed(vote))])


def _signed(number: float) -> str:
    return f"{'−' if number < 0 else '+'}{abs(number):.3f}"


def _draw_place(axes: Axes, run: Run, case: Case, played: Played) -> None:
    from matplotlib import patches

    tick, me, x, y = case["tick"], case["robot"], case["x"], case["y"]
    near = [(n["id"], float(played.x[tick, n["id"]]), float(played.y[tick, n["id"]])) for n in case["neighbours"]]
    sigma = _sigma(run)
    reach = max([3.0 * sigma + 0.2, *(math.hypot(nx - x, ny - y) + 0.6 for _, nx, ny in near)])
    cx, cy = x + 0.3 * reach * math.cos(case["target"]), y + 0.3 * reach * math.sin(case["target"])
    axes.set_xlim(cx - 1.15 * reach, cx + 1.15 * reach)
    axes.set_ylim(cy - 1.15 * reach, cy + 1.15 * reach)
    axes.set_aspect("equal")
    draw_world(axes, played.world.obstacles)
    for ring in (sigma, 3.0 * sigma):
        axes.add_patch(patches.Circle((x, y), ring, fill=False, ec=FAINT, lw=0.8, ls=(0, (1, 3)), zorder=2))
    _draw_path(axes, played, me, tick)
    forces = {n["id"]: n["f"] for n in case["neighbours"]}
    largest = max(forces.values(), default=0.0) or 1.0
    taking_part = {n[0] for n in near}
    for i in range(played.x.shape[1]):
        px, py = float(played.x[tick, i]), float(played.y[tick, i])
        if i != me and math.hypot(px - x, py - y) < 1.5 * reach and i not in taking_part:
            _robot(axes, i, px, py, played.radius, FAINT)
    for i, nx, ny in near:
        axes.plot([nx, x], [ny, y], color=NEIGHBOUR, lw=1.0 + 3.0 * forces[i] / largest, alpha=0.45, zorder=3)
        _robot(axes, i, nx, ny, played.radius, NEIGHBOUR)
    turn, target = 0.7 * case["side"], case["target"]
    _arrow(axes, x, y, target, 1.6 * sigma, FAINT, "-", 1.4, "goal")
    _arrow(axes, x, y, target - turn, 1.35 * sigma, BEFORE, (0, (3, 2)), 2.0, "P_a")
    _arrow(axes, x, y, target + turn, 1.35 * sigma, OURS_COLOUR, "-", 2.4, "P_dir")
    _robot(axes, me, x, y, played.radius, OURS_COLOUR)
    _scale_bar(axes, reach)


def _draw_path(axes: Axes, played: Played, me: int, tick: int) -> None:
    first = max(0, tick - round(BEFORE_S / played.dt))
    last = tick + round(AFTER_S / played.dt) + 1
    line: dict[str, Any] = {"color": OURS_COLOUR, "zorder": 3}
    axes.plot(played.x[first : tick + 1, me], played.y[first : tick + 1, me], ls=(0, (1, 2)), lw=1.6, **line)
    axes.plot(played.x[tick:last, me], played.y[tick:last, me], lw=1.8, alpha=0.75, **line)


def _robot(axes: Axes, number: int, x: float, y: float, radius: float, colour: str) -> None:
    from matplotlib import patches

    axes.add_patch(patches.Circle((x, y), radius, fc=colour, ec=PAPER, lw=0.8, zorder=6))
    words_of: dict[str, Any] = {
        "ha": "center",
        "va": "center",
        "fontsize": 7.5,
        "color": PAPER,
        "zorder": 7,
        "clip_on": True,
    }
    axes.text(x, y, str(number), **words_of)


def _arrow(
    axes: Axes, x: float, y: float, angle: float, length: float, colour: str, dashes: Any, wide: float, name: str
) -> None:
    from matplotlib.patheffects import withStroke

    tip = (x + length * math.cos(angle), y + length * math.sin(angle))
    axes.plot([x, tip[0]], [y, tip[1]], color=colour, lw=wide, ls=dashes, zorder=5)
    axes.plot(*tip, marker=(3, 0, math.degrees(angle) - 90.0), ms=9, color=colour, mec=PAPER, mew=0.6, zorder=5)
    end = (x + 1.17 * length * math.cos(angle), y + 1.17 * length * math.sin(angle))
    text = axes.text(*end, symbols(name), color=colour, ha="center", va="center", fontsize=10, zorder=9)
    text.set_path_effects([withStroke(linewidth=2.5, foreground=PAPER)])


def _scale_bar(axes: Axes, reach: float) -> None:
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set(visible=True, color=FRAME, linewidth=0.6)
    x, y = axes.get_xlim()[0] + 0.08 * reach, axes.get_ylim()[0] + 0.09 * reach
    axes.plot([x, x + 1.0], [y, y], color=INK, lw=2.2, zorder=8, solid_capstyle="butt")
    axes.text(x + 0.5, y + 0.04 * reach, "1 m", ha="center", fontsize=8, zorder=8)


def _sigma(run: Run) -> float:
    sheet = parse_scenario(run.config, f"run of seed {run.seed}").widest
    return protection_model(body_of(sheet)).sigma_a

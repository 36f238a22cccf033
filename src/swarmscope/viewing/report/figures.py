"""Figures of numbers: box plots, sweeps, the interaction force."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from swarmscope.errors import SwarmscopeError
from swarmscope.experiments.experiment import Sweep, merged, sweep_label
from swarmscope.experiments.results import Run, flow_time_increases
from swarmscope.onboard.body import protection_model
from swarmscope.onboard.deciding.fields import interaction_force
from swarmscope.onboard.planners import load_planner
from swarmscope.scenarios.scenario import RobotModel
from swarmscope.scenarios.to_kernels import body_of
from swarmscope.user_files import is_file_name
from swarmscope.viewing.colours import FAINT, INK
from swarmscope.viewing.report import words
from swarmscope.viewing.report.blocks import Picture
from swarmscope.viewing.report.drawing import PAPER, new_figure, note_grid, picture, symbols
from swarmscope.viewing.report.material import ALL, OURS_COLOUR, Material

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ESTIMATE = "#009e73"
FLOW_STEP = 10.0
"""Width of a bin of flow-time increases [%]."""
BOXED = ("path_redundancy", "spl", "duration_s")


def box_pictures(material: Material) -> list[Picture]:
    """Return box plots of gamma, SPL and duration (Nav-SCOPE Fig. 7(a)), of those that were measured."""
    chosen = []
    for metric in BOXED:
        if any(len(material.per_map(place, p, metric)) for place in material.places for p in material.planners):
            chosen.append(_boxes(material, metric))
    return chosen


def _boxes(material: Material, metric: str) -> Picture:
    planners = [p for p in material.planners if any(len(material.per_map(q, p, metric)) for q in material.places)]
    figure = new_figure(8.2, 3.3)
    axes = figure.subplots()
    scale = 100.0 if metric in words.SHARES else 1.0
    width = 0.8 / len(planners)
    for k, place in enumerate(material.places):
        for j, planner in enumerate(planners):
            middle = k + (j - 0.5 * (len(planners) - 1)) * width
            values = scale * material.per_map(place, planner, metric)
            _box(axes, values, middle, 0.72 * width, material.colour(planner))
            published = material.published(metric, place, planner)
            if published is not None:
                _published(axes, middle, scale * published, 0.42 * width)
    axes.set_xticks(range(len(material.places)), material.places)
    axes.set_xlim(-0.5, len(material.places) - 0.5)
    axes.set_ylabel(_axis(metric))
    note_grid(axes)
    _legend(axes, material, planners, metric)
    caption = (
        f"{words.title(metric)} of each planner in each place, one dot per map ({_maps(material, metric)}). Boxes: "
        "quartiles and median, whiskers: the farthest map within 1.5 times the box."
    )
    caption += " Bars across: published values." if material.published_places(metric) else ""
    return picture(figure, f"boxes_{metric}", caption, f"Box plots of {words.title(metric)}")


def _box(axes: Axes, values: Any, middle: float, width: float, colour: str) -> None:
    if not len(values):
        return
    line = {"color": colour, "linewidth": 1.3}
    if len(values) > 1:
        axes.boxplot(
            [values], positions=[middle], widths=width, showfliers=False, patch_artist=True, manage_ticks=False,
            boxprops={"facecolor": colour, "alpha": 0.22, "edgecolor": colour, "linewidth": 1.0},
            medianprops={"color": colour, "linewidth": 2.2}, whiskerprops=line, showcaps=False,
        )  # fmt: skip
    spread = ((np.arange(len(values)) * 0.618034) % 1.0 - 0.5) * 0.7 * width
    axes.scatter(middle + spread, values, s=9, color=colour, linewidth=0, alpha=0.75, zorder=3)


def _published(axes: Axes, middle: float, value: float, half: float) -> None:
    axes.plot([middle - half, middle + half], [value, value], color=PAPER, lw=4.0, zorder=4, solid_capstyle="butt")
    axes.plot([middle - half, middle + half], [value, value], color=INK, lw=1.8, zorder=5, solid_capstyle="butt")


def _legend(axes: Axes, material: Material, planners: list[str], metric: str) -> None:
    from matplotlib.lines import Line2D

    marks: list[Any] = [
        Line2D([], [], ls="none", marker="s", ms=8, color=material.colour(p), label=p) for p in planners
    ]
    if material.published_places(metric):
        marks.append(Line2D([], [], color=INK, lw=1.8, label="published"))
    axes.figure.legend(
        handles=marks, loc="outside upper left", ncols=len(marks), handletextpad=0.4, columnspacing=1.6,
        handlelength=1.2,
    )  # fmt: skip


def _axis(metric: str) -> str:
    unit = "%" if metric in words.SHARES else {"duration_s": "s"}.get(metric, "")
    return f"{words.title(metric)} [{unit}]" if unit else words.title(metric)


def _maps(material: Material, metric: str) -> str:
    """Return how many maps there are in a box, in words."""
    counts = [len(material.of(place, p)) for place in material.places for p in material.planners]
    known = [len(material.per_map(place, p, metric)) for place in material.places for p in material.planners]
    ran = [n for n in counts if n]
    low, high = (min(ran), max(ran)) if ran else (0, 0)
    text = words.count(high, "map") if low == high else f"{low} to {high} maps"
    missing = sum(counts) - sum(known)
    absent = words.count(missing, "run without a value is left out", "runs without a value are left out")
    return f"{text} each" + (f"; {absent}" if missing else "")


def sweep_pictures(material: Material) -> list[Picture]:
    """Return gamma against the value of each sweep, one panel per place (Nav-SCOPE Fig. 7(b))."""
    return [found for sweep in material.experiment.sweeps if (found := _sweep(material, sweep)) is not None]


def _sweep(material: Material, sweep: Sweep) -> Picture | None:
    labels = [sweep_label(sweep, value) for value in sweep.values]
    if not any(material.of(place, label) for place in material.places for label in labels):
        return None
    figure = new_figure(8.2, 2.9)
    panels = figure.subplots(1, len(material.places), sharey=True, squeeze=False)[0]
    default = _default(material, sweep)
    colour = material.colour(sweep.planner)
    for axes, place in zip(panels, material.places, strict=True):
        found = [material.figure(place, label, "path_redundancy") for label in labels]
        estimates = 100.0 * np.array([entry.estimate for entry in found])
        bounds = 100.0 * np.array([[entry.low, entry.high] for entry in found])
        steps = np.arange(len(labels))
        axes.vlines(steps, bounds[:, 0], bounds[:, 1], color=colour, lw=1.6, alpha=0.7)
        axes.plot(steps, estimates, "-o", color=colour, ms=5, lw=1.4)
        _mark(axes, sweep, default, FAINT)
        _mark(axes, sweep, _estimated(material, sweep), ESTIMATE)
        published = material.published("path_redundancy", place, sweep.planner)
        if published is not None:
            axes.axhline(100.0 * published, color=FAINT, lw=1.0, ls=(0, (4, 3)), zorder=1)
        axes.set_xticks(steps, [f"{value:g}" for value in sweep.values])
        axes.set_title(place, loc="left")
        axes.set_xlabel(symbols(sweep.name))
        note_grid(axes)
    panels[0].set_ylabel(_axis("path_redundancy"))
    runs = sorted({len(material.of(place, label)) for place in material.places for label in labels} - {0})
    each = words.count(runs[-1], "map") if len(runs) == 1 else f"{runs[0]} to {runs[-1]} maps"
    caption = (
        f"Path redundancy γ of {sweep.planner} against {sweep.name} ({sweep.key}); bars: 95 % intervals, bootstrap "
        f"over maps; {each} per value. Values stand at equal steps."
    )
    if default is not None:
        caption += f" Band: the default, {default:g}."
    estimate = _estimated(material, sweep)
    if estimate is not None:
        caption += f" Green: the value estimated from data, {estimate:.2f}."
    if material.published("path_redundancy", material.places[0], sweep.planner) is not None:
        caption += " Dashed: the published γ."
    return picture(figure, f"sweep_{_stem(sweep.name)}", caption, f"γ against {sweep.name}")


def _mark(axes: Axes, sweep: Sweep, value: float | None, colour: str) -> None:
    """Shade the place of ``value`` on the axis of equal steps."""
    if value is None or not min(sweep.values) <= value <= max(sweep.values):
        return
    order = np.argsort(sweep.values)
    place = float(np.interp(value, np.array(sweep.values)[order], order.astype(float)))
    half = 0.2 if colour == FAINT else 0.05
    axes.axvspan(place - half, place + half, color=colour, alpha=0.2, lw=0, zorder=0)


def _estimated(material: Material, sweep: Sweep) -> float | None:
    """Return w_i as estimated from data for a sweep of w_i."""
    weight = material.weight
    if weight is None or not sweep.key.endswith(".w_i") or not weight.peak_force > 0.0:
        return None
    value = weight.weight / weight.peak_force
    return value if math.isfinite(value) else None


def _default(material: Material, sweep: Sweep) -> float | None:
    """Return the value that the planner has without the sweep."""
    keys: Any = merged(material.experiment.scenario, material.experiment.planners[sweep.planner])
    for part in sweep.key.split("."):
        keys = keys.get(part) if isinstance(keys, dict) else None
    if isinstance(keys, (int, float)):
        return float(keys)
    if not sweep.key.startswith("planner.params."):
        return None
    params = _defaults(material, sweep.planner)
    return params.get(sweep.key.removeprefix("planner.params."))


def _defaults(material: Material, planner: str) -> dict[str, float]:
    name = str(material.planner_keys(planner).get("name", ""))
    if is_file_name(name):
        return {}  # only running it would tell
    try:
        return load_planner(name).defaults
    except SwarmscopeError:
        return {}


def flow_time_picture(material: Material) -> Picture | None:
    """Return histograms of (l - l*) / l* of ours and of the experiment's other planner, by place (GIWT Fig. 7)."""
    ours, other = material.experiment.ours, material.experiment.flow_time
    if ours is None or other is None or not any(material.of(ALL, name) for name in (ours, other)):
        return None
    figure = new_figure(8.2, 2.9)
    panels = figure.subplots(1, len(material.places), squeeze=False)[0]
    cases = []
    for axes, place in zip(panels, material.places, strict=True):
        both = flow_time_increases(material.of(place, other), material.of(place, ours))
        found = {name: 100.0 * values for name, values in zip((other, ours), both, strict=True)}
        every = np.concatenate(list(found.values()))
        top = FLOW_STEP * math.ceil(max(100.0, float(np.percentile(every, 98)) if len(every) else 0.0) / FLOW_STEP)
        edges = np.arange(-FLOW_STEP, top + 0.5 * FLOW_STEP, FLOW_STEP)
        for name, values in found.items():
            if not len(values):
                continue
            share = np.full(len(values), 100.0 / len(values))
            colour, held = material.colour(name), np.minimum(values, top - 1e-6)
            axes.hist(held, edges, weights=share, color=colour, alpha=0.28, histtype="stepfilled")
            axes.hist(held, edges, weights=share, color=colour, lw=1.4, histtype="step", label=name)
            axes.axvline(float(values.mean()), color=colour, lw=1.2, ls=(0, (4, 3)))
            cases.append(f"{name} in {place} {values.mean():.1f} % ({words.count(len(values), 'robot')})")
        axes.set_title(place, loc="left")
        axes.set_xlabel("flow-time increase [%]")
        note_grid(axes)
    panels[0].set_ylabel("share of robots [%]")
    handles, labels = next((h for axes in panels if (h := axes.get_legend_handles_labels())[0]), ([], []))
    figure.legend(handles, labels, loc="outside upper left", ncols=2)
    caption = (
        f"Flow-time increase (l − l*) / l* of robots that arrived with both {ours} and {other}; l*: the shortest way "
        f"by A*. What is beyond the last bin is in it. Dashed: means, {', '.join(cases)}."
    )
    return picture(figure, "flow_time", caption, f"Flow-time increase of {ours} and {other}")


def field_picture(material: Material) -> Picture:
    """Return the interaction force (12) over the distance, with the pass band (SFM-MAS Fig. 2(d))."""
    planner = material.leading()
    runs: list[Run] = material.of("all", planner)
    keys = runs[0].config if runs else material.experiment.scenario
    sheets = keys.get("robot", {})
    sheet = sheets[0] if isinstance(sheets, list) else sheets
    robot = RobotModel.model_validate({key: value for key, value in sheet.items() if key != "start_s"})
    sigma = protection_model(body_of(robot)).sigma_a
    params = _defaults(material, planner) | dict(material.planner_keys(planner).get("params", {}))
    w_i = float(params.get("w_i", 1.0))
    distance = np.linspace(0.5 * sigma, 4.0 * sigma, 400)
    force = np.array([interaction_force(float(d), sigma, w_i) for d in distance])
    figure = new_figure(6.4, 3.2)
    axes = figure.subplots()
    axes.axvspan(sigma, 3.0 * sigma, color=OURS_COLOUR, alpha=0.10, lw=0)
    axes.axhline(0.0, color=FAINT, lw=0.9)
    axes.plot(distance, force, color=OURS_COLOUR, lw=2.0)
    top = int(np.argmax(force))
    peak_at, peak = float(distance[top]), float(force[top])
    high = max(peak, 1e-6)
    axes.set_ylim(-3.0 * high, 2.1 * high)
    axes.set_xlim(0.5 * sigma, 4.0 * sigma)
    axes.annotate(
        f"{peak:.3f} at {peak_at:.2f} m", (peak_at, peak), (peak_at, 1.35 * high), ha="center", color=INK, fontsize=8.5,
        arrowprops={"arrowstyle": "-", "color": FAINT, "lw": 0.8},
    )  # fmt: skip
    axes.text(2.0 * sigma, -0.6 * high, "pass band: takes part in the fusion", ha="center", va="top", fontsize=8.5)
    axes.text(0.53 * sigma, -0.6 * high, "repulsion", va="top", fontsize=8.5, color=FAINT)
    ticks = [sigma, 2.0 * sigma, 3.0 * sigma, 4.0 * sigma]
    names = [symbols(name) for name in ("σ_a", "2 σ_a", "3 σ_a", "4 σ_a")]
    axes.set_xticks(ticks, [f"{name}\n{tick:.2f} m" for name, tick in zip(names, ticks, strict=True)])
    axes.set_xlabel("distance of the neighbour")
    axes.set_ylabel(symbols("f_ai [1/m]"))
    note_grid(axes)
    caption = (
        f"Interaction force f_ai (12) of the experiment's robot for w_i = {w_i:g}: negative pushes apart, positive "
        f"weighs what the neighbour says. It is 0 at σ_a = {sigma:.2f} m; neighbours between σ_a and 3 σ_a take part. "
        "Computed, not measured."
    )
    return picture(figure, "field", caption, "Interaction force against distance")


def _stem(name: str) -> str:
    stem = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
    return stem or "value"

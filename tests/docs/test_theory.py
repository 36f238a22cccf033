"""The theory page: what it names exists, and its figures are what the code computes."""

from __future__ import annotations

import ast
import importlib.util
import math
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from swarmscope.errors import SwarmscopeError
from swarmscope.experiments.weight import NEIGHBOUR_PRINTED, SELF_PRINTED
from swarmscope.judging.run import figures as run_figures
from swarmscope.onboard.body import Body, protection_model
from swarmscope.onboard.deciding.fields import (
    following_probability,
    fuse,
    interaction_force,
    left_probability,
    neighbour_weight,
    yields_to,
)
from swarmscope.onboard.perception.areas import normalise, passable_distance, quadrant_area
from swarmscope.onboard.planners import load_planner
from swarmscope.onboard.reasons import STATE_NAMES
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import complete

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = [DOCS / f"{name}.md" for name in ("theory", "extending", "references")]
TEXT = PAGES[0].read_text(encoding="utf-8")
TABLE_THRESHOLD = 1.54


def load_figures():
    spec = importlib.util.spec_from_file_location("docs_figures", DOCS / "figures.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def figures():
    return load_figures()


def table(first_column):
    """The rows below the table head that begins with ``first_column``."""
    lines = TEXT.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith(f"| {first_column}"))
    rows = []
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def named_functions():
    found = re.findall(r"`([a-z_/0-9]+\.py): ([A-Za-z_0-9, ]+)`", TEXT)
    return [(path, name.strip()) for path, names in found for name in names.split(",")]


def test_the_page_names_functions():
    assert len(named_functions()) > 30


@pytest.mark.parametrize(("path", "name"), sorted(set(named_functions())))
def test_every_function_named_exists(path, name):
    tree = ast.parse((ROOT / "src" / "swarmscope" / path).read_text(encoding="utf-8"))
    assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_link_and_figure_exists(page):
    text = page.read_text(encoding="utf-8")
    targets = [t for t in re.findall(r"\]\(([^)#]+)", text) if not t.startswith("http")]
    assert all((page.parent / target).is_file() for target in targets), targets


def test_every_figure_is_made_and_shown(figures):
    shown = set(re.findall(r"\(figures/(\w+)\.png\)", TEXT))
    assert shown == set(figures.FIGURES)
    assert {p.stem for p in (DOCS / "figures").glob("*.png")} == shown


def test_formulas_stand_between_paired_marks():
    without = re.sub(r"^```math\n.+?^```$", "", TEXT, flags=re.DOTALL | re.MULTILINE)
    assert "$$" not in without
    assert "```math" not in without
    assert all(line.count("$") % 2 == 0 for line in without.splitlines())


@pytest.mark.parametrize("name", ["simulated robot, ours", "real robot, ours"])
def test_protection_rows(name):
    rows = table("| $r_c$")
    row = next(r for r in rows if r[0] == name)
    radius, half_width, v, a, delay = map(float, row[1:6])
    p = protection_model(Body(radius, half_width, v, a, sensor_delay_s=delay))
    assert row[6:] == [
        f"{p.r:.3f}",
        f"{p.l_th:.3f}",
        f"{math.degrees(p.alpha):.1f}",
        f"{p.sigma_a:.3f}",
        f"{p.w_n:.3f}",
    ]


def test_filter_rows(figures):
    rows = table("beta |")
    assert [float(row[0]) for row in rows] == list(figures.BETAS)
    assert figures.KAISER_BETA in figures.BETAS
    for row in rows:
        f = figures.filter_figures(float(row[0]))
        assert f["overshoot"] < 1e-6
        assert row[1:] == [
            f"{f['smallest_tap']:.5f}",
            f"{f['overshoot']:.3f}",
            f"{f['rise']:.1f}",
            f"{f['at_edge_db']:.1f}",
            f"{f['side_lobe_db']:.1f}",
        ]


def test_what_the_page_says_of_beta(figures):
    assert "\\beta \\approx 1.35" in TEXT
    assert "\\beta \\approx 2.81" in TEXT
    assert figures.filter_figures(1.34)["side_lobe_db"] > -30.0 > figures.filter_figures(1.36)["side_lobe_db"]
    half = 20.0 * math.log10(0.5)
    assert figures.filter_figures(2.80)["at_edge_db"] < half < figures.filter_figures(2.82)["at_edge_db"]


def decision_values(figures):
    h, q = figures.TABLE_HALF, 0.5 * math.pi
    features = {name: figures.table_features(name) for name in figures.TABLE_II}
    spans = ((0.0, h), (-h, 0.0), (h, q), (-q, -h))
    triangles = [quadrant_area(*features["R3"], *span, True) for span in spans]
    sectors = [quadrant_area(*features["R3"], *span, False) for span in spans]

    def passable(name, chords):
        return [passable_distance(*features[name], *span, chords) for span in spans[:2]]

    def following(name, chords, left):
        return following_probability(*passable(name, chords), TABLE_THRESHOLD, left)

    p, f = (0.395, 0.581, 0.403, 0.414), (0.236, 0.279, 0.266, 0.247)
    fused = fuse(0.504, sum(a * b for a, b in zip(p, f, strict=True)), sum(f))
    return {
        "areas I": ", ".join(f"{a:.4f}" for a in triangles),
        "P_s of R3": f"{left_probability(*triangles, 0.0):.4f}",
        "P_a of R3": f"{left_probability(*sectors, 0.0):.4f}",
        "x_1, x_2 of R2": ", ".join(f"{x:.3f}" for x in passable("R2", False)),
        "P_n of R2": f"{following('R2', False, True):.3f}",
        "x_1, x_2 of R4": ", ".join(f"{x:.3f}" for x in passable("R4", True)),
        "P_n of R4, right, borders on": f"{following('R4', True, False):.4f}",
        "P_n of R4, right, borders linear": f"{following('R4', False, False):.4f}",
        "fused": f"{fused:.3f}",
    }


def test_decision_rows(figures):
    rows = table("quantity")
    values = decision_values(figures)
    assert len(rows) == len(values)
    for begin, value in values.items():
        ours = [row[2] for row in rows if row[0].startswith(begin)]
        assert ours == [value], begin


def test_what_the_page_says_of_the_field():
    assert interaction_force(1.477 * 0.9, 0.9, 1.0) == pytest.approx(0.180, abs=5e-4)
    assert neighbour_weight(0.245, 0.446) == pytest.approx(0.193, abs=5e-4)
    assert interaction_force(3.50 * 0.9, 0.9, 1.0) > 0.0 > interaction_force(3.52 * 0.9, 0.9, 1.0)
    assert yields_to(0.5, interaction_force(0.686, 0.9, 1.0), 1.0)
    assert not yields_to(0.5, interaction_force(0.688, 0.9, 1.0), 1.0)
    real = protection_model(Body(0.43, 0.29, 0.5, 4.0, sensor_delay_s=0.0575))
    assert normalise(real.w_n, 5.0) == pytest.approx(TABLE_THRESHOLD, abs=0.002)


def test_scan_caption(figures):
    rig, printed, ranges = figures.forest_scan()
    x, y, _ = chain_module().SCAN_POSE
    assert f"x = {x:.1f} m, y = {y:.2f} m" in TEXT
    target = ranges.size // 2
    assert f"a tree {ranges[target]:.1f} m ahead" in TEXT
    assert figures.safe_of(printed, ranges)[target]
    assert not figures.safe_of(rig, ranges)[target]


@pytest.fixture(scope="module")
def steps():
    return chain_module().chain_of()


def chain_module():
    return importlib.import_module("figure_chain")


def test_what_the_scope_filter_leaves_is_what_is_safe(figures, steps):
    assert np.array_equal(steps.response >= steps.l_th - 1e-6, steps.safe)


def test_the_receiver_joins_what_was_sent(figures, steps):
    ahead = np.mod(steps.sent[0] + math.pi, 2 * math.pi) - math.pi
    at = np.round((ahead - steps.angles[0]) / (steps.angles[1] - steps.angles[0])).astype(int) % steps.angles.size
    assert steps.rebuilt[at] == pytest.approx(steps.sent[1], abs=0.1)
    assert set(steps.kept[0]) < set(steps.extrema[0])


def test_chain_caption(figures, steps):
    x, y, _ = chain_module().CHAIN_POSE
    off = steps.rebuilt - steps.scan
    assert f"x = {x:.2f} m, y = {y:.2f} m" in TEXT
    assert f"A tree {steps.scan[180]:.2f} m ahead makes {(~steps.safe).sum()} of 360 directions unsafe" in TEXT
    assert f"of {steps.extrema[0].size} extrema\n{steps.extrema[0].size - steps.kept[0].size} maxima fall out" in TEXT
    assert f"{steps.sent[0].size} features go out in {steps.packet_bytes} bytes" in TEXT
    assert f"on average {np.abs(off).mean():.2f} m off the scan, mostly below it" in TEXT
    assert (off < 0).mean() > 0.5


STALE = "run 'python docs/figures.py' and mend the caption"


def percent(values):
    return [f"{100.0 * value:.1f}" for value in values]


def test_playground_caption(figures):
    samples = importlib.import_module("figure_worlds").playground_samples()
    wrong, choices = samples.counts[0][:2]
    own, neighbours, weight = samples.weight.own, samples.weight.neighbours, samples.weight
    assert f"{wrong} of {choices} are wrong" in TEXT, STALE
    assert f"seeds {samples.seeds[0]}-{samples.seeds[-1]}" in TEXT
    said = (
        f"Over all, {100 * own.estimate:.1f} % of {own.used} choices\nand {100 * neighbours.estimate:.1f} % of "
        f"{neighbours.used} opinions are wrong (printed: {100 * SELF_PRINTED:.1f} and {100 * NEIGHBOUR_PRINTED:.1f} %)"
        f", so that by (21) the weight would be {weight.weight:.3f} "
        f"(bootstrap over the samples: {weight.low:.3f} to {weight.high:.3f})"
    )
    assert said in TEXT, STALE


def test_paths_caption(figures):
    worlds = importlib.import_module("figure_worlds")
    runs = worlds.printed_runs()
    gammas = {
        label: percent(run_figures(runs[label, task])["path_redundancy"] for task in worlds.TASKS)
        for label in worlds.PLANNERS
    }
    one, other = gammas["Nav-I"], gammas["Nav-SCOPE"]
    said = (
        f"Nav-I has {one[0]}, {one[1]} and {one[2]} % in T1, T2, T3, Nav-SCOPE {other[0]}, {other[1]} and {other[2]} %"
    )
    assert said in TEXT, STALE
    assert f"the forest of seed {worlds.FOREST_SEED}" in TEXT
    lost = {key: int((~np.isfinite(run.trace.robots["arrival_s"])).sum()) for key, run in runs.items()}
    assert lost == {key: int(key[1] == "T3") for key in runs}, STALE
    assert not any(run.trace.robots["crashed"].any() for run in runs.values())


def test_convergence_caption(figures):
    cases = importlib.import_module("figure_cases")
    runs = cases.map_runs()
    shares = {
        place: [f"{100 * cases.share_together(runs[place, label]):.0f}" for label in cases.PLANNERS]
        for place in cases.PLACES
    }
    forest, rocky = shares["forest"], shares["rocky"]
    assert f"{forest[0]}, {forest[1]} and {forest[2]} % of the ways in the forest" in TEXT, STALE
    assert f"{rocky[0]}, {rocky[1]} and {rocky[2]} % among rocks" in TEXT, STALE
    assert f"within {cases.TOGETHER_M:.2f} m" in TEXT


def test_ways_that_run_together_worked_by_hand(figures):
    cases = importlib.import_module("figure_cases")
    points = cases.along(np.array([0.0, 1.0, 1.0]), np.array([0.0, 0.0, 0.5]))
    assert points[[3, 12]] == pytest.approx(np.array([[0.3, 0.0], [1.0, 0.2]]))
    steps = np.linspace(0.0, 4.0, 41)
    x = np.column_stack([steps, steps, steps])
    y = np.column_stack([np.zeros(41), np.where(steps < 1.95, 0.3, 2.0), np.full(41, 9.0)])
    outcome = SimpleNamespace(trace=SimpleNamespace(records=SimpleNamespace(x=x, y=y)))
    (_, first), (_, second), (_, third) = cases.together(outcome)
    assert first.mean() == pytest.approx(0.56, abs=0.04)
    assert second[:19].all() and not second[-10:].any()
    assert not third.any()


@pytest.mark.parametrize("at", [0, 1])
def test_the_divergences_are_what_the_robot_heard(figures, at):
    cases = importlib.import_module("figure_cases")
    shown = cases.SHOWN[at]
    drawn = cases.case_of(shown)
    case, half = drawn.case, 0.5 * drawn.outcome.setting.rig.protection.alpha
    sides = {n["id"]: n["side"] for n in case["neighbours"]}
    assert (case["kind"], case["decisive"], case["side"]) == ("divergence", shown.follower_of, drawn.told), STALE
    assert sides[shown.follower_of] == -case["side"]
    assert sides[shown.goes_to] == case["side"]
    threshold = normalise(drawn.outcome.setting.rig.protection.w_n, cases.RANGE_M)
    for n in case["neighbours"]:  # P_ni follows from the polygon that is drawn
        angles, distances, count = cases.aligned(drawn.heard[n["id"]], case["target"])
        normal = np.array([normalise(d, cases.RANGE_M) for d in distances])
        spans = ((0.0, half), (-half, 0.0))
        x_1, x_2 = (passable_distance(angles, normal, count, *span, True) for span in spans)
        assert following_probability(x_1, x_2, threshold, n["side"] > 0) == pytest.approx(n["p"], abs=1e-3)
    assert f"$P_{{dir}}$ = {case['p_left']:.3f}" in TEXT, STALE
    assert f"{shown.density:g} {'trees ' if at == 0 else ''}per m²" in TEXT


def test_waits_that_follow_at_once_are_one(figures):
    worlds = importlib.import_module("figure_worlds")
    state = np.zeros((60, 1), np.uint8)
    state[[5, 6, 9, 40]] = STATE_NAMES.index("yield")
    records = SimpleNamespace(state=state, x=np.arange(60.0)[:, None], y=np.zeros((60, 1)))
    trace = SimpleNamespace(choices=np.zeros(0), records=records)
    marks = worlds.marks_of(SimpleNamespace(trace=trace, setting=SimpleNamespace(dt=0.2)))
    assert marks.waits[:, 0].tolist() == [5.0, 40.0]


def _accepted(group, keys, planner):
    values = {"planner": {"name": planner, "params": keys}} if group == "params" else {group: keys}
    try:
        complete(parse_scenario({"task": {"name": "T1"}} | values, "theory.md"))
    except SwarmscopeError:
        return False
    return True


def test_the_keys_that_restore_the_print_can_be_set():
    block = TEXT.split("## Where we differ")[1]
    found = re.findall(r"`(safety|features|params): (\{[^}]+\})`", block)
    assert len(found) > 10
    for group, text in found:
        keys = yaml.safe_load(text)
        assert any(_accepted(group, keys, planner) for planner in ("nav-scope", "dh-bug")), (group, text)


def test_what_the_table_restores_is_what_the_presets_set():
    block = TEXT.split("## Where we differ")[1]
    told = {}
    for group, text in re.findall(r"`(safety|features|params): (\{[^}]+\})`", block):
        place = "planner.params" if group == "params" else group
        told |= {f"{place}.{key}": value for key, value in yaml.safe_load(text).items()}
    for planner in ("nav-scope", "sfm-mas", "dh-bug"):
        for key, value in load_planner(planner).presets["printed"].items():
            assert told[key] == (pytest.approx(value, abs=1e-3) if isinstance(value, float) else value), key


def test_the_place_for_results_is_marked():
    assert TEXT.count("<!-- results -->") <= 1

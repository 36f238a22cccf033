"""The theory page: what it names exists, and its figures are what the code computes."""

from __future__ import annotations

import ast
import importlib.util
import math
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from swarmscope.errors import SwarmscopeError
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

"""The report: right numbers in its tables, right words in its summary, one file that needs nothing else."""

from __future__ import annotations

import errno
import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from report_data import SMALL, all_played, experiment, hand_made, played

from swarmscope.errors import SwarmscopeError
from swarmscope.experiments.experiment import load_experiment, shipped_experiment, units
from swarmscope.experiments.results import pooled_figures
from swarmscope.experiments.weight import WeightResult
from swarmscope.judging.statistics import Interval, PairedDifference, wilson
from swarmscope.viewing.report import figures, markdown, publish, tables, words, write_report
from swarmscope.viewing.report.again import Again
from swarmscope.viewing.report.blocks import Row, Table
from swarmscope.viewing.report.cases import case_picture, case_table, strongest
from swarmscope.viewing.report.drawing import style
from swarmscope.viewing.report.material import POOLED, Material, figure_of, pooled_interval
from swarmscope.viewing.report.paths import median_seed
from swarmscope.viewing.report.summary import departures, summary_blocks

WEIGHT = WeightResult(
    Interval(0.24, 0.2, 0.28, 90), Interval(0.44, 0.4, 0.48, 200), 0.21, 0.1, 0.3, 0.18, list(range(2000, 2009))
)
RUNS = [
    hand_made("P", "Bug", 0, [20.0, 10.0]),
    hand_made("P", "Bug", 1, [20.0, 20.0]),
    hand_made("P", "Ours", 0, [10.0, 10.0]),
    hand_made("P", "Ours", 1, [10.0, 20.0], late=(1,)),
]


def texts(row: Row) -> list[str]:
    return [" | ".join(line.text for line in value) for value in row.values]


def rows_of(table: Table) -> dict[str, list[str]]:
    return {texts(row)[0]: texts(row)[1:] for row in table.rows}


def summary_of(material: Material) -> str:
    points = summary_blocks(material)[0]
    return " ".join(f"{lead} {text}" for _, lead, text in points.entries)  # type: ignore[union-attr]


def test_gamma_is_pooled_over_the_robots_of_all_maps():
    rows = rows_of(tables.metric_table(Material(experiment(), RUNS), "path_redundancy"))
    # ours: AR 3/4, 30 m of 30 m -> 25 %; over all robots 1 - 3/4 40/50 = 40 %. Bug: 1 - 40/70 = 42.9 %
    assert rows["Ours"][0].startswith("25.0 %")
    assert "all robots 40.0 %" in rows["Ours"][0]
    assert rows["Bug"][0].startswith("42.9 %")


def test_a_published_planner_that_is_not_run_stands_with_its_value():
    rows = rows_of(tables.metric_table(Material(experiment(), RUNS), "path_redundancy"))
    assert rows["Ghost"] == ["not run | published 10.0 %", "not run"]
    assert rows["Ours"][1] == "not run | published 50.0 %"


@pytest.mark.parametrize(
    ("metric", "found", "published", "said", "mark"),
    [
        ("path_redundancy", Interval(0.027, 0.02, 0.03, 9), 0.051, "2.4 points better than published 5.1 %", "good"),
        ("path_redundancy", Interval(0.07, 0.06, 0.08, 9), 0.051, "1.9 points worse than published 5.1 %", "bad"),
        ("path_redundancy", Interval(0.06, 0.05, 0.07, 9), 0.051, "published 5.1 % is within the interval", ""),
        ("arrival_rate", Interval(0.9, 0.88, 0.92, 9), 0.8, "10.0 points better than published 80.0 %", "good"),
        ("path_stretch", Interval(1.05, 1.04, 1.06, 9), 1.079, "0.029 better than published 1.079", "good"),
        ("duration_s", Interval(70.0, math.nan, math.nan, 1), 66.2, "3.8 s worse than published 66.2 s, one map", ""),
        ("duration_s", Interval(66.21, 60.0, 70.0, 9), 66.2, "equal to published 66.2 s", ""),
        ("spl", Interval(math.nan, math.nan, math.nan, 0), 0.9, "published 90.0 %", ""),
    ],
)
def test_words_of_a_difference_from_the_published_value(
    metric: str, found: Interval, published: float, said: str, mark: str
):
    assert words.against_published(metric, found, published) == (said, mark)


def test_targets_are_open_where_the_interval_holds_both():
    rows = tables.target_table(Material(experiment(), RUNS)).rows
    assert texts(rows[0])[3] == "at most 5.0 %"
    assert texts(rows[0])[5] == "open: the interval holds the target"
    assert texts(rows[1])[5] == "open: the interval holds the target"
    said = summary_of(Material(experiment(), RUNS))
    assert "0 of 2 are met. Of 2 the interval holds both: they are neither met nor missed." in said


@pytest.mark.parametrize(
    ("metric", "found", "at_most", "at_least", "said"),
    [
        ("arrival_rate", (0.9998, 0.9997, 0.9999), None, 1.0, ("missed by less than 0.1 points", "bad")),
        ("arrival_rate", (0.9, 0.85, 0.94), None, 1.0, ("missed by 10.0 points", "bad")),
        ("arrival_rate", (1.0, 0.99, 1.0), None, 1.0, ("open: the interval holds the target", "")),
        ("arrival_rate", (1.0, 0.99, 1.0), None, 0.95, ("met, 5.0 points to spare", "good")),
        ("duration_s", (66.2, 66.2, 66.2), 66.2, None, ("met exactly", "good")),
        ("duration_s", (60.0, 50.0, 66.0), 66.2, None, ("met, 6.2 s to spare", "good")),
        ("duration_s", (60.0, 50.0, 67.0), 66.2, None, ("open: the interval holds the target", "")),
        ("duration_s", (70.0, 60.0, 80.0), 66.2, None, ("open: the interval holds the target", "")),
        ("duration_s", (70.0, 67.0, 80.0), 66.2, None, ("missed by 3.8 s", "bad")),
        ("duration_s", (70.0, math.nan, math.nan), 66.2, None, ("open: one map", "")),
        ("duration_s", (math.nan, math.nan, math.nan), 66.2, None, ("not measured", "bad")),
    ],
)
def test_a_target_is_met_or_missed_only_where_the_whole_interval_is(metric, found, at_most, at_least, said):
    assert words.against_bound(metric, Interval(*found, 100), at_most, at_least) == said


def test_the_order_of_planners_and_the_evidence_against_it():
    better = [replace(run, planner={"Bug": "Ours", "Ours": "Bug"}[run.planner]) for run in RUNS]
    assert departures(Material(experiment(), RUNS), "path_redundancy", "P") == []
    assert departures(Material(experiment(), RUNS), "path_redundancy", "Q") is None
    swaps = departures(Material(experiment(), better), "path_redundancy", "P")
    assert swaps is not None
    assert [(swap.better, swap.worse, swap.is_evidence) for swap in swaps] == [("Ours", "Bug", False)]
    assert swaps[0].gap.used == 2
    said = summary_of(Material(experiment(), better))
    assert "holds in 0 of 1 columns" in said
    assert "Ours is behind Bug by path redundancy γ (P), without evidence" in said


def test_an_order_that_the_paired_differences_refute_is_said_with_its_numbers():
    bug = [hand_made("P", "Bug", seed, [11.0] * 2) for seed in range(8)]
    ours = [hand_made("P", "Ours", seed, [14.0 + 0.1 * seed] * 2) for seed in range(8)]
    said = summary_of(Material(experiment(), [*bug, *ours]))
    assert re.search(r"Ours is behind Bug by path redundancy γ \(P: \+21\.\d points \[.*\], p = 0.008, 8 maps\)", said)
    assert "which the paired differences confirm" in said
    assert "Ours is worse than Bug in P" in said


def test_paired_differences_with_holm():
    bug = [hand_made("P", "Bug", seed, [14.0 + 0.1 * seed] * 2) for seed in range(8)]
    ours = [hand_made("P", "Ours", seed, [11.0] * 2) for seed in range(8)]
    table = tables.paired_table(Material(experiment(), [*bug, *ours]), "path_redundancy")
    assert table is not None
    assert rows_of(table)["minus Bug"][0].startswith("−21.")
    assert "p = 0.008, Holm = 0.008, 8 maps" in rows_of(table)["minus Bug"][0]
    assert rows_of(table)["minus Bug"][0].endswith("better")
    assert rows_of(table)["minus Bug"][1] == "not run"


def test_holm():
    assert words.holm([0.04, 0.01, math.nan, 0.03]) == pytest.approx([0.06, 0.03, math.nan, 0.06], nan_ok=True)
    assert words.holm([0.6, 0.9]) == [1.0, 1.0]
    assert words.holm([]) == []


@pytest.mark.parametrize("metric", POOLED)
def test_bootstrap_of_a_pooled_figure_is_centred_on_it(metric: str):
    rng = np.random.default_rng(0)
    runs = [
        hand_made("P", "Ours", s, list(rng.uniform(9.0, 16.0, 5)), late=(0,) if s % 3 == 0 else ()) for s in range(40)
    ]
    found = pooled_interval(runs, metric)
    assert found.estimate == pytest.approx(pooled_figures(runs)[metric])
    assert found.low < found.estimate < found.high
    assert abs(0.5 * (found.low + found.high) - found.estimate) < 0.2 * (found.high - found.low)
    assert pooled_interval([replace(runs[0], seed=s) for s in range(3)], metric)[1:3] == pytest.approx(
        [pooled_figures(runs[:1])[metric]] * 2
    )


def test_one_map_has_no_interval_and_no_maps_no_figure():
    assert math.isnan(figure_of(RUNS[:1], "path_redundancy").low)
    assert math.isnan(figure_of([], "arrival_rate").estimate)
    assert words.interval("spl", figure_of(RUNS[:1], "spl")) == ""


GAP: dict[str, Any] = {
    "planners": {name: {"planner": {"params": {"w_i": k}}} for k, name in enumerate(("Left", "Right", "Ours", "Told"))},
    "order": [],
    "targets": [],
    "gap": {"worst": "Left", "best": "Told"},
    "flow_time": "Right",
    "figures": ["flow_time"],
    "published": [
        {"source": "A", "metric": "mover_path_m", "values": {"P": {"Left": 20.0, "Ours": 19.0, "Told": 15.0}}}
    ],
}
GAP_RUNS = [
    hand_made("P", name, seed, [length + seed, length])
    for name, length in (("Left", 20.0), ("Right", 18.0), ("Ours", 16.0), ("Told", 12.0))
    for seed in (0, 1)
]


def test_the_gap_table_says_what_share_is_closed_beside_the_published_one():
    table = tables.gap_table(Material(experiment(**GAP), GAP_RUNS))
    assert table is not None
    rows = rows_of(table)
    assert list(rows) == ["Right", "Ours", "Told"]
    # (4 + 4 + 4 + 4) m of 81 m, and of the 32 m that Told saves
    assert rows["Ours"][0].startswith("19.8 % | [19.5, 20.0] | closes 50.0 % [50.0, 50.0] | 4 robots, 2 maps")
    assert rows["Ours"][0].endswith("published 5.0 %, closes 20 %")
    assert "closes" not in rows["Told"][0] and rows["Told"][0].endswith("published 25.0 %")
    assert rows["Ours"][1] == "not run"
    assert tables.gap_table(Material(experiment(), RUNS)) is None


def test_a_gap_can_be_a_target():
    names = ("path_reduction", "gap_closed")
    targets = [{"planner": "Ours", "place": "P", "metric": name, "at_least": 0.5} for name in names]
    material = Material(experiment(**(GAP | {"targets": targets})), GAP_RUNS)
    found = material.gap("P", "Ours")
    assert material.figure("P", "Ours", "gap_closed") == found.closed
    shown = rows_of(tables.target_table(material))
    assert list(shown) == ["Ways shorter by", "Gap closed"]


def test_flow_times_are_drawn_and_their_means_said(tmp_path: Path):
    material = Material(experiment(**GAP), GAP_RUNS)
    with style():
        found = figures.flow_time_picture(material)
    assert found is not None
    assert "Right in P 82.5 % (4 robots), Ours in P 62.5 % (4 robots)" in found.caption
    assert figures.flow_time_picture(Material(experiment(), RUNS)) is None
    write_report(experiment(**GAP), GAP_RUNS, tmp_path / "r")
    page = (tmp_path / "r/report.html").read_text()
    assert "Flow-time increase" in page and "worst: Left" in page


def test_shares_of_movers_and_of_judged_choices_are_pooled():
    counted = [{"movers": 10.0, "mover_arrival_rate": 0.9}, {"movers": 30.0, "mover_arrival_rate": 1.0}]
    judged = [{"side_accuracy": 1.0, "sides_judged": 2.0}, {"side_accuracy": 0.5, "sides_judged": 6.0}]
    runs = [hand_made("P", "Ours", k, [10.0], **(counted[k] | judged[k])) for k in range(2)]
    arrived = figure_of(runs, "mover_arrival_rate")
    assert arrived == (pytest.approx(39 / 40), pytest.approx(0.9), 1.0, 40)  # robots of a map stand or fall together
    everybody = [hand_made("P", "Ours", k, [10.0], movers=10.0, mover_arrival_rate=1.0) for k in range(2)]
    assert figure_of(everybody, "mover_arrival_rate") == wilson(2, 2)._replace(used=20)
    single = [hand_made("P", "Ours", k, [10.0], movers=1.0, mover_arrival_rate=float(k > 0)) for k in range(4)]
    assert figure_of(single, "mover_arrival_rate") == wilson(3, 4)
    assert figure_of(runs, "side_accuracy")[:1] == (pytest.approx(5 / 8),)
    nobody = [hand_made("P", "Ours", 0, [10.0], side_accuracy=None, sides_judged=0.0)]
    assert math.isnan(figure_of(nobody, "side_accuracy").estimate)


def test_failures_are_counted_and_named():
    material = Material(experiment(), RUNS)
    assert rows_of(tables.failure_table(material))["Ours"][0] == "N_a 1 of 4 | no collisions | N_u 8 (2.0 per robot)"
    assert [texts(row) for row in tables.named_failures(material)] == [["P", "1", "1", "lost <in> the wood"]]


def test_collisions_are_said_by_planner():
    hit = [replace(run, figures=run.figures | {"collisions": 1.0}) if run.planner == "Bug" else run for run in RUNS]
    assert "Robots that touched something: Bug 2 of 4. None with Ours." in summary_of(Material(experiment(), hit))
    assert "None in 8 journeys of Bug and Ours." in summary_of(Material(experiment(), RUNS))


@pytest.mark.parametrize(
    ("metric", "number", "said"),
    [
        ("path_redundancy", -0.0004, "0.0 %"),
        ("path_redundancy", -0.02, "−2.0 %"),
        ("plan_us_p50", 15.8, "15.8 µs"),
        ("plan_us_p50", 1200.0, "1.2 ms"),
        ("planner_memory_bytes", 14900.0, "14.9 kB"),
        ("planner_memory_bytes", 3500000.0, "3.5 MB"),
        ("path_stretch", 1.0541, "1.054"),
        ("collisions", 3.0, "3"),
        ("duration_s", None, "–"),
        ("duration_s", math.nan, "–"),
    ],
)
def test_numbers_have_the_digits_they_deserve(metric: str, number: float | None, said: str):
    assert words.value(metric, number) == said


def test_words_for_seeds_p_values_and_bounds():
    assert words.spans([3, 1, 2, 7, 7]) == "1–3, 7"
    assert words.p_words(0.0004) == "p < 0.001"
    assert words.interval("path_redundancy", PairedDifference(0.0, -0.02, 0.01, 5, 0.5), True) == "[−2.0, +1.0]"


def test_the_picture_of_paths_is_of_the_median_seed():
    runs = [hand_made("P", "Ours", seed, [10.0 + way]) for seed, way in enumerate((5.0, 1.0, 9.0, 3.0))]
    assert median_seed(Material(experiment(), runs)) == 3
    assert median_seed(Material(experiment(), [])) is None


CASE = {
    "kind": "convergence", "tick": 2, "t_s": 0.4, "robot": 4, "x": 0.0, "y": 0.0, "target": 0.0, "p_self": 0.48,
    "p_left": 0.5172, "side": 1, "decisive": 7, "neighbours": [{"id": 7, "side": 1, "p": 0.7, "f": 0.2}],
}  # fmt: skip


def test_a_case_shows_every_vote():
    rows = [texts(row) for row in case_table(CASE).rows]
    assert rows[0] == ["4 (itself)", "–", "0.480", "1.000", "−0.020"]
    assert rows[1] == ["7 (decisive)", "left", "0.700", "0.200", "+0.040"]
    assert rows[2] == ["P_dir", "left", "0.517", "1.200", "+0.020"]


def test_the_strongest_case_is_that_with_the_largest_change():
    weak = CASE | {"p_left": 0.51}
    runs = [replace(RUNS[2], cases=[weak]), replace(RUNS[3], cases=[CASE])]
    best = strongest(Material(experiment(), runs), "convergence")
    assert best is not None
    assert best[1] is CASE
    assert strongest(Material(experiment(), runs), "divergence") is None


class Assets(HTMLParser):
    """Collects what a page would load, and its words."""

    def __init__(self) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.tags: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.tags.append(tag)
        self.loads += [str(values[name]) for name in ("src", "srcset", "data", "poster") if name in values]
        self.loads += [str(values["href"])] if tag == "link" else []
        self.links += [str(values["href"])] if tag == "a" else []
        self.ids += [str(values["id"])] if "id" in values else []


def read(page: Path) -> tuple[str, Assets]:
    text, found = page.read_text(encoding="utf-8"), Assets()
    found.feed(text)
    return text, found


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of played runs, with every figure."""
    what = experiment(**SMALL)
    return write_report(what, all_played(what), tmp_path_factory.mktemp("report") / "out", WEIGHT)


def test_the_page_needs_nothing_else(full: Path):
    text, found = read(full)
    assert found.loads
    assert all(address.startswith("data:") for address in found.loads)
    assert "http://" not in re.sub(r'data:[^"]*', "", text)
    assert "https://" not in re.sub(r'data:[^"]*', "", text)
    assert "@import" not in text
    assert "script" not in found.tags
    assert "{{" not in text
    assert len(found.ids) == len(set(found.ids))
    assert {link.removeprefix("#") for link in found.links} <= set(found.ids)


def test_the_markdown_file_has_the_same_tables_and_its_pictures(full: Path):
    text = (full.parent / "report.md").read_text(encoding="utf-8")
    page, found = read(full)
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert len(pictures) == found.tags.count("img") >= 6
    for name in pictures:
        assert (full.parent / name).read_bytes().startswith(b"\x89PNG")
    assert re.findall(r"\*\*(Table \d+)\.", text) == re.findall(r"<b>(Table \d+)\.", page)
    for line in text.splitlines():
        if line.startswith("|"):
            assert len(re.findall(r"(?<!\\)\|", line)) >= 3


def test_the_same_runs_give_the_same_bytes(full: Path, tmp_path: Path):
    what = experiment(**SMALL)
    again = write_report(what, all_played(what), tmp_path / "again", WEIGHT)
    without = re.compile(r"<table.*?</table>", re.S)  # planning times are measured
    assert without.sub("", again.read_text("utf-8")) == without.sub("", full.read_text("utf-8"))
    for picture in sorted((full.parent / "figures").iterdir()):
        assert picture.read_bytes() == (tmp_path / "again" / "figures" / picture.name).read_bytes(), picture.name


def test_replayed_runs_are_the_measured_ones_and_cases_lie_on_their_paths():
    what = experiment(seeds="0-9", scenario={"limit_s": 15.0}, sweeps=[])
    for unit in units(what):
        run = played(unit)
        if unit.planner == "Ours" and run.cases:
            break
    else:
        pytest.fail("no neighbour turned any choice round in twenty runs")
    again = Again()
    shown = again.of(run)
    assert np.array_equal(shown.arrived, np.isfinite(run.arrival_s))
    for case in run.cases:
        tick, robot = case["tick"], case["robot"]
        assert (shown.x[tick, robot], shown.y[tick, robot]) == (case["x"], case["y"])
        neighbour = case["neighbours"][0]
        to = np.array([shown.x[tick, neighbour["id"]] - case["x"], shown.y[tick, neighbour["id"]] - case["y"]])
        left = math.cos(case["target"]) * to[1] - math.sin(case["target"]) * to[0]
        assert np.sign(left) == neighbour["side"]
    with style():
        drawn = case_picture(run, run.cases[0], again)
    assert drawn.name == f"case_{run.cases[0]['kind']}"
    assert f"robot {run.cases[0]['robot']} at" in drawn.caption
    assert drawn.beside is not None


def test_a_map_of_many_cells_becomes_an_image_in_the_picture(tmp_path: Path):
    office = {"O": {"map": {"file": "willow_garage_office"}}}
    what = experiment(
        places=office, scenario={"robots": 2, "limit_s": 2.0}, seeds="0", figures=["paths"], targets=[], published=[]
    )
    page = write_report(what, all_played(what), tmp_path)
    assert page.stat().st_size < 1_000_000


def test_text_is_escaped(tmp_path: Path):
    page = write_report(experiment(), RUNS, tmp_path)
    text, found = read(page)
    assert "<title>A &amp; B &lt;in&gt; one table</title>" in text
    assert "&lt;one&gt;" in text
    assert "<b>not</b>" not in text
    assert "Trees are &lt;b&gt;not&lt;/b&gt; printed | at all." in text
    assert "lost &lt;in&gt; the wood" in text
    assert "in" not in found.tags
    plain = (tmp_path / "report.md").read_text("utf-8")
    assert r"Trees are &lt;b&gt;not&lt;/b&gt; printed \| at all." in plain


def every_figure(**changes: Any) -> Any:
    return experiment(**(SMALL | changes))


@pytest.mark.parametrize(
    ("what", "runs"),
    [
        (every_figure(), []),
        (every_figure(), RUNS[2:3]),
        (every_figure(), RUNS[:2]),
        (
            every_figure(),
            [hand_made("P", "Ours", 0, [3.0, 4.0], late=(0, 1)), hand_made("P", "Bug", 0, [3.0], late=(0,))],
        ),
        (every_figure(ours=None, published=[], sweeps=[], order=[], targets=[], metrics=[]), RUNS),
        (every_figure(figures=[], metrics=["fusions", "min_clearance_m"]), RUNS),
    ],
    ids=["no runs", "one run", "ours is missing", "nobody arrived", "bare experiment", "figures missing"],
)
def test_a_report_stands_with_whatever_there_is(what: Any, runs: list[Any], tmp_path: Path):
    said: list[str] = []
    text, _ = read(write_report(what, runs, tmp_path, progress=said.append))
    assert "nan" not in re.sub(r'data:[^"]*', "", text).lower().replace("plan", "")
    assert said[0] == "tables"


def test_unknown_reference_ways_do_not_disturb(tmp_path: Path):
    blind = [replace(run, shortest_m=np.full(2, np.nan), figures={"arrival_rate": 1.0}) for run in RUNS]
    text, _ = read(write_report(every_figure(figures=["boxes"]), blind, tmp_path))
    assert "nothing" not in text


def test_a_run_that_cannot_be_played_again_leaves_a_note(tmp_path: Path):
    gone = [replace(run, config=run.config | {"task": {"name": "T9"}}) for run in RUNS]
    text, _ = read(write_report(every_figure(figures=["paths"]), gone, tmp_path))
    assert "This could not be drawn" in text


def test_the_shipped_experiment_has_a_report(tmp_path: Path):
    from swarmscope.onboard.planners import planner_names

    if not {"dh-bug", "orca", "nav-i", "oracle"} <= set(planner_names()):
        pytest.skip("planners of the shipped experiment are missing")
    what = load_experiment(shipped_experiment("nav-scope"))
    assert units(what, 1)
    text, _ = read(write_report(what, [], tmp_path))
    assert "swarmscope reproduce nav-scope" in text


def test_files_are_replaced_and_nothing_is_left_behind(tmp_path: Path):
    (tmp_path / "mine.txt").write_text("stays")
    (tmp_path / ".report.partial-999999999").mkdir()
    for title in ("first", "second"):
        page = write_report(experiment(title=title, figures=["field"]), RUNS, tmp_path)
        assert f"<title>{title}</title>" in page.read_text("utf-8")
    names = sorted(entry.name for entry in tmp_path.iterdir())
    assert names == ["figures", "mine.txt", "report.html", "report.md"]


def test_a_full_disk_leaves_the_earlier_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    page = write_report(experiment(title="first", figures=["field"]), RUNS, tmp_path)

    def full_disk(path: Path, content: bytes) -> None:
        if path.name == "report.html":
            raise OSError(errno.ENOSPC, "No space left on device")
        whole(path, content)

    whole = publish._write
    monkeypatch.setattr(publish, "_write", full_disk)
    with pytest.raises(SwarmscopeError, match=f"{re.escape(str(tmp_path))}.*the disk is full"):
        write_report(experiment(title="second", figures=["field"]), RUNS, tmp_path)
    assert "first" in page.read_text("utf-8")
    assert "first" in (tmp_path / "report.md").read_text("utf-8")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["figures", "report.html", "report.md"]


def test_a_place_that_is_a_file_is_named(tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SwarmscopeError, match="file"):
        write_report(experiment(), RUNS, tmp_path / "file")


def test_markdown_signs_are_escaped():
    assert markdown._plain("a|b *c* <d> `e` [f]_g") == r"a\|b \*c\* &lt;d&gt; \`e\` \[f\]\_g"

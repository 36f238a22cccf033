"""Scans as people bring them, each with its right value; the inputs are those of public reports, made anew here."""

from __future__ import annotations

import math

import numpy as np
import pytest
from command_line import refused, swarmscope

from swarmscope.experiments.lay_out_scans import Use
from swarmscope.experiments.perceive import perceive
from swarmscope.sim.scan_files import load_scans

STEP = 2.0 * math.pi / 360
OPEN = np.full(360, np.inf)


def written(folder, *scans, first=-math.pi, step=STEP, least=0.1, longest=12.0, separator=",", name="scan.csv"):
    """A file of scans, beams in the order given."""
    head = f"# angle_min={first!r} angle_increment={step!r} range_min={least} range_max={longest}\n"
    rows = "".join(separator.join(f"{value:.4f}" for value in scan) + "\n" for scan in scans)
    (folder / name).write_text(head + rows)
    return folder / name


def safe_in(file, **use):
    return perceive(load_scans(file), Use(**use)).safe.sum(axis=1).tolist()


def with_wall():
    """A wall 0.6 m away, 20 degrees wide, 30 degrees to the left."""
    scan = OPEN.copy()
    scan[180 + 20 : 180 + 40] = 0.6
    return scan


def test_zeros_block_unless_they_mean_no_return(tmp_path):
    scan = np.where(np.isinf(with_wall()), 0.0, with_wall())
    file = written(tmp_path, scan)
    seen = perceive(load_scans(file))
    assert (seen.safe.sum(), seen.counts.below.tolist()) == (0, [340])
    assert safe_in(file, no_return=[0.0]) == safe_in(written(tmp_path, with_wall(), name="inf.csv"))
    said = swarmscope("perceive", file).stdout
    assert "340 of 360: 340 block" in said and "--no-return 0" in said
    assert "below" not in swarmscope("perceive", file, "--no-return", 0).stdout


@pytest.mark.parametrize("bad", [math.nan, -1.0])
@pytest.mark.parametrize("broken", [[10], [0, 359], [5, 100, 200, 201, 300]])
def test_what_is_safe_without_broken_beams_is_safe_with_them(tmp_path, bad, broken):
    scan = OPEN.copy()
    scan[broken] = bad
    seen = perceive(load_scans(written(tmp_path, scan)))
    assert (seen.safe.sum(), seen.counts.broken.tolist(), seen.counts.below.tolist()) == (360, [len(broken)], [0])


def test_beams_may_run_clockwise_or_hang_upside_down(tmp_path):
    right = perceive(load_scans(written(tmp_path, with_wall())))
    clockwise = written(tmp_path, np.roll(with_wall()[::-1], 1), first=math.pi, step=-STEP, name="clockwise.csv")
    backwards = perceive(load_scans(clockwise))
    mirrored = written(tmp_path, np.roll(with_wall()[::-1], 1), name="hanging.csv")
    hanging = perceive(load_scans(mirrored), Use(upside_down=True))
    for seen in (backwards, hanging):
        assert np.array_equal(seen.safe, right.safe)
        assert seen.features[0] == pytest.approx(right.features[0], abs=1e-5)
    assert right.safe[0, 180 + 20 : 180 + 40].sum() == 0 and right.safe[0, 180 - 40 : 180 - 20].all()


@pytest.mark.parametrize("beams", [360, 361])
@pytest.mark.parametrize("turn", [2.0 * math.pi, 6.28, 2.0 * math.pi * 359 / 360])
def test_circles_are_closed_however_they_are_spelled(tmp_path, beams, turn):
    file = written(tmp_path, np.full(beams, np.inf), first=0.0, step=turn / (beams - 1))
    seen = perceive(load_scans(file))
    assert seen.rig.sensor.wraps and seen.safe.all()


def test_scans_may_differ_by_a_beam(tmp_path):
    file = written(tmp_path, np.full(456, 3.0), np.full(455, 3.0), first=0.0, step=0.013808)
    seen = perceive(load_scans(file), Use(range_m=3.5))
    assert seen.safe.all() and not seen.counts.broken.any()


def test_posts_of_the_robot_itself_can_be_masked(tmp_path):
    scan = OPEN.copy()
    posts = [180 + at + off for at in (-135, -45, 45, 135) for off in (-1, 0, 1)]
    scan[posts] = 0.1
    file = written(tmp_path, scan, least=0.05)
    assert safe_in(file) == [0]
    masks = [(at - 1.5, at + 1.5) for at in (-135, -45, 45, 135)]
    seen = perceive(load_scans(file), Use(masks_deg=masks))
    assert (seen.safe.sum(), seen.counts.own.tolist()) == (360, [12])
    words = [word for first, last in masks for word in ("--mask", f"{first}..{last}")]
    assert "12 of 360: 12 bridged" in swarmscope("perceive", file, *words).stdout
    across = np.full(360, np.inf)
    across[[0, 359]] = 0.1
    assert safe_in(written(tmp_path, across, name="back.csv"), masks_deg=[(178.0, -178.0)]) == [360]
    for text in ("45", "1..x", "nan..3"):
        assert "FROM..TO" in refused("perceive", file, "--mask", text)


@pytest.mark.parametrize("separator", [",", ";", " ", "\t", ", ", ",\t"])
@pytest.mark.parametrize("end", ["", ",", ";", " "])
def test_separators_of_all_kinds(tmp_path, separator, end):
    file = written(tmp_path, np.full(181, 3.0), first=-0.5 * math.pi, separator=separator)
    lines = file.read_text().split("\n")
    file.write_bytes((lines[0] + "\r\n" + lines[1] + end + "\r\n").encode())
    log = load_scans(file)
    assert log.ranges_m.shape == (1, 181) and (log.ranges_m == 3.0).all()


def test_degrees_and_millimetres_are_noticed(tmp_path):
    right = safe_in(written(tmp_path, np.full(181, 3.0), first=-0.5 * math.pi, longest=30.0))
    degrees = written(tmp_path, np.full(181, 3.0), first=-90.0, step=1.0, longest=30.0, name="degrees.csv")
    millimetres = written(tmp_path, np.full(181, 3000.0), first=-0.5 * math.pi, longest=30.0, name="mm.csv")
    assert safe_in(degrees) == safe_in(millimetres) == right
    assert "read as degrees" in swarmscope("perceive", degrees).output
    assert "read as millimetres" in swarmscope("perceive", millimetres).output
    far = written(tmp_path, np.full(181, 31.0), first=-0.5 * math.pi, longest=30.0, name="far.csv")
    assert load_scans(far).notes == () and np.isinf(load_scans(far).ranges_m).all()


def test_tables_of_ros_tools(tmp_path):
    """As ``rostopic echo -p`` writes them, and with the header in a comment; columns in any order."""
    names = ["%time", "field.header.stamp", "field.angle_min", "field.angle_increment", "field.range_min"]
    names += ["field.range_max", "field.ranges1", "field.ranges0", "field.ranges10", "field.ranges2", "intensities0"]
    row = ["1600000000100000000", "1600000000000000000", "-0.7", "0.2", "0.1", "10", "2.0", "1.0", "4.0", "inf", "9"]
    later = [*row]
    later[1] = "1600000000200000000"
    file = tmp_path / "scan.csv"
    file.write_text("\n".join(map(",".join, (names, row, later))) + "\n")
    log = load_scans(file)
    assert log.ranges_m.tolist() == [[1.0, 2.0, math.inf, 4.0]] * 2
    assert (log.angle_min, log.increment, log.range_max) == (-0.7, 0.2, 10.0)
    assert log.stamp_s == pytest.approx([0.0, 0.2])
    header = "# frame_id=laser angle_min=-0.7 angle_max: 0.1 angle_increment=0.2 time_increment=0.0"
    file.write_text(header + " range_min=0.1 range_max=10\n" "ranges[0],ranges[1],ranges[2]\n1,2,3\n")
    assert load_scans(file).ranges_m.tolist() == [[1.0, 2.0, 3.0]]


def test_carmen_logs(tmp_path):
    file = tmp_path / "hall.log"
    file.write_text(
        "# a remark\nPARAM robot_length 0.5\n"
        "FLASER 4 1.0 2.0 3.0 81.91 0.1 0.2 0.3 1.1 1.2 1.3 1000.5 host 0.5\n"
        "FLASER 4 1.5 2.5 3.5 4.5 0.1 0.2 0.3 2.1 1.2 1.3 1000.7 host 0.7\n"
    )
    log = load_scans(file)
    assert log.ranges_m.tolist() == [[1.0, 2.0, 3.0, math.inf], [1.5, 2.5, 3.5, 4.5]]
    assert (log.angle_min, log.increment) == pytest.approx((-0.5 * math.pi, math.pi / 4))
    assert log.stamp_s == pytest.approx([0.0, 0.2])
    assert log.odom == pytest.approx(np.array([[1.1, 1.2, 1.3], [2.1, 1.2, 1.3]]))
    tail = "0 9.1 9.2 9.3 1.1 1.2 1.3 0.1 0.2 0.3 0.4 0.5 77.25 host 0.1"
    file.write_text(f"ROBOTLASER1 0 -1.57 3.14 1.57 20.0 0.01 0 3 1.0 2.0 25.0 {tail}\n")
    log = load_scans(file)
    assert log.ranges_m.tolist() == [[1.0, 2.0, math.inf]]
    assert (log.angle_min, log.increment, log.range_max) == (-1.57, 1.57, 20.0)
    assert log.odom is not None and log.odom.tolist() == [[1.1, 1.2, 1.3]]

"""Scans as people bring them, each with its right value; the inputs are those of public reports, made anew here."""

from __future__ import annotations

import math

import numpy as np
import pytest
from command_line import refused, swarmscope

from swarmscope.experiments.lay_out_scans import Use
from swarmscope.experiments.perceive import perceive
from swarmscope.sim.scan_files import load_scans
from swarmscope.sim.scan_read import Ask

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
    if separator in (",", ";"):
        file.write_text("\n".join((lines[0], separator.join(['"3.0"'] * 181) + end, "")))
        assert (load_scans(file).ranges_m == 3.0).all()


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


def test_a_post_that_is_not_masked_is_named(tmp_path):
    scan = OPEN.copy()
    scan[100:103] = 0.1
    said = swarmscope("perceive", written(tmp_path, scan, least=0.05)).stdout
    assert "within the robot's radius (0.15 m) │ 3 of 360" in " ".join(said.split()) and "--mask FROM..TO" in said


@pytest.mark.parametrize(("spelled", "value"), [("-1", -1.0), ("nan", math.nan), ("0", 0.0), ("13", 13.0)])
def test_the_value_that_means_no_return_is_the_users(tmp_path, spelled, value):
    scan = np.where(np.isinf(with_wall()), value, with_wall())
    file = written(tmp_path, scan, np.where(scan == value, 0.0, scan))
    right = safe_in(written(tmp_path, with_wall(), name="right.csv"))
    assert safe_in(file, no_return=[value, 0.0]) == right * 2
    said = swarmscope("perceive", file, "--no-return", spelled, "--no-return", 0).stdout
    assert "340 of 360" in said and "block" not in said


def test_minus_infinity_is_too_near_even_where_zero_is_no_return(tmp_path):
    scan = OPEN.copy()
    scan[100:160] = -math.inf
    seen = perceive(load_scans(written(tmp_path, scan)), Use(no_return=[0.0]))
    assert seen.counts.below.tolist() == seen.counts.below_blocks.tolist() == [60]


def test_values_of_whole_millimetres_are_the_files(tmp_path):
    """0 and 4000 mean no return here; the file says them in millimetres."""
    scan = np.where(np.isinf(with_wall()), 0, 600).astype(np.uint16)
    scan[:10] = 4000
    head = {"angle_min": -math.pi, "angle_increment": STEP, "range_min": 0.1, "range_max": 12.0}
    np.savez(tmp_path / "mm.npz", ranges_mm=scan[None], **head)
    right = safe_in(written(tmp_path, with_wall(), name="right.csv"))
    assert safe_in(tmp_path / "mm.npz", no_return=[0.0, 4000.0]) == right


def test_files_without_a_header_need_the_field_of_view(tmp_path):
    file = tmp_path / "numbers.csv"
    rows = "\n".join(",".join(f"{3.0 + k + n / 1000:.3f}" for n in range(271)) for k in range(3)) + "\n"
    file.write_text(rows)
    assert "--fov DEGREES" in refused("perceive", file)
    log = load_scans(file, Ask(fov_deg=270.0, every=2))
    assert log.ranges_m.shape == (2, 271) and log.ranges_m[1, 0] == 5.0
    assert np.degrees([log.angle_min, log.increment]) == pytest.approx([-135.0, 1.0])
    circle = load_scans(file, Ask(fov_deg=360.0, first_deg=0.0))
    assert np.degrees([circle.angle_min, circle.increment]) == pytest.approx([0.0, 360.0 / 271])
    assert "271 over 270 degrees" in swarmscope("perceive", file, "--fov", 270).stdout
    for words in (("--fov", 0), ("--fov", "nan"), ("--fov", 400), ("--first", 5), ("--fov", 9, "--first", "inf")):
        assert words[-2] in refused("perceive", file, *words)
    file.write_text(rows.replace(".", ""))
    assert "read as millimetres" in swarmscope("perceive", file, "--fov", 270).stderr


MESSAGE = {"angle_min": -0.7, "angle_increment": 0.2, "range_min": 0.1, "range_max": 10.0, "time_increment": 0.01}
READINGS = [1.0, 2.0, math.inf, 4.0]


def table_of(kind):
    """The same two scans as a tool exports them."""
    fields, values = list(MESSAGE), [str(value) for value in MESSAGE.values()]
    numbers = [str(value) for value in READINGS]
    if kind == "plotjuggler":
        names = ["__time", *(f"/scan/{name}" for name in fields), *(f"/scan/ranges[{n}]" for n in range(4))]
        return "\n".join(",".join(row) for row in (names, ["5.0", *values, *numbers], ["5.5", *values, *numbers]))
    if kind == "bagpy":
        names = ["Time", "header.seq", "header.frame_id", *fields, *(f"ranges_{n}" for n in range(4))]
        rows = [[at, "3", "laser", *values, *numbers] for at in ("5.0", "5.5")]
        return "\n".join(",".join(row) for row in (names, *rows))
    if kind == "lists":
        rows = [f'{at},{",".join(values)},"({", ".join(numbers)})"' for at in ("5.0", "5.5")]
        return "\n".join((",".join(["time", *fields, "ranges"]), *rows))
    if kind == "semicolons":
        names = ["time", *fields, *(f"ranges{n}" for n in range(4))]
        return "\n".join(";".join(row) for row in (names, ["5.0", *values, *numbers], ["5.5", *values, *numbers]))
    first, step, least, most, between = values
    head = [first, "-0.1", step, between, "0.1", least, most]
    return "\n".join(",".join(["5", at, "laser", *head, *numbers, *"9999"]) for at in ("0", "500000000"))


@pytest.mark.parametrize("kind", ["plotjuggler", "bagpy", "lists", "semicolons", "ros2 topic echo"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_tables_of_more_tools(tmp_path, kind, encoding):
    """PlotJuggler, bagpy, lists in a cell, Excel's semicolons and UTF-16, ``ros2 topic echo --csv``."""
    file = tmp_path / "scan.csv"
    file.write_bytes((table_of(kind) + "\n").replace("\n", "\r\n").encode(encoding))
    log = load_scans(file)
    assert log.ranges_m.tolist() == [READINGS] * 2
    found = (log.angle_min, log.increment, log.range_min, log.range_max, log.time_increment)
    assert found == pytest.approx(tuple(MESSAGE.values()))
    assert log.stamp_s == pytest.approx([0.0, 0.5])


def test_rows_of_a_table_may_lie_along_other_rays(tmp_path):
    file = tmp_path / "scan.csv"
    rows = ["-0.7,0.2,0.1,10,1,2,3", "-0.8,0.2,0.1,10,4,5,"]
    file.write_text("\n".join(["angle_min,angle_increment,range_min,range_max,ranges0,ranges1,ranges2", *rows]) + "\n")
    log = load_scans(file)
    assert log.geometry.tolist() == [[-0.7, 0.2], [-0.8, 0.2]] and log.lengths.tolist() == [3, 2]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,5;2,3;4,0\n", "line 2: '1,5' is not a number; if it has decimal commas"),
        ("1,5 2,3 4,0\n", "decimal commas"),
        ("1,5\t2,3\t4,0\n", "decimal commas"),
        ("1.5,2.3,hello\n", "line 2: 'hello' is not a number\n"),
    ],
)
def test_decimal_commas_are_named(tmp_path, text, words):
    (tmp_path / "scan.csv").write_text("# angle_min=0 angle_increment=0.1 range_min=0 range_max=9\n" + text)
    assert words in refused("perceive", tmp_path / "scan.csv")


@pytest.mark.parametrize(
    ("cut", "words"),
    [
        (lambda row: row.replace("2.0,inf", "'...',inf"), "--full-length"),
        (lambda row: row + ",1,2,3", "do not go from angle"),
        (lambda row: row.replace(",0.2,", ",0.0,"), "do not go from angle"),
    ],
)
def test_what_ros2_topic_echo_cut_short_is_refused(tmp_path, cut, words):
    row = table_of("ros2 topic echo").split("\n")[0]
    (tmp_path / "scan.csv").write_text(cut(row) + "\n")
    assert words in refused("perceive", tmp_path / "scan.csv")


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ({"longest": math.inf}, ""),
        ({"longest": 0.0}, "range_min 0.1 and range_max 0"),
        ({"longest": math.nan}, "'range_max' is not one finite number"),
        ({"first": math.nan}, "'angle_min' is not one finite number"),
        ({"first": 1e9}, "is no direction"),
        ({"first": -180.0}, "read as degrees, angle_increment as radians"),
        ({"step": math.inf}, "'angle_increment' is not one finite number"),
    ],
)
def test_headers_of_all_kinds(tmp_path, head, words):
    said = swarmscope("perceive", written(tmp_path, with_wall(), **head))
    assert words in said.stderr and said.exit_code == (2 if words and "read as" not in words else 0)
    if said.exit_code == 0:
        assert f"{safe_in(written(tmp_path, with_wall(), name='right.csv'))[0]:.1f} of 360" in said.stdout


@pytest.mark.parametrize("scan", [OPEN, np.zeros(360), np.full(360, math.nan), np.array([3.0]), np.full(2, 3.0)])
def test_scans_of_all_kinds_are_read_or_refused(tmp_path, scan):
    result = swarmscope("perceive", written(tmp_path, scan))
    assert result.exit_code == (2 if scan.size == 1 or np.isnan(scan).all() else 0)


def test_the_whole_data_sheet_is_the_users(tmp_path):
    file, sheet = written(tmp_path, with_wall()), tmp_path / "mine.yaml"
    sheet.write_text("task: {name: T1}\nrobot: {radius_m: 0.4, half_width_m: 0.4}\nlidar: {range_m: 4.0}\n")
    usual = swarmscope("perceive", file).stdout
    for words in (
        ("--set", "robot.radius_m=0.4", "--set", "lidar.range_m=4"),
        ("--scenario", sheet),
        ("--scenario", sheet, "--radius", 0.2, "--range", 3),
        ("--set", "safety.margin_m=0.3"),
        ("--set", "lidar.range_min_m=0.7"),
    ):
        said = swarmscope("perceive", file, *words)
        assert said.exit_code == 0 and said.stdout.split("time of")[0] != usual.split("time of")[0], words
    for change, words in (
        ("robot.v_max=1", "did you mean 'v_max_mps'"),
        ("lidar.beams=9", "the recording says it"),
        ("planner.name=orca", "has no part in perception"),
        ("robot.radius_m", "must look like key.path=value"),
    ):
        assert words in refused("perceive", file, "--set", change)


def test_motion_is_said_where_nobody_knows_it(tmp_path):
    file = written(tmp_path, with_wall())
    file.write_text(file.read_text().replace("range_min", "time_increment=0.0005 range_min"))
    assert "a scan takes 0.179 s; see --speed" in swarmscope("perceive", file).stdout
    assert "put right for the robot's own motion" in swarmscope("perceive", file, "--speed", 1).stdout
    for words in (("--time-increment", "nan"), ("--speed", "inf"), ("--time-increment", 1)):
        assert words[0] in refused("perceive", file, "--speed", 1, *words)


def runs(*pieces, separator=","):
    """A line of readings: each a value and how often it comes."""
    return separator.join(separator.join([value] * count) for value, count in pieces)


def head(first, step, least=0.1, longest=12, **more):
    fields = {"angle_min": first, "angle_increment": step, "range_min": least, "range_max": longest} | more
    return "# " + " ".join(f"{name}={value}" for name, value in fields.items())


ROUND, TURTLE = head(-3.141592654, 0.01745329252), head(0, 0.01745329238, 0.12, 3.5)
HALF = head(-1.5708, 0.0174533, longest=30)
POSTS = [("inf", 44), *[("0.1000", 3), ("inf", 87)] * 3, ("0.1000", 3), ("inf", 43)]
MASKS = [word for at in (-135, -45, 45, 135) for word in ("--mask", f"{at - 1.5}..{at + 1.5}")]
FIELDS = "header.seq header.stamp header.frame_id angle_min angle_max angle_increment time_increment scan_time"
FIELDS += " range_min range_max " + " ".join(f"{name}{n}" for name in ("ranges", "intensities") for n in range(8))
ECHO = "%time," + ",".join(f"field.{name}" for name in FIELDS.split())
ECHO += "\n1550000000000000000,7,1550000000000000000,laser,-0.7,0.7,0.2,0.0,0.1,0.1,10.0,"
ECHO += runs(("1.5", 8), ("47.0", 8))
REPORTED = {
    "zeros": ([TURTLE, runs(("0.0000", 20), ("1.8000", 60), ("0.0000", 280))], [], "300 of 360: 300 block", 0),
    "zeros, said": ([TURTLE, runs(("0.0000", 20), ("1.8000", 60), ("0.0000", 280))], ["--no-return", 0], "300", 286),
    "infinities": ([TURTLE, runs(("inf", 20), ("1.8000", 60), ("inf", 280))], [], "300 of 360", 286),
    "NaN here and there": (
        [ROUND, runs(*(piece for n in (10, 74, 74, 69, 79) for piece in (("inf", n), ("nan", 1))), ("inf", 49))],
        [],
        "5 of 360: 5 bridged",
        360,
    ),
    "NaN ahead": ([ROUND, runs(("inf", 180), ("nan", 1), ("inf", 179))], [], "1 of 360: 1 bridged", 360),
    "NaN in a room": ([ROUND, runs(("4.0000", 180), ("nan", 1), ("4.0000", 179))], [], "1 of 360: 1 bridged", 360),
    "clockwise": ([head(3.141592654, -0.01745329252, 0.15), runs(("0.6000", 60), ("inf", 300))], [], "", 262),
    "its reverse": ([head(-3.12413936, 0.01745329252, 0.15), runs(("inf", 300), ("0.6000", 60))], [], "", 262),
    "a circle": ([head(0, 0.01749303564, 0.12, 3.5), runs(("inf", 360))], [], "360 over 360 degrees", 360),
    "posts": ([head(-3.141592654, 0.01745329252, 0.05), runs(*POSTS)], [], "--mask FROM..TO", 0),
    "posts, said": ([head(-3.141592654, 0.01745329252, 0.05), runs(*POSTS)], MASKS, "12 of 360: 12 bridged", 360),
    "rostopic echo": ([ECHO], [], "8 over 80 degrees", 0),
    "rostopic echo with a header": ([head(-0.7, 0.2, longest=10), ECHO], [], "8 over 80 degrees", 0),
    "a message's header": (
        ["# frame_id=laser angle_max=3.12414 time_increment=0.0 scan_time=0.1 " + ROUND[2:], runs(("inf", 360))],
        [],
        "360 of 360",
        360,
    ),
    "beams that vary": ([head(0, 0.013808, 0.02), runs(("3.0", 455)), runs(("3.0", 456))], [], "rays than most", 456),
    "-1": ([ROUND, runs(("inf", 5), ("-1.0000", 1), ("inf", 354))], [], "1 of 360: 1 bridged", 360),
    "semicolons": ([HALF, runs(("3.0", 181), separator=";")], [], "181 over 180 degrees", 121),
    "spaces": ([HALF, runs(("3.0", 181), separator=" ")], [], "181 over 180 degrees", 121),
    "a last comma": ([HALF, runs(("3.0", 181)) + ","], [], "181 over 180 degrees", 121),
    "lines of Windows": ([HALF + "\r", runs(("3.0", 181)) + "\r"], [], "181 over 180 degrees", 121),
    "degrees": ([head(-90, 1, longest=30), runs(("3.0", 181))], [], "read as degrees", 121),
    "millimetres": ([HALF, runs(("3000", 181))], [], "read as millimetres", 121),
}
"""Files of public reports: lines, options, words of the answer, safe directions."""


@pytest.mark.parametrize("name", REPORTED)
def test_files_of_public_reports(tmp_path, name):
    lines, options, words, safe = REPORTED[name]
    (tmp_path / "scan.csv").write_bytes(("\n".join(lines) + "\n").encode())
    done = swarmscope("perceive", tmp_path / "scan.csv", *options)
    said = " ".join(done.output.split())
    assert done.exit_code == 0 and words in said and f"│ {safe:.1f} of " in said

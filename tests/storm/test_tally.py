"""What runs add up to, and the file in which they do."""

from __future__ import annotations

import pytest

from swarmscope.errors import InputFileError
from swarmscope.storm.tally import Piece, Tally, add_up, read_tally

PIECE = Piece("c0de", "nav-scope orca", False, 3)


def row(number, hours=1.0, contact=False, **more):
    breach = {"kind": "contact", "tick": 3, "robot": 0, "text": "robot 0 touched the world"} if contact else None
    values = {
        "number": number, "robots": 2, "under_way_s": 3600.0 * hours, "driving_s": 1800.0 * hours, "arrived": 1,
        "wall_s": float(number), "thrown": 5, "planner": "nav-scope", "where": "maze", "again": number == 0,
        "reasons": {"stands, yield: waits": 1}, "refused": {"lidar.beams": number}, "breach": breach,
    }  # fmt: skip
    return values | more


def tally(*numbers, piece=PIECE, revision="abc"):
    found = Tally()
    for number in numbers:
        found.add(piece, revision, row(number))
    return found


def test_runs_add_up():
    total = add_up([row(0), row(1, contact=True), row(2, hours=8.0), {"number": 3, "refused": {"world": 400}}])
    assert (total.runs, total.robots, total.arrived, total.repeated) == (3, 6, 3, 1)
    assert (total.under_way_h, total.driving_h) == (10.0, 5.0)
    assert (total.contacts, total.breaches) == (1, 1)
    assert total.bound_per_h == pytest.approx(0.47439, abs=1e-5)
    assert total.refused == {"world": 400, "lidar.beams": 3}
    assert total.reasons == {"stands, yield: waits": 3}
    assert total.slowest["number"] == 2


def test_the_bound_without_a_contact_is_three_by_the_hours():
    assert add_up([row(0, hours=100.0)]).bound_per_h == pytest.approx(0.029957, abs=1e-6)
    assert add_up([]).bound_per_h == float("inf")


def test_a_file_reads_back_as_the_same_text(tmp_path):
    file = tmp_path / "storms.json"
    file.write_text(tally(0, 5, 2).as_text())
    assert read_tally(file).as_text() == file.read_text()
    assert read_tally(file).numbers(PIECE) == {0, 2, 5}
    assert read_tally(tmp_path / "none.json").rows() == []


def test_merged_runs_count_once_and_other_pieces_for_themselves():
    both = tally(0, 1)
    both.merge(tally(1, 2))
    assert both.numbers(PIECE) == {0, 1, 2}
    for other in (PIECE._replace(seed=4), PIECE._replace(code="0ther"), PIECE._replace(covered=True)):
        both.merge(tally(1, piece=other))
    assert len(both.rows()) == 6
    one, two = tally(0, 1), tally(1, 2)
    one.merge(two)
    two.merge(tally(0))
    assert one.as_text() == two.as_text()


TORN = {
    "cut": lambda text: text[:-20],
    "empty": lambda text: "",
    "other": lambda text: "[1, 2]",
    "number": lambda text: text.replace('"under_way_s": 3600.0', '"under_way_s": "x"'),
    "field": lambda text: text.replace('"driving_s"', '"drive_s"'),
    "counts": lambda text: text.replace('{"lidar.beams": 0}', "3"),
}


@pytest.mark.parametrize("how", TORN)
def test_a_torn_file_is_refused_and_left_alone(how, tmp_path):
    file = tmp_path / "storms.json"
    text = TORN[how](tally(0).as_text())
    file.write_text(text)
    with pytest.raises(InputFileError, match="torn, or not a storm's file") as error:
        read_tally(file)
    assert str(file) in str(error.value) and "\n" not in str(error.value)
    assert file.read_text() == text


def test_another_format_is_refused(tmp_path):
    file = tmp_path / "storms.json"
    file.write_text(tally(0).as_text().replace('"storms": 1', '"storms": 9'))
    with pytest.raises(InputFileError, match="format 9"):
        read_tally(file)

"""Recorded scans: the real file, both layouts, and every way a file can be broken."""

from __future__ import annotations

import io
import math
import pickle
import zipfile
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmscope.errors import InputFileError
from swarmscope.sim import scan_files
from swarmscope.sim.scan_files import ScanLog, load_scans

MALAGA = Path(str(files("swarmscope") / "data" / "scans" / "malaga_telecom_2006_sick_lms.npz"))
GOOD = {
    "ranges_m": np.array([[1.0, np.inf, 2.0], [np.nan, 0.5, 9.0]]),
    "angle_min": -0.5,
    "angle_increment": 0.5,
    "range_min": 0.1,
    "range_max": 8.0,
}
HEADER = "# angle_min=-0.5 angle_increment=0.5 range_min=0.1 range_max=8\n"


def _npz(path: Path, **changes: object) -> Path:
    arrays = {key: value for key, value in {**GOOD, **changes}.items() if value is not None}
    np.savez_compressed(path, **arrays)
    return path


def _csv_text(log: ScanLog) -> str:
    rows = "\n".join(",".join(repr(float(value)) for value in scan) for scan in log.ranges_m)
    return (
        f"# angle_min={log.angle_min!r} angle_increment={log.increment!r} "
        f"range_min={log.range_min!r} range_max={log.range_max!r}\n{rows}\n"
    )


def _refused(path: Path, match: str | None = None) -> None:
    with pytest.raises(InputFileError, match=match) as caught:
        load_scans(path)
    assert path.name in str(caught.value)


def test_the_real_recording() -> None:
    log = load_scans(MALAGA)
    assert log.name == "malaga_telecom_2006_sick_lms"
    assert log.ranges_m.shape == (225, 361)
    assert log.ranges_m.dtype == np.float32
    assert log.angle_min == pytest.approx(-math.pi / 2)
    assert log.increment == pytest.approx(math.pi / 360)
    assert (log.range_min, log.range_max) == (0.0, 80.0)
    assert np.isinf(log.ranges_m).mean() == pytest.approx(0.115, abs=0.001)
    finite = log.ranges_m[np.isfinite(log.ranges_m)]
    assert 57.0 < finite.max() < 59.0
    assert log.stamp_s[-1] == pytest.approx(59.07, abs=0.01)
    assert log.odom is not None
    assert log.odom.shape == (225, 3)


def test_metres_layout(tmp_path: Path) -> None:
    log = load_scans(_npz(tmp_path / "a.npz"))
    np.testing.assert_array_equal(log.ranges_m, np.float32([[1, np.inf, 2], [np.nan, 0.5, np.inf]]))
    assert np.isnan(log.stamp_s).all()
    assert log.odom is None


def test_rep_117_minus_infinity_is_too_close(tmp_path: Path) -> None:
    log = load_scans(_npz(tmp_path / "a.npz", ranges_m=np.array([[-np.inf, 1.0]])))
    assert log.ranges_m.tolist() == [[-np.inf, 1.0]]


@pytest.mark.parametrize("suffix", [".npz", ".csv"])
def test_missing_empty_folder(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    _refused(path, "No such file")
    path.touch()
    _refused(path, "empty")
    path.unlink()
    path.mkdir()
    _refused(path, "folder")


def test_unknown_kind_of_file(tmp_path: Path) -> None:
    for name, words in (("a.pcd", r"\.npz, \.csv"), ("a.csv.gz", "unpack it first"), ("a.xlsx", "save it as CSV")):
        (tmp_path / name).write_bytes(b"x")
        _refused(tmp_path / name, words)


@pytest.mark.parametrize(
    "content", [b"\x00", b"hello\n", b"PK\x03\x04 no", b"\x93NUMPY", bytes(range(256)) * 9]
)
@pytest.mark.parametrize("suffix", [".npz", ".csv"])
def test_foreign_content(tmp_path: Path, content: bytes, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    _refused(path)


def test_real_file_truncated_anywhere(tmp_path: Path) -> None:
    whole = MALAGA.read_bytes()
    path = tmp_path / "torn.npz"
    for size in [*range(1, len(whole), 397), len(whole) - 1]:
        path.write_bytes(whole[:size])
        _refused(path, "torn or foreign")


def test_real_file_with_damaged_bytes_never_gives_another_result(tmp_path: Path) -> None:
    whole = MALAGA.read_bytes()
    expected = load_scans(MALAGA)
    path = tmp_path / MALAGA.name
    for place in range(0, len(whole), 1009):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x55]) + whole[place + 1 :])
        try:
            log = load_scans(path)
        except InputFileError:
            continue
        np.testing.assert_array_equal(log.ranges_m, expected.ranges_m)


def test_pickled_objects_are_refused_and_never_run(tmp_path: Path) -> None:
    class Bomb:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return (Path.touch, (tmp_path / "ran",))  # type: ignore[return-value]

    _refused(_npz(tmp_path / "a.npz", ranges_m=np.array([[Bomb()]], dtype=object)), "Object arrays")
    (tmp_path / "b.npz").write_bytes(pickle.dumps(Bomb()))
    _refused(tmp_path / "b.npz", "torn or foreign")
    assert not (tmp_path / "ran").exists()


def test_archive_that_claims_too_much(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        header, {"descr": "<f8", "fortran_order": False, "shape": (1 << 40, 1 << 10)}
    )
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("ranges_m.npy", header.getvalue())
    _refused(tmp_path / "a.npz", "torn or foreign")
    monkeypatch.setattr(scan_files, "MAX_BYTES", 1000)
    _refused(_npz(tmp_path / "b.npz", ranges_m=np.ones((100, 100))), "unpacks to more")


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"ranges_m": None}, "exactly one of"),
        ({"ranges_cm": np.ones((2, 3), np.uint16)}, "exactly one of"),
        ({"ranges_m": np.ones(3)}, r"shape \(3,\)"),
        ({"ranges_m": np.ones((2, 3, 1))}, "shape"),
        ({"ranges_m": np.ones((0, 3))}, "shape"),
        ({"ranges_m": np.ones((2, 0))}, "shape"),
        ({"ranges_m": np.ones((2, 3), int)}, "floats"),
        ({"ranges_m": np.array([["a", "b"]])}, "floats"),
        ({"ranges_m": None, "ranges_cm": np.ones((2, 3), np.int32)}, "unsigned"),
        ({"ranges_m": np.full((2, 3), np.nan)}, "only NaN"),
        ({"angle_min": None}, "no 'angle_min'"),
        ({"angle_min": np.nan}, "one finite number"),
        ({"angle_min": np.ones(2)}, "one finite number"),
        ({"angle_min": "east"}, "one finite number"),
        ({"angle_increment": 0.0}, "angle_increment is 0"),
        ({"angle_increment": 1e-300}, "too close together"),
        ({"angle_increment": 4000.0}, "more than one turn"),
        ({"angle_increment": -4000.0}, "more than one turn"),
        ({"range_max": 0.1}, "0 <= min < max"),
        ({"range_min": -1.0}, "0 <= min < max"),
        ({"stamp_s": np.zeros(3)}, "shape"),
        ({"stamp_s": np.array([1.0, 0.0])}, "backwards"),
        ({"stamp_s": np.array([0.0, np.nan])}, "NaN"),
        ({"odom_xy_yaw": np.zeros((2, 2))}, "shape"),
    ],
)
def test_wrong_arrays(tmp_path: Path, changes: dict[str, object], match: str) -> None:
    _refused(_npz(tmp_path / "a.npz", **changes), match)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("1,2,3\n", "no 'angle_min'"),
        (HEADER, "shape"),
        (HEADER + "1,2,3\n1,2,3.", "torn"),
        (HEADER + "1,2,x\n", "line 2: 'x' is not a number"),
        (HEADER + "1,,3\n", "line 2: '' is not a number"),
        (HEADER + "1,2_0,3\n", "line 2: '2_0' is not a number"),
        (HEADER + "1,٣,3\n", "is not a number"),
        ("# angle_min=0 angle_min=1\n" + HEADER + "1,2,3\n", "line 1: 'angle_min' is given twice"),
        ("%time,ranges0,ranges0\n1,2,3\n", "column 'ranges0' is there twice"),
        ("angle_min,ranges0,ranges1\n1,2\n", "line 2: 2 columns where the first line names 3"),
        ("FLASER 3 1 2\n", "line 1: torn: it ends after 4 words"),
        ("FLASER many 1 2\n", "line 1: 'many' is not a number"),
        ("FLASER 1e300 1 2\n", "line 1: torn"),
        ("FLASER -inf 1 2\n", "line 1: torn"),
        ("FLASER nan 1 2\n", "line 1: torn"),
        ("ROBOTLASER1 0 -1 3 1 20 0 0 1 1.0 -inf 1\n", "line 1: torn"),
        (HEADER + "nan,nan,nan\n", "only NaN"),
        ("# angle_mni=0\n" + HEADER + "1,2,3\n", "unknown key 'angle_mni'; did you mean 'angle_min'"),
        (HEADER.replace("=8", "=far") + "1,2,3\n", "line 1: 'far' is not a number"),
        (HEADER.replace("=8", "=nan") + "1,2,3\n", "'range_max' is not one finite number"),
    ],
)
def test_wrong_csv(tmp_path: Path, text: str, match: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    _refused(path, match)


def test_csv_of_other_systems(tmp_path: Path) -> None:
    path = tmp_path / "a.CSV"
    text = "\ufeff# recorded by hand\n" + HEADER + "\n 1 , inf,2\nNaN,0.5,9\n"
    path.write_bytes(text.replace("\n", "\r\n").encode())
    np.testing.assert_array_equal(load_scans(path).ranges_m, load_scans(_npz(tmp_path / "a.npz")).ranges_m)


def test_csv_truncated_anywhere_is_refused_or_a_prefix(tmp_path: Path) -> None:
    real = load_scans(MALAGA)
    whole = _csv_text(real).encode()
    path = tmp_path / "torn.csv"
    for size in range(1, 40_000, 701):
        path.write_bytes(whole[:size])
        if whole[size - 1 : size] != b"\n":
            _refused(path)
    path.write_bytes(whole)
    np.testing.assert_array_equal(load_scans(path).ranges_m, real.ranges_m)


READING = st.one_of(st.floats(0.0, 80.0, width=32), st.just(math.inf), st.just(math.nan))


@given(data=st.data(), scans=st.integers(1, 4), beams=st.integers(1, 12))
def test_csv_round_trip(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject, scans: int, beams: int
) -> None:
    rows = data.draw(
        st.lists(st.lists(READING, min_size=beams, max_size=beams), min_size=scans, max_size=scans)
    )
    rows[0][0] = 1.0
    log = ScanLog(
        name="a",
        ranges_m=np.array(rows, np.float32),
        stamp_s=np.full(scans, np.nan),
        angle_min=data.draw(st.floats(-4.0, 4.0)),
        increment=data.draw(st.floats(1e-4, 0.5)),
        range_min=data.draw(st.floats(0.0, 1.0)),
        range_max=80.0,
        odom=None,
    )
    path = tmp_path_factory.getbasetemp() / "round_trip.csv"
    path.write_text(_csv_text(log))
    back = load_scans(path)
    np.testing.assert_array_equal(back.ranges_m, log.ranges_m)
    assert (back.angle_min, back.increment) == (log.angle_min, log.increment)
    assert (back.range_min, back.range_max) == (log.range_min, log.range_max)

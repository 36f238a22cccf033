"""Run folders are complete or not there: normal use, refusal, failure, and kill -9 at random moments."""

from __future__ import annotations

import errno
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarmscope.errors import ConfigError, InputFileError, SwarmscopeError
from swarmscope.judging import run_folder
from swarmscope.judging.run_folder import (
    REQUIRED,
    check_out,
    read_config,
    read_metrics,
    read_trajectory,
    read_world,
    write_run,
)

READERS = (read_metrics, read_config, read_world, read_trajectory)
DEAD_PID = 2**22 + 1  # above the kernel's limit, so never alive

WRITER = """
import sys
from pathlib import Path
import numpy as np
from swarmscope.judging.run_folder import write_run
print("ready", flush=True)
number = 0
while True:
    number += 1
    write_run(
        Path(sys.argv[1]), {"number": number}, {"number": number},
        {"number": np.full(20_000, number)}, {"number": number},
        extras=lambda folder: (folder / "paths.png").write_bytes(bytes([number % 256]) * 50_000),
    )
"""


def _write(out: Path, number: int = 1, **changes: Any) -> Path:
    parts: dict[str, Any] = {
        "config": {"task": "T1", "number": number},
        "world": {"number": number},
        "trajectory": {"x_m": np.arange(6.0).reshape(2, 3), "names": np.array(["go", "wait"])},
        "metrics": {"number": number},
    }
    return write_run(out, **{**parts, **changes})


def _hidden(parent: Path) -> list[str]:
    return sorted(entry.name for entry in parent.iterdir() if entry.name.startswith("."))


def test_what_is_written_comes_back(tmp_path: Path) -> None:
    config = {
        "task": "T1",
        "noise": 1e-5,
        "limit": float("inf"),
        "map": Path("a.yaml"),
        "goal": (1, np.float64(2)),
    }
    metrics = {
        "spl": np.float32(0.5),
        "gone": float("nan"),
        "far": np.inf,
        "n": np.int64(3),
        "rows": np.eye(2),
    }
    out = _write(tmp_path / "deep" / "run", config=config, metrics=metrics)
    assert out == tmp_path / "deep" / "run"
    assert {entry.name for entry in out.iterdir()} == REQUIRED
    assert read_metrics(out) == {"spl": 0.5, "gone": None, "far": None, "n": 3, "rows": [[1, 0], [0, 1]]}
    back = read_config(out)
    assert back == {"task": "T1", "noise": 1e-5, "limit": float("inf"), "map": "a.yaml", "goal": [1, 2.0]}
    assert list(back) == list(config)
    assert read_world(out) == {"number": 1}
    assert read_trajectory(out)["names"].tolist() == ["go", "wait"]
    assert list(json.loads((out / "metrics.json").read_text())) == sorted(metrics)


def test_same_data_same_bytes(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    arrays = {"a": rng.normal(size=(50, 7)), "b": rng.integers(0, 255, (9, 9), np.uint8), "c": np.float64(3)}
    first = _write(tmp_path / "first", trajectory=arrays)
    time.sleep(2.1)  # zip dates have a resolution of two seconds
    other = {
        "c": arrays["c"],
        "b": np.asfortranarray(arrays["b"]),
        "a": arrays["a"].repeat(2, axis=1)[:, ::2],
    }
    second = _write(tmp_path / "second", trajectory=other)
    for name in REQUIRED:
        assert (first / name).read_bytes() == (second / name).read_bytes()


def test_no_pickles(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="'bad' holds Python objects"):
        _write(tmp_path / "run", trajectory={"bad": np.array([None])})
    assert list(tmp_path.iterdir()) == []


def test_extras_see_a_complete_but_hidden_run(tmp_path: Path) -> None:
    seen: list[str] = []

    def extras(folder: Path) -> None:
        seen.extend(entry.name for entry in folder.iterdir())
        (folder / "replay.html").write_text("page")

    out = _write(tmp_path / "run", extras=extras)
    assert set(seen) == REQUIRED
    assert (out / "replay.html").read_text() == "page"


def test_unknown_extra_file_is_a_mistake_of_the_caller(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"notes\.txt"):
        _write(tmp_path / "run", extras=lambda folder: (folder / "notes.txt").touch())
    assert list(tmp_path.iterdir()) == []


def test_finished_run_and_empty_folder_are_replaced(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    _write(tmp_path / "run", 1, extras=lambda folder: (folder / "paths.png").write_bytes(b"x"))
    _write(tmp_path / "run", 2)
    assert read_metrics(tmp_path / "run") == {"number": 2}
    assert {entry.name for entry in (tmp_path / "run").iterdir()} == REQUIRED
    assert _hidden(tmp_path) == []


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    _write(tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert read_metrics(tmp_path / "real") == {"number": 1}


@pytest.mark.parametrize("name", ["thesis.tex", "config.yaml", "metrics.json", "trees/"])
def test_foreign_files_are_never_overwritten(tmp_path: Path, name: str) -> None:
    out = tmp_path / "run"
    out.mkdir()
    if name.endswith("/"):
        (out / name).mkdir()
    else:
        (out / name).write_text("mine")
    with pytest.raises(ConfigError, match="refusing to overwrite") as caught:
        _write(out)
    assert str(out) in str(caught.value)
    assert [entry.name for entry in out.iterdir()] == [name.rstrip("/")]


def test_note_beside_a_finished_run_is_kept(tmp_path: Path) -> None:
    out = _write(tmp_path / "run")
    (out / "notes.txt").write_text("mine")
    with pytest.raises(ConfigError, match=r"notes\.txt"):
        _write(out, 2)
    assert read_metrics(out) == {"number": 1}


def test_places_that_cannot_be(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(ConfigError, match="is a file"):
        check_out(tmp_path / "file")
    with pytest.raises(ConfigError, match="not a place"):
        check_out(Path("/"))
    with pytest.raises(SwarmscopeError, match="file/run: cannot write the run"):
        _write(tmp_path / "file" / "run")
    with pytest.raises(SwarmscopeError, match="File name too long"):
        _write(tmp_path / ("long" * 80))


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_missing_permission(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(SwarmscopeError, match="Permission denied"):
            _write(tmp_path / "run")
    finally:
        tmp_path.chmod(0o700)


@pytest.mark.parametrize("failing_call", range(1, 7))
def test_full_disk_at_any_step_keeps_the_old_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing_call: int
) -> None:
    out = _write(tmp_path / "run", 1)
    calls = 0
    real_sync = run_folder._sync

    def sync(path: Path) -> None:
        nonlocal calls
        calls += 1
        if calls == failing_call:
            raise OSError(errno.ENOSPC, "No space left on device")
        real_sync(path)

    monkeypatch.setattr(run_folder, "_sync", sync)
    if failing_call > 5:  # after four files and the folder the run is in place
        _write(out, 2)
    else:
        with pytest.raises(SwarmscopeError, match=r"run: .*the disk is full"):
            _write(out, 2)
    assert read_metrics(out)["number"] == (2 if failing_call > 5 else 1)
    assert read_config(out)["number"] == (2 if failing_call > 5 else 1)
    assert _hidden(tmp_path) == []


def test_file_size_limit_of_the_system(tmp_path: Path) -> None:
    """A real write that the kernel refuses half-way."""
    out = _write(tmp_path / "run", 1)
    code = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
        "from pathlib import Path; import numpy as np\n"
        "from swarmscope.judging.run_folder import write_run\n"
        "noise = np.random.default_rng(0).normal(size=9999)\n"
        "write_run(Path(sys.argv[1]), {'a': 2}, {'a': 2}, {'a': noise}, {'a': 2})\n"
    )
    done = subprocess.run(
        [sys.executable, "-B", "-c", code, str(out)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert f"SwarmscopeError: {out}: cannot write the run: File too large" in done.stderr
    assert read_metrics(out) == {"number": 1}
    assert _hidden(tmp_path) == []


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_failure_in_extras_leaves_nothing(tmp_path: Path, error: type[BaseException]) -> None:
    out = _write(tmp_path / "run", 1)

    def extras(folder: Path) -> None:
        raise error

    with pytest.raises(error):
        _write(out, 2, extras=extras)
    assert read_metrics(out) == {"number": 1}
    assert _hidden(tmp_path) == []


def test_failed_rename_brings_the_old_run_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = _write(tmp_path / "run", 1)
    real_rename = Path.rename

    def rename(self: Path, target: Path) -> Path:
        if ".partial-" in self.name:
            raise OSError(errno.EIO, "Input/output error")
        return real_rename(self, target)

    monkeypatch.setattr(Path, "rename", rename)
    with pytest.raises(SwarmscopeError, match="Input/output error"):
        _write(out, 2)
    assert read_metrics(out) == {"number": 1}
    assert _hidden(tmp_path) == []


def test_leftovers_of_dead_writers_go_those_of_living_ones_stay(tmp_path: Path) -> None:
    for name in (f".run.partial-{DEAD_PID}", f".run.partial-{os.getpid()}", f".run.old-{DEAD_PID}"):
        (tmp_path / name).mkdir()
    kept = [f".other.partial-{DEAD_PID}", f".run.partial-{os.getppid()}", ".run.partial-x"]
    for name in kept:
        (tmp_path / name).mkdir()
    _write(tmp_path / "run")
    assert _hidden(tmp_path) == sorted(kept)


def test_run_moved_aside_by_a_killed_writer_comes_back(tmp_path: Path) -> None:
    _write(tmp_path / "run", 1).rename(tmp_path / f".run.old-{DEAD_PID}")
    with pytest.raises(ValueError, match="Python objects"):
        _write(tmp_path / "run", 2, trajectory={"bad": np.array([None])})
    assert read_metrics(tmp_path / "run") == {"number": 1}
    assert _hidden(tmp_path) == []


@pytest.mark.parametrize("reader", READERS)
def test_unfinished_and_missing_folders_are_refused(tmp_path: Path, reader: Any) -> None:
    with pytest.raises(InputFileError, match="no such run folder"):
        reader(tmp_path / "missing")
    (tmp_path / "file").touch()
    with pytest.raises(InputFileError, match="is a file"):
        reader(tmp_path / "file")
    out = _write(tmp_path / "run")
    (out / "world.json").write_bytes(b"")
    with pytest.raises(InputFileError, match=r"world\.json: is missing or empty"):
        reader(out)
    (out / "metrics.json").unlink()
    with pytest.raises(InputFileError, match="no finished run"):
        reader(out)


@pytest.mark.parametrize(
    ("name", "reader"),
    [
        ("metrics.json", read_metrics),
        ("config.yaml", read_config),
        ("world.json", read_world),
        ("trajectory.npz", read_trajectory),
    ],
)
def test_torn_and_foreign_files_are_refused(tmp_path: Path, name: str, reader: Any) -> None:
    out = _write(tmp_path / "run", 123)
    whole = (out / name).read_bytes()
    whole_content = whole.rstrip(b"\n")
    torn = [whole[:size] for size in range(1, len(whole_content), max(1, len(whole) // 40))]
    for content in [*torn, b"\xff\xfe\x00", b"[1, 2]\n", b"[1, 2]\n...\n", b"[" * 100_000]:
        (out / name).write_bytes(content)
        with pytest.raises(InputFileError, match=name):
            reader(out)


def _check_visible(out: Path) -> int:
    """Return the number of the run at ``out`` after reading all of it; 0 when there is none."""
    if not out.exists():
        return 0
    number = int(read_metrics(out)["number"])
    assert read_config(out)["number"] == number
    assert read_world(out)["number"] == number
    np.testing.assert_array_equal(read_trajectory(out)["number"], np.full(20_000, number))
    assert (out / "paths.png").read_bytes() == bytes([number % 256]) * 50_000
    return number


def test_kill_9_at_random_moments(tmp_path: Path) -> None:
    out = tmp_path / "run"
    chance = random.Random(4)
    numbers = []
    for _ in range(10):
        with subprocess.Popen(
            [sys.executable, "-c", WRITER, str(out)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as writer:
            assert writer.stdout is not None
            assert writer.stdout.readline() == "ready\n"
            time.sleep(chance.uniform(0.0, 0.2))
            writer.send_signal(signal.SIGKILL)
            writer.wait()
        assert writer.returncode == -signal.SIGKILL
        numbers.append(_check_visible(out))
        assert len(_hidden(tmp_path)) <= 2
    assert max(numbers) > 1
    _write(out)
    assert _hidden(tmp_path) == []


def test_two_writers_of_one_place_do_not_disturb_each_other(tmp_path: Path) -> None:
    out = tmp_path / "run"
    code = WRITER.replace("while True", "while number < 40")
    command = [sys.executable, "-c", code, str(out)]
    writers = [subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) for _ in range(2)]
    for writer in writers:
        assert writer.communicate(timeout=60)[1] == b""
    assert _check_visible(out) == 40
    assert _hidden(tmp_path) == []


def test_leftovers_of_a_killed_replay_do_not_make_a_folder_foreign(tmp_path: Path) -> None:
    out = _write(tmp_path / "run", 1)
    (out / ".paths.png.4711.tmp").write_bytes(b"half a picture")
    _write(tmp_path / "run", 2)
    assert read_metrics(out) == {"number": 2}
    assert {entry.name for entry in out.iterdir()} == REQUIRED

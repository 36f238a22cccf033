"""The command in a process of its own: what it imports, how it dies."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest
from command_line import SMALL, refused, swarmscope

from swarmscope.cli._errors import ctrl_c_is_never_lost
from swarmscope.errors import InputFileError
from swarmscope.judging.run_folder import read_metrics

HEAVY = ("numba", "numpy", "matplotlib", "yaml", "PIL", "swarmscope.onboard", "swarmscope.sim")


def python(*words, **options):
    return subprocess.run([sys.executable, *map(str, words)], capture_output=True, text=True, check=False, **options)


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["run", "--help"], ["perceive", "--help"]])
def test_help_imports_nothing_heavy(words):
    code = (
        "import sys\nfrom swarmscope.cli.main import main\n"
        f"sys.argv = ['swarmscope', *{words!r}]\n"
        "try:\n    main()\nexcept SystemExit as end:\n    code = end.code\n"
        f"heavy = [name for name in {HEAVY!r} if name in sys.modules]\n"
        "print(f'\\ncode {code} heavy {heavy}')"
    )
    done = python("-c", code)
    assert done.stdout.splitlines()[-1] == "code 0 heavy []", done.stderr


def test_run_and_refusal_in_a_real_process(tmp_path):
    done = python("-m", "swarmscope", "run", *SMALL, "--out", tmp_path / "r")
    assert done.returncode == 0, done.stderr
    assert "T1 · nav-scope · 3 robots · seed 0" in done.stdout
    assert read_metrics(tmp_path / "r")["run"]["robots"] == 3
    wrong = python("-m", "swarmscope", "run", "--task", "T9")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert wrong.stderr.startswith("swarmscope: ") and "Traceback" not in wrong.stderr


def test_a_reader_that_goes_away_leaves_no_traceback():
    run = subprocess.Popen(
        [sys.executable, "-m", "swarmscope", "tasks"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    run.stdout.close()
    said = run.stderr.read()
    run.stderr.close()
    assert run.wait() == 2
    assert said == "swarmscope: whoever read the output has gone\n"


KILLED = """
import os, signal, sys
from pathlib import Path
from swarmscope.judging.run import run_scenario
from swarmscope.scenarios.read import parse_scenario
def die(*_):
    os.kill(os.getpid(), signal.SIGKILL)
scenario = parse_scenario({"task": {"name": "T1"}, "robots": 3, "limit_s": 12.0, "seed": 5}, "test")
run_scenario(scenario, Path(sys.argv[1]), **{sys.argv[2]: die})
"""


@pytest.mark.parametrize("moment", ["progress", "extras"])
def test_kill_in_the_middle_leaves_nothing_that_is_trusted(moment, tmp_path):
    out = tmp_path / "runs" / "r"
    assert python("-c", KILLED, out, moment).returncode == -9
    assert not out.exists()
    assert str(out) in refused("replay", out)
    with pytest.raises(InputFileError):
        read_metrics(out)
    assert swarmscope("run", *SMALL, "--out", out).exit_code == 0  # the place is not blocked
    assert [entry.name for entry in out.parent.iterdir()] == ["r"]  # and what was left is gone


@pytest.mark.parametrize("moment", ["progress", "extras"])
def test_kill_in_the_middle_keeps_the_earlier_run(moment, tmp_path):
    out = tmp_path / "r"
    swarmscope("run", *SMALL, "--out", out)
    before = (out / "metrics.json").read_bytes()
    assert python("-c", KILLED, out, moment).returncode == -9
    assert (out / "metrics.json").read_bytes() == before
    assert swarmscope("replay", out).exit_code == 0


def test_ctrl_c_counts_even_while_a_finaliser_runs():
    class Dropped:
        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), ctrl_c_is_never_lost():
            Dropped()
            begun = time.monotonic()
            time.sleep(30.0)
        assert time.monotonic() - begun < 10.0
    finally:
        signal.signal(signal.SIGINT, before)

"""The command line in this process, for the tests of this folder."""

from __future__ import annotations

from typer.testing import CliRunner

from swarmscope.cli.main import app

SMALL = ["--task", "T1", "--robots", "3", "--limit", "6", "--no-pictures"]


def swarmscope(*words):
    """Run the command; a traceback fails the test at once."""
    result = CliRunner().invoke(app, [str(word) for word in words])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def refused(*words):
    """Return what a command says that must fail: exit code 2 and at most two lines."""
    result = swarmscope(*words)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert 1 <= len(result.stderr.strip().splitlines()) <= 2
    return result.stderr

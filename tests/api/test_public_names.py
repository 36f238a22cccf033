"""The public names: there when asked for, free when not, and forgiving of a slip."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import pytest

import swarmscope

HEAVY = ("numpy", "numba", "pydantic", "yaml", "typer", "rich", "matplotlib", "swarmscope.api", "swarmscope.errors")


def test_importing_the_package_imports_nothing_else():
    code = f"import swarmscope, sys; print(swarmscope.__version__, [m for m in {HEAVY!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == f"{swarmscope.__version__} []\n"


@pytest.mark.parametrize("name", swarmscope.__all__)
def test_every_public_name_is_there(name):
    home = swarmscope.HOMES[name]
    if importlib.util.find_spec(home) is None or not hasattr(importlib.import_module(home), name):
        pytest.skip(f"{home} has no {name} yet")
    thing = getattr(swarmscope, name)
    assert thing.__name__ == name and thing.__doc__
    assert getattr(swarmscope, name) is thing


def test_names_can_be_completed():
    assert set(swarmscope.__all__) == set(swarmscope.HOMES) < set(dir(swarmscope))
    assert "annotations" not in dir(swarmscope)


def test_a_wrong_name_is_told_the_nearest():
    with pytest.raises(AttributeError, match=r"swarmscope has no 'simulat'; did you mean 'simulate'\?"):
        _ = swarmscope.simulat
    assert not hasattr(swarmscope, "__path_of_nothing__")
    with pytest.raises(ImportError, match="Runn"):
        from swarmscope import Runn  # noqa: F401

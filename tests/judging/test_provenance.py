"""Versions and revision of what made a result."""

from __future__ import annotations

import os
import platform
import re
import subprocess
from pathlib import Path

import numba
import numpy as np
import pytest

import swarmscope
from swarmscope.judging import provenance
from swarmscope.judging.provenance import git_revision, versions


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A committed package in a fresh repository."""
    package = tmp_path / "repo" / "src" / "thing"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("x = 1\n")
    _git(tmp_path / "repo", "init", "-q")
    _git(tmp_path / "repo", "add", ".")
    _git(tmp_path / "repo", "-c", "user.name=a", "-c", "user.email=a@b", "commit", "-q", "-m", "first")
    return package


def _git(folder: Path, *arguments: str) -> None:
    environment = {key: value for key, value in os.environ.items() if not key.startswith("GIT_")}
    subprocess.run(["git", *arguments], cwd=folder, env=environment, check=True)


def test_versions() -> None:
    assert versions() == {
        "swarmscope": swarmscope.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
    }


def test_missing_package_is_unknown() -> None:
    assert provenance.installed_version("no-such-package-here") == "unknown"


def test_clean_then_changed_then_untracked(checkout: Path) -> None:
    clean = git_revision(checkout)
    assert re.fullmatch(r"[0-9a-f]{12,}", clean)
    (checkout / "__init__.py").write_text("x = 2\n")
    assert git_revision(checkout) == f"{clean}-dirty"
    (checkout / "__init__.py").write_text("x = 1\n")
    (checkout.parent.parent / "notes.txt").write_text("outside the package")
    assert git_revision(checkout) == clean
    (checkout / "new_planner.py").write_text("")
    assert git_revision(checkout) == f"{clean}-dirty"


def test_package_inside_a_foreign_repository_is_unknown(checkout: Path) -> None:
    installed = checkout.parent.parent / ".venv" / "thing"
    installed.mkdir(parents=True)
    (installed / "__init__.py").touch()
    assert git_revision(installed) == "unknown"


def test_no_repository_no_folder_no_commit_no_git(
    tmp_path: Path, checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert git_revision(tmp_path) == "unknown"
    assert git_revision(tmp_path / "missing") == "unknown"
    fresh = tmp_path / "fresh"
    fresh.mkdir()
    (fresh / "__init__.py").touch()
    _git(fresh, "init", "-q")
    _git(fresh, "add", ".")
    assert git_revision(fresh) == "unknown"
    monkeypatch.setenv("PATH", str(tmp_path))
    assert git_revision(checkout) == "unknown"


def test_callers_git_variables_do_not_mislead(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = git_revision(checkout)
    monkeypatch.setenv("GIT_DIR", "/nowhere")
    assert git_revision(checkout) == expected


def test_hanging_git_is_unknown(checkout: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    slow = tmp_path / "bin" / "git"
    slow.parent.mkdir()
    slow.write_text("#!/bin/sh\nexec sleep 60\n")
    slow.chmod(0o755)
    monkeypatch.setenv("PATH", str(slow.parent), prepend=os.pathsep)
    monkeypatch.setattr(provenance, "GIT_SECONDS", 0.2)
    assert git_revision(checkout) == "unknown"


def test_this_source_tree_never_raises() -> None:
    assert git_revision()

"""Where a result comes from: versions and the state of the source tree."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from functools import cache
from pathlib import Path

from swarmscope import __version__, closure

PACKAGE = Path(closure.PACKAGE)
GIT_SECONDS = 10.0


def versions() -> dict[str, str]:
    """Return the versions that can change a result, without importing the packages."""
    return {
        "swarmscope": __version__,
        "python": platform.python_version(),
        "numpy": installed_version("numpy"),
        "numba": installed_version("numba"),
    }


def git_revision(package: Path = PACKAGE) -> str:
    """Return the short hash of the checkout that holds ``package``, with ``-dirty`` when it differs.

    Never raises: 'unknown' without git, outside a checkout, and where the package merely lies in somebody
    else's repository (an environment inside a project). Only changes under ``package`` count, new files too.
    """
    try:
        _git(package, "ls-files", "--error-unmatch", "__init__.py")
        revision = _git(package, "rev-parse", "--short=12", "HEAD")
        changes = _git(package, "status", "--porcelain", "--", ".")
    except (OSError, subprocess.SubprocessError, ValueError):
        return "unknown"
    return f"{revision}-dirty" if changes else revision


@cache
def own_revision() -> str:
    """Return the revision of this package, asked once: what is loaded does not change any more."""
    return git_revision()


@cache
def installed_version(package: str) -> str:
    """Return the version of a package, 'unknown' when it is not installed."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "unknown"


@cache
def library_version(module: str) -> str:
    """Return the version of the package that a top-level module belongs to, which may be called otherwise."""
    version = installed_version(module)
    if version != "unknown":
        return version
    packages = sorted(importlib.metadata.packages_distributions().get(module, []))
    return " ".join(f"{package} {installed_version(package)}" for package in packages) or "unknown"


def _git(folder: Path, *arguments: str) -> str:
    """Run git in ``folder``, blind to the caller's GIT_DIR and the like, taking no locks."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("GIT_")}
    done = subprocess.run(
        ["git", *arguments],
        cwd=folder,
        env=environment | {"GIT_OPTIONAL_LOCKS": "0", "LC_ALL": "C"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=True,
        timeout=GIT_SECONDS,
    )
    return done.stdout.strip()

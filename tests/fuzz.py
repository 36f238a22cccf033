"""Run the property tests again and again with examples that were never drawn before, until one fails.

    python tests/fuzz.py --minutes 10 [tests/disk ...]

Each round is a run of pytest with a seed of its own, which is printed: the same seed draws the same examples. Ends
with 1 at the first find, whose example belongs into an ``@example`` of its test, and with 0 when the time is over.
"""

from __future__ import annotations

import argparse
import math
import secrets
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

TESTS = Path(__file__).resolve().parent
FOUND = 1
"""What pytest returns when a test failed."""


def fuzz(minutes: float, play: Callable[[int, float], int | None]) -> int:
    """Play rounds until one does not return 0 or the time is over; return what the last one that ended returned.

    ``play`` takes a seed and how many seconds are left, and returns None when these were not enough.
    """
    end = time.monotonic() + 60.0 * minutes
    while (left := end - time.monotonic()) > 0.0:
        code = play(secrets.randbelow(2**32), left)
        if code:
            return code
    return 0


def play_round(seed: int, seconds: float, where: Sequence[str]) -> int | None:
    """Run the property tests with a seed; return pytest's exit status, None if they were stopped."""
    print(f"\nseed {seed}, {math.ceil(seconds)} s left", flush=True)
    profile = ["--hypothesis-profile=fuzz", f"--hypothesis-seed={seed}"]
    command = [sys.executable, "-m", "pytest", "-x", "-m", "hypothesis", *profile, *where]
    try:
        code = subprocess.run(command, cwd=TESTS.parent, timeout=seconds, check=False).returncode
    except subprocess.TimeoutExpired:
        return None
    if code == FOUND:
        print(
            "\nFound. Copy the arguments of the failing test case above into an @example of the test.\n"
            f"The same again: {' '.join(command)}",
            flush=True,
        )
    return code


def main() -> int:
    """Read the command line and fuzz."""
    parser = argparse.ArgumentParser(description="Property tests with new examples, until one fails.")
    parser.add_argument("--minutes", type=float, default=10.0, help="how long to go on (default 10)")
    parser.add_argument("where", nargs="*", default=["tests"], help="files or folders of tests (default: all)")
    asked = parser.parse_args()
    code = fuzz(asked.minutes, lambda seed, seconds: play_round(seed, seconds, asked.where))
    if code == 0:
        print(f"\nNothing found in {asked.minutes:g} minutes.")
    return code


if __name__ == "__main__":
    sys.exit(main())

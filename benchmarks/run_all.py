"""All benchmarks, one after the other; each prints its figures beside a floor or a peer measured in the same run."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent
SCRIPTS = (
    "bench_step.py",
    "bench_robot.py",
    "bench_giwt.py",
    "bench_world.py",
    "bench_lidar.py",
    "bench_paths.py",
    "bench_runs.py",
    "bench_store.py",
    "bench_disk.py",
)


def help_s() -> tuple[float, float]:
    """Return the best times [s] of ``swarmscope --help`` and of a Python that does nothing."""
    commands = ([sys.executable, "-m", "swarmscope", "--help"], [sys.executable, "-c", "pass"])
    best = []
    for command in commands:
        times = []
        for _ in range(5):
            start = time.perf_counter()
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            times.append(time.perf_counter() - start)
        best.append(min(times))
    return best[0], best[1]


def main() -> None:
    """Run everything."""
    for script in SCRIPTS:
        print(f"== {script}", flush=True)
        subprocess.run([sys.executable, str(HERE / script), *sys.argv[1:]], check=True)
    mine, floor = help_s()
    print("== start-up")
    print(f"  swarmscope --help {mine:.3f} s (goal <= 0.5)   bare Python {floor:.3f} s   ratio {mine / floor:.1f}")


if __name__ == "__main__":
    main()

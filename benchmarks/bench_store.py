"""How the store of results behaves as it grows: writing, asking, reading, size.

python benchmarks/bench_store.py --results 100000
"""

from __future__ import annotations

import argparse
import os
import sqlite3
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.progress import track

from swarmscope.experiments.campaign import keyed_units
from swarmscope.experiments.experiment import parse_experiment
from swarmscope.experiments.store import Store
from swarmscope.experiments.work import Finished, finished, make_job, work, world_key
from swarmscope.scenarios.to_kernels import complete

VALUES = {
    "name": "bench",
    "title": "",
    "seeds": "0-99",
    "places": {"T1": {"task": {"name": "T1"}}},
    "planners": {"Nav-SCOPE": {"planner": {"name": "nav-scope"}}},
}
EACH_BLOCK = 10_000


def real_result() -> Finished:
    """Run one unit for real: 15 robots through the reference forest."""
    unit, key = keyed_units(parse_experiment(VALUES, "bench"))[0]
    config = complete(unit.scenario)
    return finished(config, work(make_job(key, world_key(unit.scenario), config, None)))


def fill(store: Store, result: Finished, count: int) -> list[float]:
    """Add ``count`` results under different keys, a transaction each; return the seconds of each block."""
    times, rng = [], np.random.default_rng(0)
    for _ in track(range(count // EACH_BLOCK), "filling"):
        keys = [rng.bytes(16).hex() for _ in range(EACH_BLOCK)]
        begun = time.perf_counter()
        for key in keys:
            store.add(result._replace(key=key, world=key[:4]))
        times.append(time.perf_counter() - begun)
    return times


def floor_s(folder: Path, result: Finished) -> float:
    """Return the time of a plain appended and flushed line of the same size, for comparison."""
    text = str(result)
    begun = time.perf_counter()
    with (folder / "lines.txt").open("w") as file:
        for _ in range(EACH_BLOCK):
            file.write(text)
            file.flush()
    return (time.perf_counter() - begun) / EACH_BLOCK


def main() -> None:
    """Fill a store, ask it things, print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", type=int, default=100_000)
    count = parser.parse_args().results
    result = real_result()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "s.sqlite"
        with Store(path) as store:
            times = fill(store, result, count)
            keys = [row[0] for row in sqlite3.connect(path).execute("SELECT key FROM runs LIMIT 3300")]
            begun = time.perf_counter()
            store.done(keys)
            asked = time.perf_counter() - begun
            units = [(unit, keys[k]) for k, (unit, _) in enumerate(keyed_units(parse_experiment(VALUES, "b")))]
            begun = time.perf_counter()
            read = len(list(store.runs(units * 33)))
            reading = time.perf_counter() - begun
            begun = time.perf_counter()
            health = store.check()
            checking = time.perf_counter() - begun
        size = sum(os.path.getsize(f) for f in Path(folder).glob("s.sqlite*"))
        begun = time.perf_counter()
        sqlite3.connect(path).execute("SELECT avg(path_redundancy), count(*) FROM runs").fetchone()
        column = time.perf_counter() - begun
        plain = floor_s(Path(folder), result)
    first, last = times[0] / EACH_BLOCK, times[-1] / EACH_BLOCK
    print(f"{count} results of 15 robots: {size / count:.0f} bytes each, {size / 1e6:.0f} MB")
    print(f"whole file checked ({health}): {checking:.1f} s")
    print(f"one result added, a transaction: {1e6 * first:.0f} us (first block), {1e6 * last:.0f} us (last block)")
    print(f"  a flushed line of the same text: {1e6 * plain:.0f} us; ratio {last / plain:.1f}")
    print(f"is it done, 3300 keys: {asked * 1e3:.0f} ms; {read} whole runs read: {reading:.2f} s")
    print(f"mean of one column over all: {column * 1e3:.0f} ms")


if __name__ == "__main__":
    main()

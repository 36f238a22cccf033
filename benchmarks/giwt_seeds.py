"""GIWT's networks trained from several seeds: how much of a difference between them is the seed's.

swarmscope giwt data --set-of placed --samples 20000
python benchmarks/giwt_seeds.py --seeds 0-4

For each seed a CNN is trained, and from its encoder every other network and ablation (`VARIANTS`), in a small setting
(`SMALL`). Accuracy is the mean over the sets on test maps; intervals are Student's over the seeds, of differences over
pairs with the same seed. May be stopped at any moment: the same command goes on.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import Progress
from scipy.stats import t as student

from swarmscope.learning.config import parse_config, read_config
from swarmscope.learning.evaluate import judge, open_trained, read_test
from swarmscope.learning.generate import PLACED
from swarmscope.learning.train import train

SMALL = {
    "sets": PLACED, "channels": (8, 16, 32), "epochs": 4, "samples_per_epoch": 15_000, "validation_samples": 6_000,
}  # fmt: skip
VARIANTS: dict[str, dict[str, Any]] = {
    "CNN": {"network": "cnn"},
    "GraphSAGE": {"network": "graphsage"},
    "GAT": {"network": "gat"},
    "GIWT": {"network": "giwt"},
    "GIWT without beta": {"network": "giwt", "use_gain": False},
    "GIWT without positions": {"network": "giwt", "use_position": False},
    "GIWT as printed": {"network": "giwt", "as_printed": True},
    "CNN at 2.5 m": {"network": "cnn", "view_m": 2.5, "shorter": 0.0},
    "GIWT at 2.5 m": {"network": "giwt", "view_m": 2.5, "shorter": 0.0},
    "GIWT as printed at 2.5 m": {"network": "giwt", "as_printed": True, "view_m": 2.5, "shorter": 0.0},
}
FIRST = {5.0: "CNN", 2.5: "CNN at 2.5 m"}
"""By the radius of the pictures: whose encoder the others begin with."""
COMPARED = (("GIWT", VARIANTS.keys() - {"GIWT"}), ("GIWT at 2.5 m", {"CNN at 2.5 m", "GIWT as printed at 2.5 m"}))


def trained(name: str, seed: int, data: Path, out: Path, note: Callable[[str], None]) -> Path:
    """Return the folder of a network trained from a seed; trains what is missing of it."""
    config = parse_config(read_config("cpu").model_dump() | SMALL | VARIANTS[name] | {"seed": seed}, name)
    folder = out / f"{name.lower().replace(' ', '-')}-{seed}"
    first = FIRST[config.view_m]
    init = None if name == first else trained(first, seed, data, out, note) / "best.safetensors"
    train(config, data, folder, init, lambda epoch, done, steps, words: note(f"{name}, seed {seed}: {words}"))
    return folder


def accuracy(folder: Path, shards: dict[str, Any]) -> float:
    """Return the mean over the sets of the share of sides that are the expert's."""
    network = open_trained(folder)
    return float(np.mean([judge(network, shard).hit.mean() for shard in shards.values()]))


def interval(values: np.ndarray) -> str:
    """Return the mean in percent with Student's 95 % interval."""
    mean = 100.0 * values.mean()
    if len(values) < 2:
        return f"{mean:+.2f}"
    half = 100.0 * values.std(ddof=1) / np.sqrt(len(values)) * student.ppf(0.975, len(values) - 1)
    return f"{mean:.2f} ({mean - half:.2f} to {mean + half:.2f})"


def main() -> None:
    """Parse the options, train, score, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0-4", help="first-last")
    parser.add_argument("--data", type=Path, default=Path("runs/giwt/data"))
    parser.add_argument("--out", type=Path, default=Path("runs/giwt/seeds"))
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    shards = read_test(options.data, PLACED)
    found: dict[str, list[float]] = {name: [] for name in VARIANTS}
    with Progress() as bar:
        job = bar.add_task("begins", total=len(VARIANTS) * len(seeds))

        def note(words: str) -> None:
            bar.update(job, description=words)

        for seed in seeds:
            for name in VARIANTS:
                folder = trained(name, seed, options.data, options.out, note)
                found[name].append(accuracy(folder, shards))
                bar.advance(job)
    print(f"| {len(seeds)} seeds | accuracy on test maps, % | " + " | ".join(f"minus {a}" for a, _ in COMPARED) + " |")
    print("|---" * (2 + len(COMPARED)) + "|")
    for name, values in found.items():
        cells = [
            interval(np.array(values) - np.array(found[base])) if name in others else "" for base, others in COMPARED
        ]
        print(f"| {name} | {interval(np.array(values))} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()

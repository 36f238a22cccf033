"""``swarmscope giwt``: expert data, training, evaluation and export of the networks that pick a side."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from swarmscope.cli._code import allow_code
from swarmscope.cli._console import PlainConsole
from swarmscope.errors import ConfigError, MissingExtraError
from swarmscope.learning.generate import DRIVEN, PLACED, generate, totals, verify
from swarmscope.scenarios.overrides import read_value
from swarmscope.viewing.bag.make import scenario_of
from swarmscope.viewing.progress import Bar

RADII_SAMPLES = 4_000
"""Samples of each set on which networks are scored for every radius."""


def data_command(folder: Path, sets: Sequence[str], samples: int, workers: int | None, check: bool) -> None:
    """Bring a data folder to ``samples`` samples for each set, or check what is there; print a table."""
    with _bar() as bar, _resumable("the same command goes on with the next shard"):
        jobs: dict[str, Any] = {}

        def report(name: str, done: int, wanted: int) -> None:
            if name not in jobs:
                jobs[name] = bar.add_task(name, total=wanted, note="")
            bar.update(jobs[name], completed=min(done, wanted), note=f"{done} of {wanted} samples")

        manifest = verify(folder, report) if check else generate(folder, expand(sets), samples, workers, report)
    table = Table(title=f"expert data in {folder}")
    columns = (
        "samples", "train", "validation", "test", "left", "maps", "looked_at", "unreachable", "nothing_ahead", "tie",
    )  # fmt: skip
    for column in ("set", *columns, "neighbours"):
        table.add_column(column, justify="right")
    for name, row in totals(manifest).items():
        table.add_row(name, *(str(row[c]) for c in columns), f"{row['neighbours'] / max(1, row['samples']):.2f}")
    PlainConsole(width=None if sys.stdout.isatty() else 150).print(table)
    if check:
        print("all shards are there and have the checksums of the manifest")


def expand(sets: Sequence[str]) -> list[str]:
    """Return the sets that a list of names and groups stands for."""
    found: list[str] = []
    for name in sets:
        found += {"placed": PLACED, "driven": DRIVEN, "all": PLACED + DRIVEN}.get(name, [name])
    return list(dict.fromkeys(found))


def train_command(config: str, data: Path, out: Path | None, init: Path | None, changes: Sequence[str]) -> None:
    """Train a network, or go on training it."""
    from swarmscope.learning.config import read_config

    _need("torch", "torch_geometric", "safetensors", "tensorboard")
    from swarmscope.learning.train import train

    chosen = read_config(config, read_changes(changes))
    place = out or Path("runs") / "giwt" / chosen.network
    with _bar() as bar, _resumable("the same command goes on after the last whole epoch"):
        job = bar.add_task(chosen.network, total=None, note="reads data")

        def report(epoch: int, done: int, steps: int, note: str) -> None:
            bar.update(
                job, total=chosen.epochs * steps, completed=epoch * steps + done,
                note=f"epoch {epoch + 1} of {chosen.epochs}: {note}",
            )  # fmt: skip
            if note.startswith("validation"):
                bar.console.print(f"epoch {epoch + 1}: {note}", highlight=False)

        history = train(chosen, data, place, init, report)
    best = min(history, key=lambda row: row["validation_loss"])
    print(
        f"{chosen.network}: best of {len(history)} epochs is {best['epoch']}: validation loss "
        f"{best['validation_loss']:.4f}, accuracy {100 * best['validation_accuracy']:.2f} %"
    )
    print(place / "best.safetensors")


def eval_command(
    runs: Sequence[Path],
    data: Path,
    sets: Sequence[str],
    split: str,
    radii: Sequence[float],
    out: Path | None,
    pictures: Path | None,
) -> None:
    """Score trained networks on every set and compare the first with the others."""
    _need("torch", "torch_geometric", "safetensors", *([] if pictures is None else ["sklearn"]))
    from swarmscope.learning.evaluate import data_key, open_trained, read_test, scores_of
    from swarmscope.learning.records import SPLITS

    if split not in SPLITS:
        raise ConfigError("--split", f"'{split}' is none of {', '.join(SPLITS)}")
    if out is not None and out.is_dir():
        raise ConfigError("--out", f"{out} is a folder, not a file to write")
    networks = _told_apart([open_trained(path) for path in runs])
    radii = _checked_radii(radii, networks)
    with _bar() as bar:
        bar.add_task("reads data", total=None, note="")
        shards = read_test(data, expand(sets), split)
    result: dict[str, Any] = {"data": data_key(data, list(shards)), "split": split, "sets": {}}
    everything = _score_sets(networks, shards, result, out)
    result["mean"] = [_plain(scores_of(kept, everything[0])) for kept in everything]
    console, labels = PlainConsole(width=None if sys.stdout.isatty() else 170), [one.label for one in networks]
    for table in (_accuracy_table, _difference_table, _regret_table):
        console.print(table(result, labels))
    scores = _at_radii(networks, shards, radii, console) if radii else {}
    result["radii"] = {label: {f"{r:g}": s._asdict() for r, s in row.items()} for label, row in scores.items()}
    if out is not None:
        _save(out, result)
        print(out)
    if pictures is not None:
        _draw(pictures, networks, shards, scores)


def _score_sets(
    networks: Sequence[Any], shards: dict[str, Any], result: dict[str, Any], out: Path | None
) -> list[list[Any]]:
    """Score the networks set by set into ``result``, kept in ``out``; return each network's verdicts."""
    from swarmscope.learning.evaluate import coin_regret, judge, majority, scores_of

    everything: list[list[Any]] = [[] for _ in networks]
    with _bar() as bar:
        job = bar.add_task("eval", total=len(networks) * sum(s.samples for s in shards.values()), note="")
        for name, shard in shards.items():
            verdicts = [judge(one, shard, lambda done: bar.advance(job, done)) for one in networks]
            rows = []
            for one, kept, verdict in zip(networks, everything, verdicts, strict=True):
                kept.append(verdict)
                scores = scores_of([verdict], [verdicts[0]])
                rows.append({"label": one.label, "sha256": one.sha256} | _plain(scores))
            about = {"samples": shard.samples, "majority": majority(shard), "coin_regret_m": coin_regret(shard)}
            result["sets"][name] = about | {"networks": rows}
            if out is not None:
                _save(out, result)
    return everything


def _told_apart(networks: list[Any]) -> list[Any]:
    """Return networks with labels of their own: those that share one get the name of their folder, or a number."""
    labels = [one.label for one in networks]
    folders = [f" ({one.path.resolve().parent.name})" for one in networks]
    for added in (folders, [f" {k}" for k in range(1, len(networks) + 1)]):
        labels = [text + more if labels.count(text) > 1 else text for text, more in zip(labels, added, strict=True)]
    return [one._replace(label=label) for one, label in zip(networks, labels, strict=True)]


def _checked_radii(radii: Sequence[float], networks: Sequence[Any]) -> list[float]:
    """Return the radii in order, each once; raises ConfigError for one beyond what a network's pictures show."""
    for one in networks:
        for radius in radii:
            if not radius <= one.config.view_m:
                raise ConfigError("--radius", f"{radius:g} m: the pictures of {one.label} show {one.config.view_m:g} m")
    return sorted(set(radii))


def _at_radii(networks: Sequence[Any], shards: dict[str, Any], radii: Sequence[float], console: Console) -> Any:
    """Score networks with robots that see less far, on some samples of all sets; print a table."""
    from swarmscope.learning.evaluate import judge, mean_share
    from swarmscope.learning.records import some

    few = [some(shard, RADII_SAMPLES) for shard in shards.values()]
    total = sum(shard.samples for shard in few)
    table = Table(title=f"accuracy by perception radius, mean over the sets, {total} samples, % (95 %)")
    table.add_column("radius", justify="right")
    for one in networks:
        table.add_column(one.label, justify="right")
    scores: dict[str, dict[float, Any]] = {one.label: {} for one in networks}
    with _bar() as bar:
        job = bar.add_task("radii", total=len(networks) * len(radii) * total, note="")
        for radius in radii:
            for one in networks:
                verdicts = [judge(one, shard, lambda done: bar.advance(job, done), radius) for shard in few]
                scores[one.label][radius] = mean_share([(v.hit, v.map) for v in verdicts])
            table.add_row(f"{radius:g} m", *(_words(scores[one.label][radius]._asdict()) for one in networks))
    console.print(table)
    return scores


def _draw(folder: Path, networks: Sequence[Any], shards: dict[str, Any], scores: dict[str, Any]) -> None:
    """Draw the first network's layers, and accuracy against radius where it was asked for."""
    from swarmscope.learning.figures import radius_png, tsne_png
    from swarmscope.learning.records import concatenate, write_atomically

    with _bar() as bar:
        bar.add_task("pictures", total=None, note="")
        whole = concatenate(list(shards.values()))
        contents = {"layers.png": tsne_png(networks[0], whole)}
        if scores:
            contents["radius.png"] = radius_png(scores)
    for name, data in contents.items():
        write_atomically(folder / name, data)
        print(folder / name)


def ceiling_command(data: Path, sets: Sequence[str], view_m: float) -> None:
    """Print how often near twins contradict each other."""
    _need("sklearn")
    from swarmscope.learning.ceiling import contradictions
    from swarmscope.learning.evaluate import read_test

    names = expand(sets)
    with _bar() as bar:
        bar.add_task("reads data", total=None, note="")
        training, test = (read_test(data, names, split) for split in ("train", "test"))
    table = Table(title=f"pairs of test and training samples that look alike within {view_m:g} m: sides that differ, %")
    table.add_column("set", justify="right")
    with _bar() as bar:
        job = bar.add_task("twins", total=len(names), note="")
        for name in names:
            rows = contradictions(training[name], test[name], view_m)
            if len(table.columns) == 1:
                for row in rows:
                    table.add_column(f"nearest {100 * row.share:g} %", justify="right")
            table.add_row(name, *(f"{100 * row.contradict:.1f} (< {row.difference_m:.2f} m)" for row in rows))
            bar.advance(job)
    PlainConsole(width=None if sys.stdout.isatty() else 170).print(table)


def export_command(run: Path, out: Path, scores: Path | None) -> None:
    """Write what a robot runs."""
    _need("torch", "torch_geometric", "safetensors", "onnx", "onnxruntime")
    from swarmscope.learning.export import export, read_scores
    from swarmscope.learning.train import BEST

    checkpoint = run / BEST if run.is_dir() else run
    card = {} if scores is None else {"scores": read_scores(scores, checkpoint)}
    with _bar() as bar:
        bar.add_task("export", total=None, note="")
        difference = export(checkpoint, out, card)
    print(f"{out}: ONNX Runtime and PyTorch differ by at most {difference:.1e}")


def decisions_command(run: Path, numbers: Sequence[int], count: int, out: Path, code: bool) -> None:
    """Play a run again, print its choices with outputs and attention weights, and draw some of them."""
    from swarmscope.learning.records import write_atomically
    from swarmscope.viewing.key_points.again import key_points
    from swarmscope.viewing.key_points.picture import key_points_png, most_moved
    from swarmscope.viewing.run_data import load_run

    _need("onnx", "onnxruntime")
    found, scenario = load_run(run), scenario_of(run)
    allow_code([scenario], code)
    with _bar() as bar:
        bar.add_task("plays the run again", total=None, note="")
        points = key_points(found, scenario)
    by_number = {one.number: one for one in points}
    for number in numbers:
        if number not in by_number:
            raise ConfigError("--number", f"the network made no choice {number}: {', '.join(map(str, by_number))}")
    chosen = [by_number[number] for number in numbers] or most_moved(points, count)
    if not chosen:
        raise ConfigError(str(run), "in this run nobody chose a side with a neighbour; --number draws others")
    _print_choices(points)
    write_atomically(out, key_points_png(found, chosen))
    print(out)


def _print_choices(points: Sequence[Any]) -> None:
    from swarmscope.viewing.key_points.picture import side_words

    table = Table(title="choices of the network; attention to each robot (6), beta (8) in brackets")
    for column in ("choice", "s", "robot", "outputs", "left", "right", "alone, left", "taken", "shortest", "attention"):
        table.add_column(column, justify="left" if column == "attention" else "right")
    for one in points:
        left, right = one.outputs
        others = zip(one.heard, one.weight[1:], one.gains, strict=True)
        words = [f"itself {one.weight[0]:.2f}", *(f"{i}: {weight:.2f} ({gain:.2f})" for i, weight, gain in others)]
        table.add_row(
            str(one.number), f"{one.t_s:.1f}", str(one.robot), f"{one.logits[0]:.2f}, {one.logits[1]:.2f}",
            f"{left:.3f}", f"{right:.3f}", f"{one.p_self:.3f}", side_words(one.side), side_words(one.true_side),
            ", ".join(words),
        )  # fmt: skip
    PlainConsole(width=None if sys.stdout.isatty() else 190).print(table)


def read_changes(changes: Sequence[str]) -> dict[str, Any]:
    """Return KEY=VALUE words as a mapping, values read as YAML."""
    found: dict[str, Any] = {}
    for text in changes:
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise ConfigError("--set", f"'{text}' is not KEY=VALUE")
        found[key] = read_value(value, text)
    return found


def _need(*packages: str) -> None:
    """Raise MissingExtraError unless the packages of the extra are installed."""
    from importlib.util import find_spec

    if not all(find_spec(name) for name in packages):
        raise MissingExtraError("swarmscope giwt", "learn")


def _save(out: Path, result: dict[str, Any]) -> None:
    from swarmscope.learning.records import write_atomically

    write_atomically(out, (json.dumps(result, indent=1) + "\n").encode())


def _words(score: Any) -> str:
    return f"{100 * score['value']:.2f} ({100 * score['low']:.1f}-{100 * score['high']:.1f})"


def _plain(scores: dict[str, Any]) -> dict[str, Any]:
    return {name: score._asdict() for name, score in scores.items()}


def _accuracy_table(result: dict[str, Any], labels: list[str]) -> Table:
    table = Table(title=f"accuracy on {result['split']} maps, % (95 % interval over maps)")
    for column in ("set", "samples", "majority", *labels):
        table.add_column(column, justify="right")
    for name, entry in result["sets"].items():
        words = (_words(row["accuracy"]) for row in entry["networks"])
        table.add_row(name, str(entry["samples"]), f"{100 * entry['majority']:.1f}", *words)
    table.add_row("mean", "", "", *(_words(row["accuracy"]) for row in result["mean"]))
    return table


def _difference_table(result: dict[str, Any], labels: list[str]) -> Table:
    table = Table(title=f"{labels[0]} minus the others, and its features exact minus in bytes: percentage points")
    for column in ("set", *labels[1:], "bytes"):
        table.add_column(column, justify="right")
    every = {name: entry["networks"] for name, entry in result["sets"].items()}
    for name, rows in (every | {"mean": result["mean"]}).items():
        apart = [*(row["first_ahead"] for row in rows[1:]), rows[0]["lost_on_the_radio"]]
        words = (tuple(100 * score[key] for key in ("value", "low", "high")) for score in apart)
        table.add_row(name, *(f"{value:+.2f} ({low:+.2f}..{high:+.2f})" for value, low, high in words))
    return table


def _regret_table(result: dict[str, Any], labels: list[str]) -> Table:
    table = Table(title="detours because of wrong sides, m a choice (share of a coin's detours saved)")
    for column in ("set", "coin", *labels):
        table.add_column(column, justify="right")
    for name, entry in result["sets"].items():
        coin = entry["coin_regret_m"]
        lost = [row["regret_m"]["value"] for row in entry["networks"]]
        table.add_row(name, f"{coin:.3f}", *(f"{value:.3f} ({100 * (1 - value / coin):.1f} %)" for value in lost))
    return table


@contextmanager
def _resumable(how: str) -> Iterator[None]:
    """Say on Ctrl-C how to go on."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"stopped; {how}") from None


@contextmanager
def _bar() -> Iterator[Bar]:
    columns = (
        TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}"), TimeElapsedColumn(),
        TimeRemainingColumn(),
    )  # fmt: skip
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        yield bar

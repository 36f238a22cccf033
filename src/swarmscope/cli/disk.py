"""``swarmscope disk``: the runs of the unit disk, compared, looked at, and with a user's own controller."""

from __future__ import annotations

import json
import math
import shlex
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from swarmscope.cli._console import PlainConsole
from swarmscope.disk import controllers, maps, user
from swarmscope.disk.bounds import bound
from swarmscope.disk.check import check
from swarmscope.disk.find_map import find_map, seed_of
from swarmscope.disk.random_maps import RandomCase, random_map
from swarmscope.disk.rules import Rules, all_permutations, read_permutation, scaled
from swarmscope.disk.runs import Film, Problem, problem
from swarmscope.disk.stalls import Situation, basins, describe
from swarmscope.disk.study import table
from swarmscope.disk.study.batches import Choice, Report, play_all, play_batch, read_choice
from swarmscope.disk.study.figures import (
    Played,
    Row,
    collided,
    csv_text,
    ended_words,
    failures,
    played,
    row,
    rows_by_map,
)
from swarmscope.errors import ConfigError
from swarmscope.experiments.seeds import seed_set
from swarmscope.judging.provenance import own_revision, versions
from swarmscope.scenarios.keys import docs_of
from swarmscope.viewing.progress import Bar
from swarmscope.viewing.report.publish import put_in_place

COLLIDED = 1
"""Exit code when some run ended by contact, or without a valid velocity."""
SHOWN_FAILURES = 8
PICTURES = 1500
"""A film has about so many pictures."""
FIELD_POINTS, USER_POINTS, USER_COARSE = 61, 21, 4.0
"""Points along each side of a field, and steps between two looks at it."""
SLOW_S = 300.0
"""A user's controller that will take longer gets a note."""


def run_command(
    names: Sequence[str],
    map_: str,
    permutation: str | None,
    robots: int | None,
    radius: float | None,
    out: Path | None,
    call_s: float = user.CALL_S,
) -> None:
    """Play one run with each controller, print how it went, write pictures and a replay page."""
    from swarmscope.disk.study import pictures, replay

    choices = read_choices(names, call_s)
    of = one_problem(map_, permutation, robots, radius)
    of_permutation = "".join(str(k) for k in of.permutation[0]) if of.rules.n <= 10 else "many"
    place = out or Path("runs") / "disk" / f"{file_stem(of.maps[0].name)}-{of_permutation}"
    about = f"One run on {of.maps[0].name} by {len(choices)} controllers."
    options = ["--map", map_, "--permutation", ",".join(map(str, of.permutation[0])), "--robots", str(of.rules.n)]
    options += [] if radius is None else ["--radius", repr(radius)]
    results = Results(place, f"A run on {of.maps[0].name}", about, ["disk", "run", *names, *options])
    least = bound(of)
    all_played, films = [], []
    for choice in choices:
        film = Film(max(1, math.ceil(int(least[0]) / PICTURES)), [])
        with waiting(f"{choice.label} on {of.maps[0].name}"):
            all_played.append(played(choice.label, of, play_batch(choice, of, film).outcome, least))
        films.append(film)
        print(f"{choice.label}: {ended_words(all_played[-1], 0)}")
    contents: dict[str, bytes] = {}
    with waiting("pictures"):
        for one, film in zip(all_played, films, strict=True):
            stem = file_stem(one.label)
            contents[f"{stem}.png"] = pictures.trajectories_png(of, 0, one.outcome, film, one.label, int(least[0]))
            contents[f"{stem}-clearance.png"] = pictures.clearance_png(of, 0, one.outcome, film, one.label)
        if len(choices) > 1:
            side = [(one.label, one.outcome, film) for one, film in zip(all_played, films, strict=True)]
            contents["side-by-side.png"] = pictures.paths_side_by_side_png(of, 0, side, int(least[0]))
        shown = [replay.Shown(one.label, one.outcome, film) for one, film in zip(all_played, films, strict=True)]
        contents["replay.html"] = replay.replay_page(of, shown, int(least[0])).encode()
    results.save([all_played], contents)
    results.print_names()
    _end(all_played)


def table_command(
    names: Sequence[str],
    map_names: Sequence[str],
    permutations: Sequence[str],
    out: Path,
    workers: int | None,
    call_s: float = user.CALL_S,
) -> None:
    """Play all permutations on the maps with each controller and compare them as Table 1 of the report does."""
    choices = read_choices(names, call_s)
    rules = Rules()
    chosen = [read_permutation(text, rules.n) for text in permutations] or list(all_permutations(rules.n))
    of = problem(rules, [find_map(name, rules) for name in map_names or maps.REPORT_MAPS], chosen)
    twice = first_twice([one.name for one in of.maps])
    if twice is not None:
        raise ConfigError(twice, "two maps have this name; name each once, and give files different names")
    check(of)
    options = [word for name in map_names for word in ("--map", name)]
    options += [word for text in permutations for word in ("--permutation", text)]
    about = (
        f"{len(of.maps)} maps, {len(chosen)} permutations of the goals of {rules.n} robots: every controller played "
        "the same runs under the same rules."
    )
    results = Results(out, "Controllers on the unit disk", about, ["disk", "table", *names, *options])
    for group in play_choices(choices, of, workers):
        results.save([group])
    all_rows = [one for entry in group for one in rows_by_map(entry)]
    print_table(all_rows, "steps until all have arrived", len(chosen) == math.factorial(rules.n))
    print_failures(group)
    results.print_names()
    _end(group)


def random_command(
    names: Sequence[str],
    robots: Sequence[int],
    seeds: str,
    count: int | None,
    out: Path,
    workers: int | None,
    call_s: float = user.CALL_S,
) -> None:
    """Play random maps with each controller: how many arrive, how far from the bound, and that nobody collides."""
    choices = read_choices(names, call_s)
    chosen = seed_set(seeds)[:count]
    options = [word for n in robots for word in ("--robots", str(n))]
    options += ["--seeds", seeds, "--maps", str(len(chosen))]
    about = (
        f"{len(chosen)} random maps, each with a random permutation: loose discs, U-shaped traps, passages just "
        "wider and just narrower than a robot. Every controller played the same runs."
    )
    results = Results(out, "Controllers on random maps", about, ["disk", "random", *names, *options])
    done: list[list[Played]] = []
    for n in robots:
        rules = scaled(n)
        with waiting(f"{len(chosen)} random maps for {n} robots"):
            of = as_problem(rules, [random_map(seed, rules) for seed in chosen])
        for group in play_choices(choices, of, workers):
            results.save([*done, group])
        done.append(group)
        all_rows = [row(entry, f"{len(chosen)} maps") for entry in group]
        print_table(all_rows, f"{n} robots of radius {rules.r:.4g} on random maps", False)
        for entry in all_rows:
            share = entry.share
            print(f"{entry.controller}: {share.estimate:.2%} arrive (95 %: {share.low:.2%} to {share.high:.2%})")
        print_failures(group)
    results.print_names()
    _end([one for group in done for one in group])


def _end(all_played: Sequence[Played]) -> None:
    """End with another exit code than 0 if some run ended by contact."""
    if any(map(collided, all_played)):
        raise typer.Exit(COLLIDED)


def field_command(
    name: str,
    map_: str,
    permutation: str | None,
    robot: int,
    alone: bool,
    resolution: int | None,
    out: Path | None,
    call_s: float = user.CALL_S,
) -> None:
    """Draw the field of one robot's velocities, and say where robots get stuck in it."""
    from swarmscope.disk.study import pictures

    choice = read_choice(name, call_s)
    if choice.name == "planned":
        raise ConfigError(name, "follows a plan in time, so it has no field; draw another, or a run of it")
    of = one_problem(map_, permutation, None, None)
    if not 0 <= robot < of.rules.n:
        raise ConfigError("robot", f"there is no robot {robot}; they are 0 to {of.rules.n - 1}")
    others = None if alone else of.start[0]
    situation = Situation(choice.kind(), of.maps[0], of.rules, tuple(of.permutation[0].tolist()), robot, others)
    place = out or Path("runs") / "disk" / f"field-{file_stem(choice.label)}-{file_stem(of.maps[0].name)}-{robot}.png"
    if place.is_dir():
        raise ConfigError(str(place), "is a folder; name the PNG file to write")
    put_in_place(place.parent, {})  # a folder that cannot be written is told before the work
    with waiting(f"field of {choice.label} on {of.maps[0].name}"):
        # A user's Python is called for every point and step: fewer of both.
        points, coarse = (USER_POINTS, USER_COARSE) if choice.file else (FIELD_POINTS, 1.0)
        found = basins(situation, resolution or points, coarse)
        print(describe(found))
        picture = pictures.field_png(situation, found, coarse)
    put_in_place(place.parent, {place.name: picture})
    print(place)


def repulsion_command(name: str, out: Path) -> None:
    """Draw how hard the report's controller pushes away from a thing at any gap."""
    from swarmscope.disk.study import pictures

    choice = read_choice(name)
    if choice.name != "report":
        raise ConfigError(name, "has no such repulsion; only 'report' has")
    if out.is_dir():
        raise ConfigError(str(out), "is a folder; name the PNG file to write")
    put_in_place(out.parent, {out.name: pictures.repulsion_png(choice.kind().params)})
    print(out)


def start_command(file: Path) -> None:
    """Write a controller to begin with."""
    print(f"{user.write_starter(file)} is there; try it:")
    print(f"  swarmscope disk run {file} --map c0 --permutation 0,3,1,4,2")


def list_command() -> None:
    """Print controllers and maps."""
    console = PlainConsole()
    for name in controllers.names():
        kind = controllers.find(name)
        console.print(f"[bold]{name}[/bold]  {kind.summary}", highlight=False)
        console.print(f"  knows: {kind.knows}", highlight=False)
        console.print(f"  guarantees: {kind.guarantees}", highlight=False)
        numbers = Table("parameter", "default", "meaning")
        for key, default in kind.params._asdict().items():
            numbers.add_row(key, str(default), docs_of(type(kind.params)).get(key, ""))
        console.print(numbers)
    console.print(f"[bold]FILE.py[/bold]  a file of yours with {user.SIGNATURE}", highlight=False)
    places = Table("map", "obstacles", "what it is")
    for one in maps.NAMED.values():
        places.add_row(one.name, str(len(one.obstacles)), one.about)
    places.add_row("random:SEED", "", "a random one, the same for the same seed and number of robots")
    places.add_row("FILE.yaml", "", "'obstacles', a list of 'center: [x, y]' and 'radius'")
    console.print(places)


def one_problem(map_: str, permutation: str | None, robots: int | None, radius: float | None) -> Problem:
    """Return the problem of one run. Errors: those of maps, rules and permutations, and of runs that cannot end."""
    n = robots or Rules().n
    rules = scaled(n) if radius is None else scaled(n, r=radius)
    place, chosen = find_map(map_, rules), tuple(range(n))
    if permutation is not None:
        chosen = read_permutation(permutation, n)
    elif map_.startswith("random:"):
        chosen = random_map(seed_of(map_), rules).permutation
    of = problem(rules, [place], [chosen])
    check(of)
    return of


def read_choices(names: Sequence[str], call_s: float) -> list[Choice]:
    """Return the controllers of a command line, which have to differ in name. Errors: those of ``read_choice``."""
    choices = [read_choice(name, call_s) for name in names]
    twice = first_twice([choice.label for choice in choices])
    if twice is not None:
        raise ConfigError(twice, "two controllers have this name; name each once, and give files different names")
    return choices


def first_twice(names: Sequence[str]) -> str | None:
    """Return the first name that is there more than once."""
    return next((name for name in names if names.count(name) > 1), None)


def as_problem(rules: Rules, cases: Sequence[RandomCase]) -> Problem:
    """Return the runs of some random cases."""
    permutations = np.array([one.permutation for one in cases])
    return Problem(rules, tuple(one.map for one in cases), np.arange(len(cases)), permutations)


def play_choices(choices: Sequence[Choice], of: Problem, workers: int | None) -> Iterator[list[Played]]:
    """Play the runs with one controller after the other, with a bar; yield what is done each time."""
    least = bound(of)
    found: list[Played] = []
    for choice in choices:
        with progress_bar(choice, len(of.map_of)) as progress:
            found.append(played(choice.label, of, play_all(choice, of, workers, progress).outcome, least))
        yield found


def print_table(all_rows: Sequence[Row], title: str, printed: bool) -> None:
    """Print rows as a table, in full where nobody looks at a terminal."""
    PlainConsole(width=None if sys.stdout.isatty() else 150).print(table.terminal_table(all_rows, title, printed))


@contextmanager
def progress_bar(choice: Choice, runs: int) -> Iterator[Report]:
    """Show how many runs are done, and for a user's controller how slow it is."""
    columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}"), TimeElapsedColumn()
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        job = bar.add_task(choice.label, total=runs, note=f"0 of {runs} runs")
        told = False

        def report(done: int, call_s: float, left_s: float) -> None:
            nonlocal told
            slow = f", {call_s * 1e6:.0f} us a call, {left_s / 60:.0f} min left" if call_s else ""
            bar.update(job, completed=done, note=f"{done} of {runs} runs{slow}")
            if left_s > SLOW_S and not told:
                told = True
                bar.console.print(
                    f"{choice.label} takes {call_s * 1e6:.0f} us a call: {runs} runs will take about "
                    f"{left_s / 60:.0f} min. Fewer: --map and --permutation."
                )

        yield report


@contextmanager
def waiting(what: str) -> Iterator[None]:
    """Show that something is under way."""
    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        bar.add_task(what, total=None)
        yield


def print_failures(group: Sequence[Played]) -> None:
    """Name the runs that did not arrive; of many only the first."""
    for of in group:
        failed = failures(of)
        for place, permutation, what in failed[:SHOWN_FAILURES]:
            shown = permutation if of.problem.rules.n <= 20 else "..."
            print(f"{of.label}: {place}, permutation {shown}: {what}")
        if len(failed) > SHOWN_FAILURES:
            print(f"{of.label}: and {len(failed) - SHOWN_FAILURES} more")


class Results:
    """The folder of a comparison; what is done is saved as soon as it is, so that stopping loses nothing."""

    def __init__(self, out: Path, title: str, about: str, words: Sequence[str]) -> None:
        self.out, self.title, self.about = out, title, about
        self.command = shlex.join(["swarmscope", *words])
        self.names: list[str] = []
        put_in_place(out, {})  # a folder that cannot be written is told before hours of work

    def save(self, groups: Sequence[Sequence[Played]], more: dict[str, bytes] | None = None) -> None:
        """Write page, runs and figures of what is done so far."""
        facts = [("version", versions()["swarmscope"]), ("revision", own_revision())]
        all_played = [one for group in groups for one in group]
        about = {
            "command": self.command,
            "rules": [group[0].problem.rules.as_dict() for group in groups],
            "versions": versions(),
            "git": own_revision(),
            "figures": [row(one, "all")._asdict() | {"robots": one.problem.rules.n} for one in all_played],
        }
        contents = (more or {}) | {
            "report.html": table.page(self.title, self.about, self.command, facts, groups).encode(),
            "runs.csv": csv_text(all_played).encode(),
            "result.json": plain_json(about),
        }
        put_in_place(self.out, contents)
        self.names = list(contents)

    def print_names(self) -> None:
        """Print the files."""
        for name in self.names:
            print(self.out / name)


def plain_json(data: dict[str, Any]) -> bytes:
    """Return JSON without numbers that JSON does not have."""

    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: plain(entry) for key, entry in value.items()}
        if isinstance(value, tuple) and hasattr(value, "_asdict"):
            return plain(value._asdict())
        if isinstance(value, list | tuple):
            return [plain(entry) for entry in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    return (json.dumps(plain(data), indent=1, allow_nan=False) + "\n").encode()


def file_stem(label: str) -> str:
    """Return a label as a part of a file name."""
    return "".join(c if c.isalnum() or c in "-_." else "-" for c in label).strip("-.") or "run"

"""The ``swarmscope`` command. Heavy imports happen inside the commands: ``--help`` answers at once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from swarmscope import __version__
from swarmscope.cli._errors import PlainErrors

app = typer.Typer(
    cls=PlainErrors,
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Robots that share what they see: run swarms in unknown places, look at them, measure them.",
    epilog="Example: [bold]swarmscope run --task T1 --robots 15 --seed 0[/bold]",
)


experiments = typer.Typer(no_args_is_help=True, help="Sweeps over worlds, planners and seeds: run, resume, report.")
app.add_typer(experiments, name="experiment")

disk = typer.Typer(no_args_is_help=True, help="Discs crossing a unit disk: compare controllers, try your own, look.")
app.add_typer(disk, name="disk")

giwt = typer.Typer(no_args_is_help=True, help="The network that picks a side: data, training, scores, export, choices.")
app.add_typer(giwt, name="giwt")

new = typer.Typer(no_args_is_help=True, help="Begin a task or a planner of your own: one file, and a test for it.")
app.add_typer(new, name="new")

OwnName = Annotated[str, typer.Argument(help="A Python name; NAME.py and test_NAME.py are written here.")]
GiwtData = Annotated[Path, typer.Option("--data", help="Folder of the expert data.")]
GiwtSets = Annotated[
    list[str] | None, typer.Option("--set-of", help="A-I ... C-II, A-I-driven ..., placed, driven, all; repeatable.")
]
Controllers = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[CONTROLLER]...", help="Name (see 'swarmscope disk list'), NAME:key=value,... or FILE.py of yours."
    ),
]
DiskMap = Annotated[str, typer.Option("--map", help="c0, u, crevice, one-disc, minima, empty, random:SEED, FILE.yaml.")]
CallLimit = Annotated[float, typer.Option(min=0.001, max=86400.0, help="Seconds for a call of your controller.")]
Permutation = Annotated[str | None, typer.Option(help="Goals of robots 0, 1, ...: 0,3,1,4,2. Else 0,1,2,...")]
ExperimentFile = Annotated[str, typer.Argument(metavar="FILE", help="Experiment file (YAML), or a shipped one's name.")]
Maps = Annotated[int | None, typer.Option(min=1, help="Only the first so many seeds (the papers have 20; GIWT 500).")]
EngineName = Annotated[str, typer.Option(help="in-process, local (processes) or ray (machines).")]
Workers = Annotated[int | None, typer.Option(min=1, max=1024, help="Processes, else one a core.")]
Address = Annotated[str | None, typer.Option(help="Of a Ray cluster; 'auto' for the one this machine belongs to.")]
StorePath = Annotated[Path | None, typer.Option(help="File with the results, else runs/<name>/results.sqlite.")]
ReportOut = Annotated[Path | None, typer.Option(help="Folder of the report, else runs/<name>/report.")]


Close = Annotated[bool, typer.Option("--close", help="Draw where robots have been, not the whole world.")]
PresetName = Annotated[
    str | None, typer.Option("--preset", help="Planners as their documents print them: printed (docs/theory.md).")
]
NoCode = Annotated[bool, typer.Option("--no-code", help="Refuse planners and tasks in FILE.py of somebody's own.")]


def _version(value: bool) -> None:
    if value:
        typer.echo(f"swarmscope {__version__}")
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Options of every command."""


@app.command(
    epilog="Examples:\n\n"
    "[bold]swarmscope run --task T3 --seed 4 --set planner.params.w_i=0[/bold]\n\n"
    "[bold]swarmscope run --task T3 --planner nav-i --preset printed --set guard=false[/bold]\n\n"
    "[bold]swarmscope run examples/noisy_radio.yaml[/bold]\n\n"
    "[bold]swarmscope run --map willow_garage_office --robots 5 --seed 23[/bold]\n\n"
    "[bold]swarmscope run --map hall.yaml --start 1,2,90 --goal 8,2 --start 8,3 --goal 1,3[/bold]\n\n"
    "[bold]swarmscope run --map drawn.png --resolution 0.05 --robots 3[/bold]\n\n"
    "[bold]swarmscope run examples/people.yaml --set robot.1.radius_m=0.35[/bold]\n\n"
    "[bold]swarmscope run runs/first/config.yaml --out runs/again[/bold]"
)
def run(
    scenario: Annotated[
        Path | None, typer.Argument(help="Scenario file (YAML); options override it.", show_default=False)
    ] = None,
    task: Annotated[str | None, typer.Option(help="Task (see 'swarmscope tasks') or FILE.py, else T1.")] = None,
    map_: Annotated[
        str | None,
        typer.Option(
            "--map", help="A building: map_server YAML, picture, Moving AI .map, or the name of a packaged map."
        ),
    ] = None,
    resolution: Annotated[
        float | None, typer.Option(help="Side of the map's cells, metres, where its file does not say it.")
    ] = None,
    number: Annotated[int | None, typer.Option(min=0, help="Which maze of a .npz of ORION's.")] = None,
    start: Annotated[
        list[str] | None,
        typer.Option(metavar="X,Y[,DEG]", help="Start of the next robot on the map, metres and degrees; repeatable."),
    ] = None,
    goal: Annotated[
        list[str] | None,
        typer.Option(metavar="X,Y[,DEG]", help="Goal of the next robot on the map, metres, degrees; repeatable."),
    ] = None,
    trips: Annotated[str | None, typer.Option(help="Moving AI .scen file: starts and goals on the map.")] = None,
    first_trip: Annotated[int | None, typer.Option(min=0, help="Trip of robot 0, else the file's first, 0.")] = None,
    planner: Annotated[
        str | None, typer.Option(help="Planner (see 'swarmscope planners') or FILE.py, else nav-scope.")
    ] = None,
    preset: PresetName = None,
    robots: Annotated[
        int | None, typer.Option(help="Number of robots, else as many as have starts or goals on the map, else 15.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of world and noise, else 0.")] = None,
    limit: Annotated[float | None, typer.Option(help="Time limit, simulated seconds, else 300.")] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY.PATH=VALUE",
            help="Any key of a scenario; of a list by number: robot.1.radius_m=0.3; repeatable.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Run folder, else runs/<task>-<planner>-<seed>, and a hash of what is not the default."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over the run of another scenario.")] = False,
    threads: Annotated[int, typer.Option(min=1, max=256, help="Threads; the result is the same.")] = 1,
    pictures: Annotated[bool, typer.Option(help="Make paths.png and replay.html.")] = True,
    mcap: Annotated[
        bool, typer.Option("--mcap", help="Make run.mcap, too: ROS 2 messages for Foxglove, Rerun, rosbag2.")
    ] = False,
    no_code: NoCode = False,
) -> None:
    """Run one scenario to a folder: metrics, trajectory, world, a picture, a replay page."""
    from swarmscope.cli.run import Make, run_command

    place: dict[str, Any] = {"resolution_m": resolution, "number": number, "trips": trips, "first_trip": first_trip}
    place |= {"starts": start, "goals": goal}
    options: dict[str, Any] = {"robots": robots, "seed": seed, "limit_s": limit, "planner.preset": preset}
    options |= {f"map.{key}": value for key, value in place.items()}
    make = Make(pictures, mcap)
    run_command(scenario, task, map_, planner, options, set_ or [], out, threads, make, not no_code, force)


@app.command(
    epilog="Examples:\n\n"
    "[bold]swarmscope config T1 > my.yaml; swarmscope run my.yaml[/bold]\n\n"
    "[bold]swarmscope config depository --planner dh-bug[/bold]\n\n"
    "[bold]swarmscope config --schema > scenario.schema.json[/bold]"
)
def config(
    task: Annotated[str, typer.Argument(help="Task (see 'swarmscope tasks').")] = "T1",
    planner: Annotated[str | None, typer.Option(help="Planner (see 'swarmscope planners'), else nav-scope.")] = None,
    preset: PresetName = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON schema of scenarios instead.")] = False,
) -> None:
    """Print a complete scenario: every key with its default and its meaning."""
    from swarmscope.cli.config import config_command

    config_command(task, planner, schema, preset)


@app.command(
    epilog="Examples:\n\n"
    "[bold]swarmscope perceive malaga_telecom_2006_sick_lms --out runs/perceive[/bold]\n\n"
    "[bold]swarmscope perceive turtlebot.csv --no-return 0 --set robot.v_max_mps=0.22 --radius 0.11[/bold]\n\n"
    "[bold]swarmscope perceive drive.bag --topic /scan --every 10 --out runs/drive[/bold]\n\n"
    "[bold]swarmscope perceive numbers.csv --fov 270 --mask 40..50 --mask=-50..-40[/bold]"
)
def perceive(
    scans: Annotated[
        str,
        typer.Argument(help="Scans: .npz, .csv, .txt, CARMEN .log, rosbag2, .mcap, .bag, or a name of packaged ones."),
    ],
    out: Annotated[Path | None, typer.Option(help="Folder for features.csv and perceive.png.")] = None,
    topic: Annotated[str | None, typer.Option(help="Topic with the scans, where a bag has several.")] = None,
    every: Annotated[int, typer.Option(min=1, help="Only every Nth scan.")] = 1,
    range_m: Annotated[float | None, typer.Option("--range", help="Range that the robots use, metres, else 5.")] = None,
    radius_m: Annotated[
        float | None, typer.Option("--radius", help="Radius and half width of the robot, metres, else 0.15.")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY.PATH=VALUE", help="A scenario's key: robot, guard, safety, noise, lidar; repeatable."
        ),
    ] = None,
    scenario: Annotated[
        Path | None, typer.Option(help="Scenario file with the robot's data sheet, the largest one's of several.")
    ] = None,
    beam_step: Annotated[int, typer.Option(min=1, help="Use every Nth beam.")] = 1,
    no_return: Annotated[
        list[float] | None,
        typer.Option(help="A reading that means no return, beside inf: 0, -1, nan for some LiDARs; repeatable."),
    ] = None,
    mask: Annotated[
        list[str] | None,
        typer.Option(metavar="FROM..TO", help="Degrees in which the robot sees its own posts; repeatable."),
    ] = None,
    upside_down: Annotated[bool, typer.Option("--upside-down", help="The LiDAR is mounted upside down.")] = False,
    fov: Annotated[
        float | None, typer.Option(help="Degrees that scans cover, for files that do not say it; 360: a closed circle.")
    ] = None,
    first: Annotated[
        float | None, typer.Option(help="Degrees at which the first reading looks then, else -fov/2.")
    ] = None,
    time_increment: Annotated[
        float | None, typer.Option(help="Seconds from one reading to the next, else as the file says; 0: all at once.")
    ] = None,
    speed: Annotated[float | None, typer.Option(help="The robot's speed, m/s, where there is no odometry.")] = None,
    turn_rate: Annotated[float | None, typer.Option(help="Its turn rate, rad/s, counter-clockwise.")] = None,
) -> None:
    """Safe directions and features of recorded scans, with the time that they take."""
    from swarmscope.cli.perceive import perceive_command, read_mask, sheet_of_options
    from swarmscope.sim.scan_read import Ask

    use = sheet_of_options(scenario, set_ or [], range_m, radius_m)._replace(
        beam_step=beam_step,
        no_return=no_return or [],
        masks_deg=[read_mask(text) for text in mask or []],
        upside_down=upside_down,
        time_increment_s=time_increment,
        motion=None if speed is None and turn_rate is None else (speed or 0.0, turn_rate or 0.0),
    )
    perceive_command(scans, out, Ask(topic, every, fov, first), use)


@app.command(
    epilog="Examples:\n\n"
    "[bold]swarmscope replay runs/first --open[/bold]\n\n"
    "[bold]swarmscope replay runs/office --memory[/bold]"
)
def replay(
    run_dir: Annotated[Path, typer.Argument(help="A run folder.")],
    open_: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = False,
    close: Close = False,
    memory: Annotated[
        bool, typer.Option("--memory", help="With the maps and ways of robots that remember: plays the run again.")
    ] = False,
    no_code: NoCode = False,
) -> None:
    """Make the replay page and the picture of a run folder anew."""
    from swarmscope.user_files import whole_path
    from swarmscope.viewing.pictures import write_picture
    from swarmscope.viewing.replay import write_replay

    memories = None
    if memory:
        from swarmscope.cli.memory import remembered
        from swarmscope.viewing.run_data import load_run

        memories = remembered(load_run(run_dir), not no_code)
    page = write_replay(run_dir, memories)
    typer.echo(str(write_picture(run_dir, close)))
    typer.echo(str(page))
    if open_:
        typer.launch(whole_path(page).as_uri())


@app.command(
    epilog="Examples:\n\n"
    "[bold]swarmscope memory runs/office[/bold]\n\n"
    "[bold]swarmscope memory runs/office --robot 2 --number 3 --out turned-back.png[/bold]"
)
def memory(
    run_dir: Annotated[Path, typer.Argument(help="A run folder of a planner that keeps a map, such as atlas.")],
    robot: Annotated[int | None, typer.Option(help="Whose search, else anybody's.")] = None,
    number: Annotated[int, typer.Option(min=1, help="1: the search that changed the way most, 2: the next one.")] = 1,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="PNG file, else memory.png in the folder.")] = None,
    no_code: NoCode = False,
) -> None:
    """Play a run again and draw what a robot knew, and which way it meant to go, before and after a search."""
    from swarmscope.cli.memory import memory_command

    memory_command(run_dir, robot, number, out, not no_code)


@app.command(
    epilog="Examples:\n\n"
    "[bold]swarmscope mcap runs/first[/bold]\n\n"
    "[bold]swarmscope mcap runs/first --out forest.mcap; ros2 bag play forest.mcap[/bold]"
)
def mcap(
    run_dir: Annotated[Path, typer.Argument(help="A run folder.")],
    out: Annotated[Path | None, typer.Option("--out", "-o", help="MCAP file, else run.mcap in the folder.")] = None,
    threads: Annotated[int, typer.Option(min=1, max=256, help="Threads; the result is the same.")] = 1,
    no_code: NoCode = False,
) -> None:
    """Play a run again and write all that its robots saw and did as ROS 2 messages (Foxglove, Rerun, rosbag2)."""
    from swarmscope.cli.mcap import mcap_command

    mcap_command(run_dir, out, threads, not no_code)


@app.command(
    epilog="Examples:\n\n"
    "[bold]swarmscope video runs/first[/bold]\n\n"
    "[bold]swarmscope video runs/first -o forest.mp4 --speed 4 --fps 30 --size 1080[/bold]"
)
def video(
    run_dir: Annotated[Path, typer.Argument(help="A run folder.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="A .gif, or an .mp4 (extra video); else video.gif in the folder.")
    ] = None,
    speed: Annotated[
        float | None, typer.Option(help="Seconds of the run in one of the video, else so that it takes half a minute.")
    ] = None,
    fps: Annotated[int, typer.Option(min=1, max=50, help="Frames per second.")] = 20,
    size: Annotated[int, typer.Option(min=200, max=2160, help="Longer side of the picture, pixels.")] = 800,
    scans: Annotated[bool, typer.Option(help="Draw scans and safe directions.")] = True,
    close: Close = False,
) -> None:
    """Make a video of a run folder: robots, their ways, scans, safe directions and packets."""
    from swarmscope.cli.video import video_command
    from swarmscope.viewing.video.write import Film

    video_command(run_dir, out, Film(speed, fps, size, scans, close))


@app.command(
    epilog="Examples:\n\n"
    "[bold]swarmscope barn the-barn-challenge/jackal_helper/worlds/BARN --every 10[/bold]\n\n"
    "[bold]swarmscope barn BARN_dataset --planner nav-scope --planner mine.py --speed 1 --speed 2[/bold]\n\n"
    "[bold]swarmscope barn BARN_dataset --set safety.look_ahead_m=2 --worlds 0-49 --out barn.json[/bold]\n\n"
    "[bold]swarmscope barn BARN_dataset --worlds 36 --runs runs/barn[/bold]\n\n"
    "[bold]swarmscope barn BARN_dataset --write-scenario 36 w36.yaml; swarmscope run w36.yaml[/bold]"
)
def barn(
    worlds_of: Annotated[
        Path,
        typer.Argument(metavar="FOLDER_OR_NPZ", help="Worlds of the challenge: world_N.world, path_N.npy; or a .npz."),
    ],
    planner: Annotated[list[str] | None, typer.Option(help="Planner or FILE.py, else nav-scope; repeatable.")] = None,
    speed: Annotated[list[float] | None, typer.Option(help="Highest speed, m/s, else 2; repeatable.")] = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY.PATH=VALUE", help="Any key of a scenario; repeatable.")
    ] = None,
    worlds: Annotated[str | None, typer.Option(help="Numbers and ranges: 0,4,10-19; else all.")] = None,
    every: Annotated[int, typer.Option(min=1, help="Only every Nth world.")] = 1,
    workers: Workers = None,
    out: Annotated[Path | None, typer.Option(help="JSON file with every run.")] = None,
    runs: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Keep each run there, with its picture and its replay page.")
    ] = None,
    write_scenario: Annotated[
        tuple[int, Path] | None,
        typer.Option(metavar="WORLD FILE", help="Write the scenario of one world for 'swarmscope run', run nothing."),
    ] = None,
    no_code: NoCode = False,
) -> None:
    """Drive through the worlds of the BARN challenge: arrivals, scores, times, planners compared (docs/barn.md)."""
    from swarmscope.cli.barn import barn_command, write_command

    planners, speeds, changes = planner or ["nav-scope"], speed or [2.0], set_ or []
    if write_scenario is not None:
        write_command(worlds_of, *write_scenario, planners, speeds, changes)
    else:
        barn_command(worlds_of, planners, speeds, changes, worlds, every, workers, out, runs, not no_code)


@app.command(
    epilog="Examples:\n\n"
    "[bold]swarmscope storm --minutes 10 --seed 3[/bold]\n\n"
    "[bold]swarmscope storm --minutes 600 --seed 4 --into storms.json[/bold]\n\n"
    "[bold]swarmscope storm --runs 200 --planner mine.py[/bold]\n\n"
    "[bold]swarmscope storm --replay 3:117[/bold]\n\n"
    "[bold]swarmscope storm --replay runs/storm/breach-3-117.yaml[/bold]"
)
def storm(
    minutes: Annotated[
        float | None, typer.Option(min=0.0, max=1e6, help="No run begins later; else 1 without --runs.")
    ] = None,
    runs: Annotated[int | None, typer.Option(min=1, help="Not more runs than these.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of everything that is drawn, with the number of a run.")] = 0,
    into: Annotated[Path | None, typer.Option(help="JSON file that adds storms up; its runs are skipped.")] = None,
    workers: Workers = None,
    planner: Annotated[
        list[str] | None, typer.Option(help="Planner or FILE.py, else all without training; repeatable.")
    ] = None,
    covered: Annotated[
        bool, typer.Option("--covered", help="Leave out sensors that say free where something stands.")
    ] = False,
    replay: Annotated[
        str | None, typer.Option(metavar="SEED:NUMBER or FILE", help="Play this one run instead, or a breach's file.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for breaches made small.")] = Path("runs/storm"),
    no_code: NoCode = False,
) -> None:
    """Look for contacts in random hostile runs; what none proves is a bound (docs/storms.md)."""
    from swarmscope.cli.storm import replay_command, storm_command
    from swarmscope.storm.play import Storm
    from swarmscope.storm.runs import Until

    which = Storm(seed, planner or [], covered)
    if replay is not None:
        replay_command(replay, which, out, not no_code)
    else:
        until = Until(1.0 if minutes is None and runs is None else minutes, runs)
        storm_command(which, until, into, workers, out, not no_code)


@new.command("task", epilog="Example: [bold]swarmscope new task ring[/bold]")
def new_task(name: OwnName) -> None:
    """Write a task of your own to begin with, and a test for it."""
    from swarmscope.cli.new import new_command

    new_command("task", name)


@new.command("planner", epilog="Example: [bold]swarmscope new planner mine[/bold]")
def new_planner(name: OwnName) -> None:
    """Write a planner of your own to begin with, and a test for it."""
    from swarmscope.cli.new import new_command

    new_command("planner", name)


@app.command(epilog="Example: [bold]swarmscope planners[/bold]")
def planners() -> None:
    """List the planners, what each is given, and its parameters."""
    from swarmscope.cli.lists import list_planners

    list_planners()


@app.command(epilog="Example: [bold]swarmscope tasks[/bold]")
def tasks() -> None:
    """List the tasks."""
    from swarmscope.cli.lists import list_tasks

    list_tasks()


@app.command(
    epilog="Examples:\n\n"
    "[bold]swarmscope reproduce nav-scope --maps 20[/bold]\n\n"
    "[bold]swarmscope reproduce sfm-mas --preset printed[/bold]\n\n"
    "[bold]swarmscope reproduce giwt --maps 20[/bold]\n\n"
    "[bold]swarmscope reproduce nav-scope --engine ray --address auto[/bold]"
)
def reproduce(
    name: Annotated[str, typer.Argument(help="nav-scope, ablations, sfm-mas, giwt, atlas, telescopes or others.")],
    maps: Maps = None,
    engine: EngineName = "local",
    workers: Workers = None,
    address: Address = None,
    store: StorePath = None,
    out: ReportOut = None,
    no_code: NoCode = False,
    preset: PresetName = None,
) -> None:
    """Run a published experiment, as far as it is not done yet, and write its report."""
    from swarmscope.cli.experiment import reproduce_command

    reproduce_command(name, maps, engine, workers, address, store, out, not no_code, preset)


@experiments.command(
    "run",
    epilog="Examples:\n\n"
    "[bold]swarmscope experiment run doors.yaml --maps 20[/bold]\n\n"
    "[bold]swarmscope experiment run doors.yaml --engine ray --address 10.0.0.1:6379[/bold]",
)
def experiment_run(
    file: ExperimentFile,
    maps: Maps = None,
    engine: EngineName = "local",
    workers: Workers = None,
    address: Address = None,
    store: StorePath = None,
    out: ReportOut = None,
    no_code: NoCode = False,
    preset: PresetName = None,
) -> None:
    """Run what is not in the store yet, then write the report. May be stopped at any moment."""
    from swarmscope.cli.experiment import run_command

    run_command(file, maps, engine, workers, address, store, out, resume=False, code=not no_code, preset=preset)


@experiments.command("resume", epilog="Example: [bold]swarmscope experiment resume doors.yaml[/bold]")
def experiment_resume(
    file: ExperimentFile,
    maps: Maps = None,
    engine: EngineName = "local",
    workers: Workers = None,
    address: Address = None,
    store: StorePath = None,
    out: ReportOut = None,
    no_code: NoCode = False,
    preset: PresetName = None,
) -> None:
    """Go on with a run that was stopped, and try again what failed."""
    from swarmscope.cli.experiment import run_command

    run_command(file, maps, engine, workers, address, store, out, resume=True, code=not no_code, preset=preset)


@experiments.command("status", epilog="Example: [bold]swarmscope experiment status nav-scope[/bold]")
def experiment_status(
    file: ExperimentFile, maps: Maps = None, store: StorePath = None, preset: PresetName = None
) -> None:
    """Show how many runs are done, failed and missing."""
    from swarmscope.cli.experiment import status_command

    status_command(file, maps, store, preset)


@experiments.command("report", epilog="Example: [bold]swarmscope experiment report nav-scope --out report[/bold]")
def experiment_report(
    file: ExperimentFile,
    maps: Maps = None,
    store: StorePath = None,
    out: ReportOut = None,
    no_code: NoCode = False,
    preset: PresetName = None,
) -> None:
    """Write the report of the runs that are done."""
    from swarmscope.cli.experiment import report_command

    report_command(file, maps, store, out, not no_code, preset)


@experiments.command("export", epilog="Example: [bold]swarmscope experiment export nav-scope results.csv[/bold]")
def experiment_export(
    file: ExperimentFile,
    csv: Annotated[Path, typer.Argument(help="CSV file to write.")],
    store: StorePath = None,
    preset: PresetName = None,
) -> None:
    """Write the results as CSV, one row per run, one column per figure."""
    from swarmscope.cli.experiment import export_command

    export_command(file, csv, store, preset)


@disk.command(
    "run",
    epilog="Examples:\n\n"
    "[bold]swarmscope disk run reactive --map minima --permutation 0,1,2,4,3[/bold]\n\n"
    "[bold]swarmscope disk run report reactive planned --map minima --permutation 0,1,2,4,3[/bold]\n\n"
    "[bold]swarmscope disk run mine.py --map random:7 --robots 20[/bold]",
)
def disk_run(
    controller: Controllers = None,
    map_: DiskMap = "c0",
    permutation: Permutation = None,
    robots: Annotated[int | None, typer.Option(min=1, max=200, help="Number of robots, else 5.")] = None,
    radius: Annotated[
        float | None, typer.Option(help="Their radius; by default they cover as much as 5 of 0.05.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder, else runs/disk/<map>-<permutation>.")] = None,
    call_limit: CallLimit = 10.0,
) -> None:
    """Play one run with one or several controllers; pictures and a replay page."""
    from swarmscope.cli.disk import run_command

    run_command(controller or ["reactive"], map_, permutation, robots, radius, out, call_limit)


@disk.command(
    "table",
    epilog="Examples:\n\n"
    "[bold]swarmscope disk table report report:obstacle_buffer=0.005[/bold]\n\n"
    "[bold]swarmscope disk table report reactive planned mine.py[/bold]\n\n"
    "[bold]swarmscope disk table mine.py --map minima --permutation 01243 --permutation 43210[/bold]",
)
def disk_table(
    controller: Controllers = None,
    map_: Annotated[list[str] | None, typer.Option("--map", help="Map; repeatable. Else the five.")] = None,
    permutation: Annotated[list[str] | None, typer.Option(help="Permutation; repeatable. Else all 120.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of page, figures and runs.")] = Path("runs/disk/table"),
    workers: Workers = None,
    call_limit: CallLimit = 10.0,
) -> None:
    """Play all 600 runs and print the report's Table 1 beside ours and the bound."""
    from swarmscope.cli.disk import table_command

    table_command(controller or ["report"], map_ or [], permutation or [], out, workers, call_limit)


@disk.command(
    "random",
    epilog="Examples:\n\n"
    "[bold]swarmscope disk random reactive --robots 5 --robots 20 --maps 1000[/bold]\n\n"
    "[bold]swarmscope disk random report reactive --seeds disk-tuning --maps 50[/bold]",
)
def disk_random(
    controller: Controllers = None,
    robots: Annotated[list[int] | None, typer.Option(min=1, max=200, help="Number of robots; repeatable.")] = None,
    maps: Annotated[int | None, typer.Option(min=1, help="Only the first so many seeds.")] = None,
    seeds: Annotated[str, typer.Option(help="Set of seeds or range.")] = "disk-evaluation",
    out: Annotated[Path, typer.Option(help="Folder of page, figures and runs.")] = Path("runs/disk/random"),
    workers: Workers = None,
    call_limit: CallLimit = 10.0,
) -> None:
    """Play random maps with traps and narrow passages."""
    from swarmscope.cli.disk import random_command

    random_command(controller or ["reactive"], robots or [5], seeds, maps, out, workers, call_limit)


@disk.command(
    "field",
    epilog="Examples:\n\n"
    "[bold]swarmscope disk field report --map minima --alone[/bold]\n\n"
    "[bold]swarmscope disk field navigation-function --map crevice --robot 2[/bold]",
)
def disk_field(
    controller: Annotated[str, typer.Argument(help="Name, NAME:key=value,... or FILE.py.")],
    map_: DiskMap = "c0",
    permutation: Permutation = None,
    robot: Annotated[int, typer.Option(min=0, help="The robot that moves.")] = 0,
    alone: Annotated[
        bool, typer.Option("--alone", help="Without the others, which else stand at their starts.")
    ] = False,
    resolution: Annotated[int | None, typer.Option(min=5, max=401, help="Points along each side.")] = None,
    out: Annotated[Path | None, typer.Option(help="PNG file.")] = None,
    call_limit: CallLimit = 10.0,
) -> None:
    """Draw where a robot would go from anywhere, and where it would get stuck."""
    from swarmscope.cli.disk import field_command

    field_command(controller, map_, permutation, robot, alone, resolution, out, call_limit)


@disk.command("repulsion", epilog="Example: [bold]swarmscope disk repulsion report:obstacle_buffer=0.005[/bold]")
def disk_repulsion(
    controller: Annotated[str, typer.Argument(help="report, or report:key=value,...")] = "report",
    out: Annotated[Path, typer.Option(help="PNG file.")] = Path("runs/disk/repulsion.png"),
) -> None:
    """Draw how hard the report's controller pushes away from things."""
    from swarmscope.cli.disk import repulsion_command

    repulsion_command(controller, out)


@disk.command("start", epilog="Example: [bold]swarmscope disk start mine.py[/bold]")
def disk_start(file: Annotated[Path, typer.Argument(help="Python file to write.")]) -> None:
    """Write a controller of your own to begin with."""
    from swarmscope.cli.disk import start_command

    start_command(file)


@disk.command("list", epilog="Example: [bold]swarmscope disk list[/bold]")
def disk_list() -> None:
    """List controllers, what each knows and guarantees, and maps."""
    from swarmscope.cli.disk import list_command

    list_command()


@giwt.command(
    "data",
    epilog="Examples:\n\n"
    "[bold]swarmscope giwt data --samples 100000[/bold]\n\n"
    "[bold]swarmscope giwt data --set-of driven --samples 50000[/bold]\n\n"
    "[bold]swarmscope giwt data --check[/bold]",
)
def giwt_data(
    data: GiwtData = Path("runs/giwt/data"),
    set_of: GiwtSets = None,
    samples: Annotated[int, typer.Option(min=1, max=10**9, help="Of each set, at least.")] = 100_000,
    workers: Workers = None,
    check: Annotated[bool, typer.Option("--check", help="Only check every shard's checksum.")] = False,
) -> None:
    """Generate expert data, as far as it is not there yet. May be stopped at any moment."""
    from swarmscope.cli.giwt import data_command

    data_command(data, set_of or ["placed"], samples, workers, check)


@giwt.command(
    "train",
    epilog="Examples:\n\n"
    "[bold]swarmscope giwt train[/bold]\n\n"
    "[bold]swarmscope giwt train --set network=gat --init runs/giwt/cnn/best.safetensors[/bold]\n\n"
    "[bold]swarmscope giwt train full --data /mnt/giwt --out runs/giwt/full --set batch=512[/bold]\n\n"
    "[bold]swarmscope giwt train mine.yaml --out runs/giwt/mine[/bold]",
)
def giwt_train(
    config: Annotated[str, typer.Argument(help="tiny, cpu, full, or a YAML file.")] = "cpu",
    data: GiwtData = Path("runs/giwt/data"),
    out: Annotated[Path | None, typer.Option(help="Folder, else runs/giwt/<network>.")] = None,
    init: Annotated[
        Path | None, typer.Option(help="Checkpoint to begin from; of another network its encoder is taken over.")
    ] = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="A key of the configuration; repeatable.")
    ] = None,
) -> None:
    """Train a network. When stopped, the same command goes on after the last whole epoch."""
    from swarmscope.cli.giwt import train_command

    train_command(config, data, out, init, set_ or [])


@giwt.command(
    "eval",
    epilog="Examples:\n\n"
    "[bold]swarmscope giwt eval runs/giwt/giwt runs/giwt/gat runs/giwt/cnn --out runs/giwt/scores.json[/bold]\n\n"
    "[bold]swarmscope giwt eval runs/giwt/giwt --set-of driven --radius 2.5 --radius 5 --pictures runs/giwt[/bold]",
)
def giwt_eval(
    runs: Annotated[
        list[Path], typer.Argument(help="Run folders or checkpoints; the first is compared with the others.")
    ],
    data: GiwtData = Path("runs/giwt/data"),
    set_of: GiwtSets = None,
    split: Annotated[str, typer.Option(help="train, validation or test.")] = "test",
    radius: Annotated[
        list[float] | None,
        typer.Option(min=0.1, max=1000.0, help="Score robots that see only so far, m, too; repeatable."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="JSON file for all figures.")] = None,
    pictures: Annotated[Path | None, typer.Option(help="Folder for pictures of layers and of radii.")] = None,
) -> None:
    """Score trained networks on maps that no training saw."""
    from swarmscope.cli.giwt import eval_command

    eval_command(runs, data, set_of or ["placed"], split, radius or [], out, pictures)


@giwt.command("ceiling", epilog="Example: [bold]swarmscope giwt ceiling --set-of driven --view 2.5[/bold]")
def giwt_ceiling(
    data: GiwtData = Path("runs/giwt/data"),
    set_of: GiwtSets = None,
    view: Annotated[float, typer.Option(min=0.1, max=1000.0, help="Radius seen, metres.")] = 5.0,
) -> None:
    """Show how often the expert's sides differ between samples that look alike."""
    from swarmscope.cli.giwt import ceiling_command

    ceiling_command(data, set_of or ["placed"], view)


@giwt.command(
    "export",
    epilog="Example: [bold]swarmscope giwt export runs/giwt/giwt runs/giwt/model --scores runs/giwt/scores.json[/bold]",
)
def giwt_export(
    run: Annotated[Path, typer.Argument(help="Run folder or checkpoint.")],
    out: Annotated[Path, typer.Argument(help="Folder of the model.")],
    scores: Annotated[Path | None, typer.Option(help="JSON file of 'eval', kept in the model's card.")] = None,
) -> None:
    """Write the ONNX files that a robot runs, checked against PyTorch."""
    from swarmscope.cli.giwt import export_command

    export_command(run, out, scores)


@giwt.command(
    "decisions",
    epilog="Examples:\n\n"
    "[bold]swarmscope run --task GIWT_2 --planner giwt --seed 31003 --out runs/first[/bold]\n\n"
    "[bold]swarmscope giwt decisions runs/first[/bold]\n\n"
    "[bold]swarmscope giwt decisions runs/first --number 5 --number 10[/bold]",
)
def giwt_decisions(
    run_dir: Annotated[Path, typer.Argument(help="A run folder, of planner giwt or giwt-gat.")],
    number: Annotated[list[int] | None, typer.Option(help="Draw this choice; repeatable.")] = None,
    count: Annotated[
        int, typer.Option(min=1, max=12, help="Else draw so many: those that neighbours moved most.")
    ] = 4,
    out: Annotated[Path, typer.Option(help="PNG file.")] = Path("runs/giwt/decisions.png"),
    no_code: NoCode = False,
) -> None:
    """Play a run again and show how its network chose sides: outputs, and the attention to each neighbour."""
    from swarmscope.cli.giwt import decisions_command

    decisions_command(run_dir, number or [], count, out, not no_code)


def main() -> None:
    """Run the command line."""
    app(prog_name="swarmscope")

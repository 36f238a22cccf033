"""Writes docs/scenario.md from the models, the tasks and the planners: python docs/scenario.py"""

from __future__ import annotations

import ast
from collections.abc import Callable
from itertools import groupby
from pathlib import Path

import swarmscope
from swarmscope.onboard.percept import MAX_INBOX, MAX_OUTBOX
from swarmscope.onboard.planners import planner_names
from swarmscope.onboard.sharing.message import REQUEST_BYTES
from swarmscope.scenarios.keys import MUST, Key, obstacle_keys, planner_keys, robot_keys, scenario_keys, task_keys
from swarmscope.sim.state import QUEUE, Radio
from swarmscope.tasks import task_names

PAGE = Path(__file__).with_suffix(".md")
PACKAGE = Path(swarmscope.__file__).parent

HEAD = """# Every key of a scenario

*Made by `python docs/scenario.py` from the models in `src/swarmscope/scenarios/scenario.py`: change those instead.*

A scenario is one YAML file that describes one run completely. Only what differs from the defaults has to be written;
a run folder's `config.yaml` holds everything. Exactly one of `task`, `map` and `place` says where.

```sh
swarmscope config T1 > my.yaml                   # a complete scenario, every key with its meaning
swarmscope run my.yaml --set radio.loss=0.2      # any key of this page, over the file
swarmscope run my.yaml --set robot.1.radius_m=0.3 --set map.goals.0=[8,2]     # parts of lists by their numbers, from 0 on
swarmscope config --schema                       # the same as JSON schema, for editors
```

```python
swarmscope.simulate("T1", radio__loss=0.2, planner__params__w_i=0)      # the same keys, __ for the dot: robot__1__radius_m=0.3, too
```

A key that does not exist, or a value out of bounds, is an error that names the place and the nearest key.

`robot` may be a list with a data sheet for each robot, and obstacles have keys of their own: [below](#robots-that-differ-and-obstacles), with examples in [maps.md](maps.md).
"""

LISTS = """## Robots that differ, and obstacles

`robot` as a list holds the keys of `robot` for each robot, N = 0, 1, ..., all of them optional, and besides:
"""

OBSTACLES = """Each entry of `map.obstacles` and of `place.world.obstacles` names its `type`, {kinds}, and has the keys of that type:
"""

RADIO = """## What the radio does with packets

Everything that a robot sends goes through its one radio of `radio.bitrate_bps`: the *bandwidth limit* of a run.

- A packet of n bytes is on the air for 8 (n + {overhead}) / `radio.bitrate_bps` seconds: {overhead} bytes are the
  link's preamble, header and checksum. A request of 9 bytes takes {request:.1f} ms by default, 28 bytes of features
  {features:.1f} ms. All this time sender *and* receiver are occupied; other pairs are not.
- It begins when both are free. A packet that would have to wait longer than `max_wait_s` = {wait:g} s does not fit: it
  is dropped before it is sent, and counted in `packets_crowded_out` of `metrics.json`, not in `messages` and not in
  `bytes_sent`. The planner is not told; it can ask again after `planner.params.ask_every_s`.
- It arrives `radio.latency_s` after its end. A receiver holds {queue} packets that it has not taken yet; one more was
  sent in vain and is crowded out, too. In each tick a robot is handed at most {inbox} packets, oldest first, the others
  wait for the next tick; it sends at most {outbox}.
- Farther than `radio.range_m`, or to a robot that has collided: sent in vain, `packets_out_of_range`. Lost by chance
  (`radio.loss`): `packets_lost`.

`max_wait_s` and the {overhead} bytes are constants of the link (`sim/state.py: Radio`), no keys. `bandwidth_kbps` of
`metrics.json` is what was sent, not what could be. To see the limit at work: `swarmscope run --task T3 --set
radio.bitrate_bps=2000`. Code: `sim/radio.py`; packets byte by byte: [message.md](message.md).
"""

WRONG = """## What goes wrong

All of it is off by default, drawn from the seed, for each robot by itself, and the same for any number of threads. Each key has draws of its own: setting
one leaves those of the others alone.

- **Wheels** (`noise.odometry_*`). The robot measures its motion wrongly: speed and way scaled alike, the way with a random walk on top. It drives what it
  commands. Of what a robot is told, odometry moves its tracks of neighbours and its memory of places; goal and heading come from elsewhere, and it steadies them.
- **Compass.** `compass_deg` is drawn for every scan, `compass_bias_deg` once for each robot; they add up. They turn the goal, features that are sent and
  heard, and what neighbours see of the heading.
- **LiDAR.** In this order: error of the range, lost returns (`dropout`), beams that say the longest range (`stuck`), the blind sector (`blind_deg`), broken
  readings (`nan`). Broken readings can be told, and the robot bridges or blocks them; a stuck beam and a blind sector say *free*, and nobody can tell.
  Mutual positioning is a sensor of its own: neighbours in the blind sector are still listed.
- **Late scans** (`noise.scan_age_s` = T). Each scan is as the LiDAR would have seen it a random time below T before, from where the robot and all others were then; mutual
  positioning, odometry and compass are of now. The scan has a stamp: each robot turns it by its own odometry, errors included, into what is seen from where it is now. The guard's `latency_s` is T ([safety.md](safety.md)). `robot.sensor_delay_s`
  is another thing: by it planners keep wider margins; it makes no scan older.
- **Restarts.** From one tick to the next the robot brakes, stands for `faults.restart_s`, sends and hears nothing, and loses what was on the way to it.
  Then it runs like one that was just switched on: memory of planner, tracks and inbox empty, its clock at 0, its counter at 0, a new boot number ([message.md](message.md)). Its place stays, and who had arrived has arrived.
  While it is off, `trajectory.npz` shows it in the state *yield*, standing still.
- **Silence.** The radio alone fails: the robot drives on. Packets to it count as `packets_out_of_range`, those that were on the way as `packets_lost`.
- **Clocks.** A robot's clock jumps by `faults.clock_jump_s`; time steps stay right. On board jumps are taken out before anything reads the time (`onboard/perception/clock.py`): a clock that goes back, or five periods forward, in one
  tick has been set anew, and one period has passed. So a jump of less than that forward, or less than a period back, is the only one that counts. `Robot` brakes for one tick besides.

"""

FORMULAS = (
    ("P_a (9)", "how sure the own features are that left is right", "Return P_a (9)", "`planner.params.prior`"),
    ("f_ai (12)", "weight of a neighbour by its distance", "(Nav-SCOPE 12", "`planner.params.w_i`"),
    (
        "P_ni (14)",
        "how sure neighbour i's features are: a logistic of its two passable distances less twice the threshold w_n",
        "P_ni (Nav-SCOPE 14",
        "none; w_n (20) follows from `robot.*`; recorded in `run.trace.opinions` (`trajectory.npz`)",
    ),
    ("P_dir (15)", "own and neighbours' opinions fused: left from 0.5 upward", "Return P_dir", "`planner.params.w_i`"),
    (
        "wait rule (17)",
        "wait while the repulsion of a neighbour outweighs the propulsion",
        "whether (17) holds",
        "`planner.params.wait_s`, `planner.params.still_s`",
    ),
    ("radio's limit", "what happens with packets that do not fit", "Lose, refuse or queue a packet", "`radio.bitrate_bps`"),
)
"""Formula, what it says, words in the docstrings of its code, keys."""


def page() -> str:
    """Return the whole page."""
    link = Radio()
    radio = RADIO.format(
        overhead=link.overhead_bytes,
        wait=link.max_wait_s,
        queue=QUEUE,
        inbox=MAX_INBOX,
        outbox=MAX_OUTBOX,
        request=8e3 * (REQUEST_BYTES + link.overhead_bytes) / link.bitrate_bps,
        features=8e3 * (28 + link.overhead_bytes) / link.bitrate_bps,
    )
    parts = [HEAD, "## Keys\n", table(scenario_keys()), LISTS, table(robot_keys()), obstacles()]
    parts += [radio, WRONG + formulas()]
    parts += ["## Options of the tasks\n\nSet with `task.options.NAME`; what tasks are for: [tasks.md](tasks.md).\n"]
    parts += grouped(task_names(), task_keys)
    parts += ["## Parameters of the planners\n\nSet with `planner.params.NAME`; who: [planners.md](planners.md).\n"]
    parts += grouped(planner_names(), planner_keys)
    return "\n".join(parts)


def obstacles() -> str:
    """Return a table of the keys of all obstacles."""
    kinds = obstacle_keys()
    words = OBSTACLES.format(kinds=", ".join(f"`{kind}`" for kind in kinds))
    return f"{words}\n{table([key._replace(name=f'{kind}: {key.name}') for kind in kinds for key in kinds[kind]])}"


def table(keys: list[Key]) -> str:
    """Return a table of keys."""
    head = "| key | takes | default | unit | meaning |\n|---|---|---|---|---|\n"
    return head + "".join(
        f"| `{key.name}` | {key.takes} | {shown(key.default)} | {key.unit} | {key.meaning.replace('``', '`')} |\n"
        for key in keys
    )


def shown(default: object) -> str:
    """Return a default as YAML writes it."""
    if default == MUST:
        return f"*{MUST}*"
    if default in (None, [], {}):
        return "none"
    return f"`{str(default).lower() if isinstance(default, bool) else default}`"


def grouped(names: list[str], keys_of: Callable[[str], list[Key]]) -> list[str]:
    """Return a table for each set of members that can be set alike."""
    found = [(name, keys_of(name)) for name in names]
    order = sorted(found, key=lambda item: [other[1] for other in found].index(item[1]))
    parts = []
    for keys, alike in groupby(order, key=lambda item: item[1]):
        parts += [f"### {', '.join(name for name, _ in alike)}\n", table(keys) if keys else "Nothing can be set.\n"]
    return parts


def formulas() -> str:
    """Return where the formulas that people look for are computed, and which keys they heed."""
    places = functions()
    rows = ""
    for name, what, words, keys in FORMULAS:
        homes = [f"`{place}`" for place, text in places.items() if words in text]
        if not homes:
            raise SystemExit(f"docs/scenario.py: no function says '{words}' any more; where is {name}?")
        rows += f"| {name} | {what} | {', '.join(homes)} | {keys} |\n"
    head = "| | what it says | code | keys |\n|---|---|---|---|\n"
    return f"## From formulas to keys\n\nAll formulas: [theory.md](theory.md).\n\n{head}{rows}"


def functions() -> dict[str, str]:
    """Return the docstrings of the functions of robot and simulator by ``file: name``."""
    found = {}
    for file in sorted([*PACKAGE.glob("onboard/**/*.py"), *PACKAGE.glob("sim/*.py")]):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef):
                found[f"{file.relative_to(PACKAGE).as_posix()}: {node.name}"] = ast.get_docstring(node) or ""
    return found


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)

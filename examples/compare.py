"""Three planners in the same worlds, paired by seed: python examples/compare.py [SEEDS] [ROBOTS]"""

import sys

from swarmscope import simulate
from swarmscope.judging.statistics import bootstrap_mean, paired_difference

FIRST, *OTHERS = PLANNERS = ("nav-scope", "sfm-mas", "dh-bug")
seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
robots = int(sys.argv[2]) if len(sys.argv) > 2 else 15
runs = {name: [simulate("T1", planner=name, robots=robots, seed=seed) for seed in range(seeds)] for name in PLANNERS}

for figure in ("arrival_rate", "path_stretch", "duration_s", "bytes_sent"):
    values = {name: [run.metrics[figure] for run in runs[name]] for name in PLANNERS}
    print(figure)
    for name in PLANNERS:
        print(f"  {name:12} mean {bootstrap_mean(values[name]).estimate:10.4f}")
    for name in OTHERS:
        d = paired_difference(values[name], values[FIRST])
        print(f"  {name} - {FIRST}: {d.estimate:+.4f}, 95 % [{d.low:+.4f}, {d.high:+.4f}], p {d.p_value:.2f}")

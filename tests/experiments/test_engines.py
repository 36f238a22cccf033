"""Engines and campaigns: the same results everywhere, and nothing lost when somebody dies."""

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time

import pytest
import yaml
from small_experiment import RUNS, VALUES, small

from swarmscope.errors import ConfigError, MissingExtraError, SwarmscopeError, UnknownNameError
from swarmscope.experiments.campaign import keyed_units, run_missing, state_of
from swarmscope.experiments.engines import ENGINES, _retry, make_engine
from swarmscope.experiments.engines.local import Local
from swarmscope.experiments.store import Store
from swarmscope.experiments.work import make_job, work, world_key
from swarmscope.scenarios.to_kernels import complete

KEYS = [key for _, key in keyed_units(small())]


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    """The digests of all runs, made in this process, one after the other."""
    with Store(tmp_path_factory.mktemp("truth") / "s.sqlite") as store:
        state = run_missing(small(), store, make_engine("in-process"))
        assert len(state.done) == RUNS and not state.failed and not state.missing
        return store.digests(KEYS)


def children(pid):
    done = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True, check=False)
    return [int(word) for word in done.stdout.split()]


def test_local_processes_give_the_same_results(tmp_path, truth):
    seen = []
    with Store(tmp_path / "s.sqlite") as store:
        run_missing(small(), store, make_engine("local", workers=2), progress=lambda *n: seen.append(n))
        assert store.digests(KEYS) == truth
    assert seen[-1] == (RUNS, 0, RUNS) and [n[0] for n in seen] == list(range(1, RUNS + 1))


def test_done_runs_are_never_run_again(tmp_path, truth):
    with Store(tmp_path / "s.sqlite") as store:
        run_missing(small(), store, make_engine("in-process"), maps=1)
        assert store.count() == 6

        class Refuses:
            def answers(self, jobs):
                assert not list(jobs)
                return iter(())

        run_missing(small(), store, Refuses(), maps=1)
        assert len(state_of(small(), store).missing) == 24  # of 32 cells 8 are done, by 6 runs


def test_a_worker_that_is_killed_costs_nothing(tmp_path, truth):
    killed = []

    def kill_one(done, failed, total):
        if done == 3:
            worker = multiprocessing.active_children()[0]
            worker.kill()
            killed.append(worker.pid)

    with Store(tmp_path / "s.sqlite") as store:
        state = run_missing(small(), store, make_engine("local", workers=2), progress=kill_one)
        assert killed and not state.failed
        assert store.digests(KEYS) == truth


def write_experiment(folder, **changes):
    file = folder / "e.yaml"
    file.write_text(yaml.safe_dump(VALUES | {"figures": []} | changes))
    return file


HERE = ("--engine", "in-process")


def start(what, file, store, *more):
    command = [sys.executable, "-m", "swarmscope", "experiment", what, file, "--store", store, "--workers", "1", *more]
    return subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for(condition, seconds=600.0):  # where no kernels are on disk and the machine is busy, it takes minutes
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)


def count(path):
    if not path.exists():
        return 0
    with Store(path) as store:
        return store.count()


def test_kill_9_of_everything_loses_only_what_was_under_way(tmp_path, truth):
    file, path = write_experiment(tmp_path), tmp_path / "s.sqlite"
    process = start("run", file, path)
    wait_for(lambda: count(path) >= 5 or process.poll() is not None)
    workers = children(process.pid)
    process.kill()
    process.communicate()
    kept = count(path)
    assert 5 <= kept < RUNS
    wait_for(lambda: not any(os.path.exists(f"/proc/{w}") for w in workers), 20.0)  # nobody outlives the driver
    resumed = start("resume", file, path, *HERE)
    _, said = resumed.communicate(timeout=180)
    assert resumed.returncode == 0, said
    with Store(path) as store:
        assert store.digests(KEYS) == truth and store.check() == "ok"


def test_ctrl_c_says_how_to_go_on(tmp_path):
    # More runs than end before the signal, however late that comes on a busy machine.
    few = {"places": {"near": VALUES["places"]["near"]}, "planners": {"Nav-SCOPE": VALUES["planners"]["Nav-SCOPE"]}}
    file, path = write_experiment(tmp_path, seeds="1000-2999", sweeps=[], **few), tmp_path / "s.sqlite"
    # Where the tests run in the background of a shell, Ctrl-C is ignored, and a process would inherit that.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    process = start("run", file, path)
    signal.signal(signal.SIGINT, before)
    wait_for(lambda: count(path) >= 2 or process.poll() is not None)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=180)
    assert process.returncode == 130, said
    assert "finished runs are kept" in said and "Traceback" not in said
    assert count(path) >= 2


def test_two_processes_on_one_store(tmp_path, truth):
    file, path = write_experiment(tmp_path), tmp_path / "s.sqlite"
    both = [start("run", file, path, *HERE, "--out", tmp_path / f"report{k}") for k in range(2)]
    for process in both:
        _, said = process.communicate(timeout=180)
        assert process.returncode == 0, said
    with Store(path) as store:
        assert store.digests(KEYS) == truth and store.count() == RUNS and store.check() == "ok"


def test_a_run_that_fails_is_named_and_can_be_tried_again(tmp_path):
    crowded = {"crowd": {"task": {"name": "T1", "options": {"size_m": 5.0, "density": 9.0}}}}
    experiment = small(places=VALUES["places"] | crowded, seeds="1000")
    with Store(tmp_path / "s.sqlite") as store:
        state = run_missing(experiment, store, make_engine("in-process"))
        assert len(state.failed) == 3 and len(state.done) == 6
        assert "trees do not fit" in next(iter(state.failed.values()))
        again = run_missing(experiment, store, make_engine("in-process"), retry_failed=True)
        assert again.failed == state.failed


def test_a_job_that_kills_every_worker_is_given_up(monkeypatch):
    assert _retry.MOST_TRIES == 5
    monkeypatch.setattr(_retry, "MOST_TRIES", 2)  # each takes the start of a process
    bad = json.dumps({"key": "bad", "world": "w", "config": {"deadly": True}})
    good = one_job()
    answers = {json.loads(a)["key"]: json.loads(a) for a in Local(1, deadly_work).answers(iter([good, bad]))}
    assert "died, 2 times" in answers["bad"]["error"]
    assert answers[json.loads(good)["key"]].get("error") is None


def one_job():
    unit, key = keyed_units(small())[0]
    return make_job(key, world_key(unit.scenario), complete(unit.scenario), None)


def deadly_work(job):
    if json.loads(job)["config"].get("deadly"):
        os.kill(os.getpid(), signal.SIGKILL)
    return work(job)


def test_another_version_is_refused():
    job = json.loads(one_job()) | {"code": "other"}
    assert "another version" in json.loads(work(json.dumps(job)))["error"]


def test_references_of_an_earlier_run_change_nothing(truth):
    unit, key = keyed_units(small())[0]
    first = json.loads(work(one_job()))
    job = make_job(key, world_key(unit.scenario), complete(unit.scenario), first["references"])
    assert json.loads(work(job))["digest"] == first["digest"] == truth[key]


def test_engine_names(monkeypatch):
    assert ENGINES == ("in-process", "local", "ray")
    with pytest.raises(UnknownNameError, match="did you mean 'local'"):
        make_engine("locale")
    with pytest.raises(ConfigError, match="--engine ray only"):
        make_engine("local", address="auto")
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(MissingExtraError, match=r"swarmscope\[ray\]"):
        make_engine("ray")


def test_a_missing_library_is_noticed_before_anything_is_run(tmp_path, monkeypatch):
    from swarmscope.onboard.planning import orca

    monkeypatch.setattr(orca, "_local", threading.local())
    monkeypatch.setitem(sys.modules, "navground", None)
    monkeypatch.setitem(sys.modules, "navground.core", None)
    experiment = small(planners=VALUES["planners"] | {"ORCA": {"planner": {"name": "orca"}}})
    with Store(tmp_path / "s.sqlite") as store:
        with pytest.raises(MissingExtraError, match=r"swarmscope\[orca\]"):
            run_missing(experiment, store, make_engine("in-process"))
        assert store.count() == 0


@pytest.fixture
def cluster():
    """A real Ray cluster of two nodes on this machine."""
    pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    found = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    yield found
    found.shutdown()


def test_ray_gives_the_same_results_when_a_node_is_killed_in_the_middle(tmp_path, truth, cluster):
    node = cluster.add_node(num_cpus=1)
    removed = []

    def kill_node(done, failed, total):
        if done >= 4 and not removed:
            removed.append(node)
            killer = threading.Thread(target=lambda: cluster.remove_node(node, allow_graceful=False))
            killer.start()
            killer.join()

    with Store(tmp_path / "s.sqlite") as store:
        state = run_missing(small(), store, make_engine("ray", address=cluster.address), progress=kill_node)
        assert removed and not state.failed and not state.missing
        assert store.digests(KEYS) == truth


def test_no_cluster_there():
    pytest.importorskip("ray")
    with pytest.raises(SwarmscopeError, match=r"no Ray cluster at 127.0.0.1:1"):
        next(make_engine("ray", address="127.0.0.1:1").answers(iter([one_job()])))

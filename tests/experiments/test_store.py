import csv
import json
import resource
import sqlite3
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest
from small_experiment import small

from swarmscope.errors import InputFileError, SwarmscopeError
from swarmscope.experiments.campaign import keyed_units, state_of
from swarmscope.experiments.store import Store
from swarmscope.experiments.work import finished, make_job, work, world_key
from swarmscope.scenarios.to_kernels import complete


@pytest.fixture(scope="module")
def answers():
    """The first three units of the small experiment, really run."""
    found = []
    for unit, key in keyed_units(small())[:3]:
        config = complete(unit.scenario)
        found.append(finished(config, work(make_job(key, world_key(unit.scenario), config, None))))
    return found


def test_what_is_put_in_comes_out(tmp_path, answers):
    units = keyed_units(small())
    with Store(tmp_path / "a" / "s.sqlite") as store:
        store.enlist("small", units)
        for answer in answers:
            store.add(answer)
            store.add(answer)  # twice is once
        assert store.count() == 3
    with Store(tmp_path / "a" / "s.sqlite", create=False) as store:
        runs = list(store.runs(units))
        first = runs[0]
        assert (first.place, first.planner, first.seed, first.key) == ("near", "alone", 1000, units[0][1])
        assert first.config == answers[0].config
        assert first.figures["path_redundancy"] == answers[0].figures["path_redundancy"]
        assert np.array_equal(first.travelled_m, answers[0].robots["travelled_m"])
        assert store.digests([units[0][1]]) == {units[0][1]: answers[0].digest}
        assert store.references(answers[0].world)["shortest_m"] == answers[0].robots["shortest_m"]
        assert store.references("other") is None
        assert store.check() == "ok"
        assert store.provenance([units[0][1]])["numpy"] == {np.__version__}
        # the same experiment seen through another label is the same run
        assert {run.planner for run in runs} == {"alone", "Nav-SCOPE w_i=0"}


def test_export_and_plain_sql(tmp_path, answers):
    with Store(tmp_path / "s.sqlite") as store:
        store.enlist("small", keyed_units(small()))
        for answer in answers:
            store.add(answer)
        assert store.export("small", tmp_path / "x.csv") == 6
        with pytest.raises(SwarmscopeError, match=r"none/x\.csv: cannot be written"):
            store.export("small", tmp_path / "none" / "x.csv")
    rows = list(csv.DictReader((tmp_path / "x.csv").open()))
    assert {row["planner"] for row in rows} == {"alone", "Nav-SCOPE w_i=0"}
    assert float(rows[0]["spl"]) == answers[0].figures["spl"]
    plain = sqlite3.connect(tmp_path / "s.sqlite")
    (mean,) = plain.execute("SELECT avg(arrival_rate) FROM results WHERE planner = 'alone'").fetchone()
    assert mean == np.mean([a.figures["arrival_rate"] for a in answers])


def test_failures_are_kept_apart_and_forgotten_after_success(tmp_path, answers):
    bad = answers[0]._replace(error="no way", figures={}, robots={})
    with Store(tmp_path / "s.sqlite") as store:
        store.add(bad)
        assert store.failed([bad.key]) == {bad.key: "no way"}
        assert store.done([bad.key]) == set()
        store.add(answers[0])
        assert store.failed([bad.key]) == {} and store.done([bad.key]) == {bad.key}


def test_damaged_and_foreign_files_are_refused_and_left_as_they_are(tmp_path, answers):
    with pytest.raises(InputFileError, match="no such store"):
        Store(tmp_path / "none.sqlite", create=False)
    text = tmp_path / "text.sqlite"
    text.write_text("not a database at all, but long enough to be looked at" * 40)
    with pytest.raises(InputFileError, match="damaged or no store"):
        Store(text)
    assert text.read_text().startswith("not a database")
    other = tmp_path / "other.sqlite"
    plain = sqlite3.connect(other)
    plain.execute("CREATE TABLE mine (x)")
    plain.close()
    with pytest.raises(InputFileError, match="not a store of swarmscope"):
        Store(other)
    newer = tmp_path / "newer.sqlite"
    Store(newer).__exit__()
    plain = sqlite3.connect(newer)
    plain.execute("PRAGMA user_version=99")
    plain.close()
    with pytest.raises(InputFileError, match="newer swarmscope"):
        Store(newer)


def test_a_torn_store_says_so(tmp_path, answers):
    path = tmp_path / "s.sqlite"
    units = keyed_units(small())
    with Store(path) as store:
        for answer in answers:
            store.add(answer)
    whole = path.read_bytes()
    torn = whole[: len(whole) // 2]
    path.write_bytes(torn)
    with pytest.raises(InputFileError, match="damaged"), Store(path) as store:
        list(store.runs(units))
        store.add(answers[0])
    assert path.read_bytes() == torn


FILLER = """
import json, resource, sys
from pathlib import Path
from swarmscope.errors import SwarmscopeError
from swarmscope.experiments.store import Store
from swarmscope.experiments.work import Finished
result = Finished(**json.loads(Path(sys.argv[2]).read_text()))
with Store(Path(sys.argv[1])) as store:
    resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))
    try:
        for k in range(10_000):
            store.add(result._replace(key=str(k)))
    except SwarmscopeError as error:
        print(k, error)
"""


def test_a_full_disk_gives_a_message_and_keeps_what_is_there(tmp_path, answers):
    (tmp_path / "row.json").write_text(json.dumps(answers[0]._asdict()))
    done = subprocess.run(
        [sys.executable, "-c", FILLER, tmp_path / "s.sqlite", tmp_path / "row.json"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    count, _, message = done.stdout.partition(" ")
    assert int(count) > 10
    assert "s.sqlite: cannot write: the disk is full" in message and "kept" in message
    with Store(tmp_path / "s.sqlite") as store:
        assert store.count() == int(count)
        assert store.check() == "ok"
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] == resource.RLIM_INFINITY


def test_a_new_metric_gets_a_column(tmp_path, monkeypatch, answers):
    with Store(tmp_path / "s.sqlite") as store:
        store.add(answers[0])
    import swarmscope.experiments.store as module

    monkeypatch.setattr(module, "FIGURES", (*module.FIGURES, "stops"))
    with Store(tmp_path / "s.sqlite") as store:
        store.add(answers[1]._replace(figures=answers[1].figures | {"stops": 3.0}))
        runs = {run.key: run.figures["stops"] for run in store.runs(keyed_units(small()))}
    assert runs[answers[0].key] is None and runs[answers[1].key] == 3.0


def test_many_may_make_the_same_store_at_once(tmp_path):
    def opened(path):
        begin.wait(30.0)
        with Store(path) as store:
            return store.check()

    with ThreadPoolExecutor(6) as pool:
        for k in range(20):
            begin = Barrier(6)
            assert list(pool.map(opened, [tmp_path / f"{k}.sqlite"] * 6)) == ["ok"] * 6


def test_nowhere_to_write(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SwarmscopeError, match="file"):
        Store(tmp_path / "file" / "s.sqlite")


def test_damaged_rows_are_named_set_aside_and_run_again(tmp_path, answers):
    path = tmp_path / "s.sqlite"
    units = keyed_units(small())
    with Store(path) as store:
        for answer in answers:
            store.add(answer)
    keys = [answer.key for answer in answers]
    with sqlite3.connect(path) as opened:
        opened.execute("UPDATE runs SET robots = '{\"travelled_m\": [1' WHERE key = ?", (keys[0],))
        opened.execute("UPDATE runs SET spl = 'much' WHERE key = ?", (keys[1],))
        opened.execute("UPDATE worlds SET shortest = '[]'")
    opened.close()
    with Store(path, create=False) as store:
        state = state_of(small(), store)
        assert state.damaged == {keys[0]: "robots is no JSON", keys[1]: "spl is no number"}
        assert state.done == {keys[2]} and {key for _, key in state.missing} >= set(keys[:2])
        assert [run.key for run in store.runs(units)] == [key for _, key in units if key == keys[2]]
        assert store.references(answers[0].world) is None
        store.set_aside(state.damaged)
        assert state_of(small(), store).damaged == {}
        store.add(answers[0])
        assert store.done(keys) == {keys[0], keys[2]}
    with sqlite3.connect(path) as opened:
        assert dict(opened.execute("SELECT key, why FROM damaged")) == state.damaged
    opened.close()

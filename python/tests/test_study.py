"""Studies on threads, processes and other executors: the same rows, whatever happens to the workers."""

import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest
from conftest import MODELS

import linkwright

STUDIES = MODELS.parent / "studies"
SAMPLE = {"kind": "sample", "count": 60, "vary": {"k": {"from": 0.3, "to": 0.6}, "c": {"from": 0.3, "to": 0.6}}}


def study(**changes) -> linkwright.Study:
    return linkwright.Study({**SAMPLE, **changes}, linkwright.Model.from_file(MODELS / "impact-absorber.toml"))


@pytest.fixture(scope="module")
def expected() -> str:
    return study().run().text()


def pool(workers=2):
    return ProcessPoolExecutor(workers, mp_context=get_context("spawn"))


def test_rows_are_the_same_on_any_executor(expected):
    with pool() as processes, ThreadPoolExecutor(3) as threads:
        for executor in (2, pool, processes, threads):
            for chunk in (None, 7):
                assert study().run(executor, chunk=chunk).text() == expected


@pytest.mark.parametrize("name", ["absorber-indices", "absorber-sweep", "cantilever-pareto", "cantilever-tolerance", "truss-grid", "truss-starts"])
def test_every_kind_of_study(name):
    one = linkwright.Study.from_file(STUDIES / f"{name}.toml")
    here, there = one.run(), pickle.loads(pickle.dumps(one)).run(2)
    assert here.text() == there.text() and here.missing == 0
    assert here.conclusions == there.conclusions and here.conclusions
    assert all("<svg" in figure.svg for figure in here.figures.values())
    assert here.tables.keys() == there.tables.keys()


def test_the_file_is_that_of_the_command_and_is_continued(expected, tmp_path):
    file = tmp_path / "rows.jsonl"
    result = study().run(file=file, progress=lambda done, total: done >= 20, chunk=5)
    assert len(result) == 20 and result.missing == 40
    # A kill can leave a part of a line.
    file.write_bytes(file.read_bytes() + b'{"run":59,"val')
    seen = []
    done = study().run(file=file, progress=lambda done, total: seen.append((done, total)))
    assert done.text() == expected == file.read_text()
    assert seen[0][0] > 20 and seen[-1] == (60, 60)
    # Nothing is left to do.
    assert study().run(executor=lambda: pytest.fail("no run is missing"), file=file).text() == expected
    rows = [json.loads(line) for line in expected.splitlines()[1:]]
    assert done.table()["run"] == [row["run"] for row in rows]
    pytest.importorskip("pandas")
    assert list(done.to_pandas().index) == list(range(60))


def test_rows_of_another_study_and_a_file_in_use_are_rejected(tmp_path):
    file = tmp_path / "rows.jsonl"
    before = study(seed=2).run(file=file)
    with pytest.raises(linkwright.Error, match="rows of another study.*give another file"):
        study().run(file=file)
    assert file.read_text() == before.text()
    with pytest.raises(linkwright.DefinitionError, match="another study"):
        study().run(resume=before)

    def again(done, total):
        with pytest.raises(OSError, match="another process writes rows"):
            study(seed=3).run(file=tmp_path / "other.jsonl")

    study(seed=3).run(file=tmp_path / "other.jsonl", progress=again, chunk=30)
    text = file.read_text().replace("0.", "1.", 1)
    file.write_text(text)
    with pytest.raises(linkwright.Error, match="line 2.*damaged"):
        study(seed=2).run(file=file)
    with pytest.raises(OSError, match="no-such-folder"):
        study().run(file=tmp_path / "no-such-folder" / "rows.jsonl")


def kill_one(executor, started):
    """Kills a worker of a pool as soon as rows have come."""
    started.wait(60)
    os.kill(next(iter(executor._processes)), signal.SIGKILL)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals")
def test_a_killed_worker_loses_nothing(tmp_path):
    # More runs than there are open tasks.
    long = study(count=1000)
    made, started = [], threading.Event()

    def make():
        made.append(pool())
        if len(made) == 1:
            threading.Thread(target=kill_one, args=(made[0], started)).start()
        return made[-1]

    def progress(done, total):
        if done >= 5 and not started.is_set():
            started.set()
            time.sleep(0.5)  # the worker dies while tasks are open

    file = tmp_path / "rows.jsonl"
    assert long.run(make, file, chunk=1, progress=progress).text() == long.run().text() == file.read_text()
    assert len(made) >= 2


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals")
def test_an_executor_that_breaks_says_how_to_go_on():
    long = study(count=1000)
    executor, started = pool(), threading.Event()
    threading.Thread(target=kill_one, args=(executor, started)).start()
    with pytest.raises(linkwright.StudyError, match="resume=error.result") as raised:
        long.run(executor, chunk=1, progress=lambda done, total: (started.set(), time.sleep(0.5 if done == 1 else 0))[0])
    executor.shutdown()
    rows = raised.value.result
    assert 0 < len(rows) < 1000
    assert long.run(resume=rows).text() == long.run().text()


class Deadly(ThreadPoolExecutor):
    """A worker that dies of one run, as a cluster reports it."""

    def submit(self, task, texts, phase, runs, known):
        if 17 in runs:
            future = Future()
            future.set_exception(ConnectionError("the worker is gone"))
            return future
        return super().submit(task, texts, phase, runs, known)


def test_a_run_that_kills_its_worker_each_time_is_named():
    with Deadly(2) as executor, pytest.raises(linkwright.StudyError, match="run 17 has lost its worker 3 times") as raised:
        study().run(executor, chunk=10)
    assert 0 < len(raised.value.result) < 60


class Rubbish(ThreadPoolExecutor):
    """A task that fails, or returns the rows of another study."""

    def submit(self, task, *arguments):
        return super().submit(self.answer)

    def answer(self):
        raise ZeroDivisionError("in the task")


def test_exceptions_of_tasks_arrive_as_themselves():
    with Rubbish(2) as executor, pytest.raises(ZeroDivisionError, match="in the task") as raised:
        study().run(executor)
    assert any(entry.name == "answer" for entry in raised.traceback)


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"executor": 0}, "at least 1"),
        ({"executor": True}, "number of worker processes"),
        ({"executor": "dask"}, "executor.*got str"),
        ({"chunk": 0}, "from 1"),
    ],
)
def test_wrong_arguments(arguments, message):
    with pytest.raises(linkwright.DefinitionError, match=message):
        study().run(**arguments)


def test_mistakes_have_their_place():
    model = linkwright.Model.from_file(MODELS / "impact-absorber.toml")
    with pytest.raises(linkwright.ModelError, match="kk"):
        study(vary={"kk": {"from": 1.0, "to": 2.0}})
    with pytest.raises(linkwright.DefinitionError, match="Model"):
        linkwright.Study(SAMPLE, "impact-absorber.toml")
    with pytest.raises(linkwright.DefinitionError, match="dictionary"):
        linkwright.Study(3, model)
    with pytest.raises(linkwright.DefinitionError, match="no phase `limits`"):
        study(count=2).run().table("limits")
    with pytest.raises(linkwright.Error, match="runs are missing"):
        study().run(progress=lambda *_: True, chunk=1).conclusions  # noqa: B018


PROGRAM = """
import sys
sys.path.insert(0, {tests!r})
from test_study import study
if __name__ == "__main__":
    study(count=4000).run({executor}, {file!r}, progress=lambda done, total: print(done, flush=True))
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals")
@pytest.mark.parametrize("executor, kind", [(None, "SIGKILL"), (2, "SIGKILL"), (None, "SIGINT"), (2, "SIGINT")])
def test_a_study_that_is_ended_by_a_signal_goes_on(executor, kind, tmp_path):
    file, script = tmp_path / "rows.jsonl", tmp_path / "study.py"
    script.write_text(PROGRAM.format(tests=str(Path(__file__).parent), executor=executor, file=str(file)))
    child = subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    child.stdout.readline()
    child.send_signal(getattr(signal, kind))
    _, error = child.communicate(timeout=60)
    assert child.returncode != 0 and (kind == "SIGKILL" or "KeyboardInterrupt" in error), error
    kept = file.read_bytes().count(b"\n")
    assert kept > 1
    counts = []
    done = study(count=4000).run(file=file, progress=lambda done, total: counts.append(done))
    assert done.missing == 0 and counts[0] >= kept - 2
    assert done.text() == file.read_text()


def test_a_full_disk_keeps_rows(tmp_path):
    if sys.platform != "linux":
        pytest.skip("limits")
    file, script = tmp_path / "rows.jsonl", tmp_path / "study.py"
    script.write_text(PROGRAM.format(tests=str(Path(__file__).parent), executor=None, file=str(file)))
    line = f"trap '' XFSZ; ulimit -f 64; exec {sys.executable} {script}"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, timeout=120)
    assert done.returncode == 1 and "finished runs are kept" in done.stderr, done.stderr
    assert study(count=4000).run(file=file).missing == 0


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals")
def test_a_dask_cluster_of_worker_processes(expected):
    distributed = pytest.importorskip("distributed")
    settings = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "host": "127.0.0.1", "dashboard_address": None}
    with distributed.LocalCluster(**settings) as cluster, distributed.Client(cluster) as client:
        workers = list(client.run(os.getpid).values())

        def progress(done, total):
            if done >= 10 and workers:
                os.kill(workers.pop(), signal.SIGKILL)

        before = set(client.run(os.getpid).values())
        result = study().run(client.get_executor(pure=False), chunk=2, progress=progress)
        assert result.text() == expected
        client.wait_for_workers(2, timeout=60)
        assert set(client.run(os.getpid).values()) != before


def test_a_result_has_a_page_and_a_notebook_form(tmp_path):
    model = linkwright.Model.from_dict({"design": {"x": {"start": 1.0}}, "output": [{"name": "f", "value": "x^2"}]})
    study = linkwright.Study({"kind": "sample", "count": 8, "vary": {"x": {"from": 0, "to": 1}}}, model)
    result = study.run()
    page = result.report(tmp_path / "page.html")
    assert "<html" in page and (tmp_path / "page.html").read_text(encoding="utf-8") == page
    assert all(sentence[:20] in page for sentence in result.conclusions)
    assert "<svg" in result._repr_html_()
    part = study.run(progress=lambda done, total: True)
    assert part.missing and "missing" in part._repr_html_()

"""Interpreter lock, threads, processes, signals, panics."""

import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import absorber as py
import numpy as np
import pytest
from conftest import MODELS

import linkwright
from linkwright import _core

# A hang is the failure that these tests look for.
TIMEOUT = 60
TESTS = Path(__file__).parent


def run(program: str, *, after=None) -> subprocess.CompletedProcess:
    """Runs a program in another process; `after(process)` is called once it has written a line."""
    process = subprocess.Popen(
        [sys.executable, "-c", program], cwd=TESTS, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        first = process.stdout.readline() if after else ""
        if after:
            after(process)
        out, error = process.communicate(timeout=TIMEOUT)
    except BaseException:
        process.kill()
        process.communicate()
        raise
    return subprocess.CompletedProcess([], process.returncode, first + out, error)


def test_a_panic_is_a_runtime_error():
    with pytest.raises(RuntimeError, match="a bug of linkwright: on request"):
        _core.panic()


def test_the_lock_is_released_during_work():
    model = linkwright.Model.from_file(MODELS / "vehicle-suspension.toml")
    model.analyze()
    ticks, done = [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    begun = time.perf_counter()
    for _ in range(5):
        model.sensitivities()
    done.set()
    thread.join()
    longest = max(np.diff([begun, *ticks]))
    work = time.perf_counter() - begun
    # With the lock held, the other thread would wait for whole calls, a fifth of the time each.
    assert longest < work / 6, (longest, work)


def test_a_function_in_many_threads_at_once():
    """Runs whose analyses are Python functions, at the same time as runs of models, in more threads than cores."""
    model = linkwright.Model.from_file(MODELS / "impact-absorber-formula.toml")

    def one(k):
        problem = py.problem() if k % 2 else model
        return problem.optimize("slp").objective

    with ThreadPoolExecutor(8) as pool:
        futures = [pool.submit(one, k) for k in range(16)]
        found = [future.result(timeout=TIMEOUT) for future in futures]
    assert len(set(found[::2])) == 1 and len(set(found[1::2])) == 1


def test_exceptions_stay_in_their_thread():
    def f(b):
        if b[0] < 0:
            raise KeyError(threading.get_ident())
        return float(b[0])

    problem = linkwright.Problem({"x": 1.0}, ["f"], f, objective="f")

    def one(k):
        try:
            problem.analyze([-1.0 if k % 2 else 1.0])
        except KeyError as error:
            return error.args[0] == threading.get_ident()
        return k % 2 == 0

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(one, range(200)))


@pytest.mark.skipif(sys.platform == "win32", reason="there are no process groups")
@pytest.mark.parametrize("call", ["model.optimize()", "model.analyze_many([[1.0], [2.0], [3.0]])", "study.run()", "stop"])
def test_a_signal_ends_the_program_of_a_model(tmp_path, call):
    """Ctrl-C raises KeyboardInterrupt while the program computes, and the library still works; SIGTERM leaves no process behind."""
    (tmp_path / "hang.py").write_text(
        "import json, os, sys, time\nopen('id', 'w').write(f'{os.getpid()} ')\n"
        "for line in sys.stdin:\n    asked = json.loads(line)\n    time.sleep(1000 if os.path.exists('hang') else 0)\n"
        "    print(json.dumps({'id': asked['id'], 'responses': {'f': 1.0}}), flush=True)\n"
    )
    (tmp_path / "m.toml").write_text(
        f"version = 2\n[analysis]\nkind = 'program'\ncommand = [{sys.executable!r}, 'hang.py']\nderivatives = 'central'\nretries = 0\n"
        "[design.x]\nstart = 1.0\nlower = 0.0\nupper = 5.0\n[[output]]\nname = 'f'\nprogram = 'number'\n[objective]\nminimize = 'f'\n"
    )
    (tmp_path / "s.toml").write_text('version = 1\nmodel = "m.toml"\nkind = "grid"\n[vary.x]\nfrom = 0\nto = 2\npoints = 3\n')
    (tmp_path / "hang").touch()
    done = run(
        f"""
import linkwright, os
os.chdir({str(tmp_path)!r})
model = linkwright.Model.from_file("m.toml", allow_programs=True)
study = linkwright.Study.from_file("s.toml", allow_programs=True)
print("ready", flush=True)
try:
    {call if call != "stop" else "model.analyze()"}
except KeyboardInterrupt:
    os.remove("hang")
    print("interrupted", model.analyze()["f"])
""",
        after=lambda process: (
            wait_for(lambda: (tmp_path / "id").exists() and (tmp_path / "id").read_text().endswith(" ")),
            time.sleep(0.2),
            process.send_signal(signal.SIGTERM if call == "stop" else signal.SIGINT),
        ),
    )
    if call == "stop":
        assert done.returncode == -signal.SIGTERM
    else:
        assert done.stdout.splitlines()[-1] == "interrupted 1.0", done.stderr
    wait_for(lambda: not is_running(int((tmp_path / "id").read_text())))


def wait_for(condition):
    until = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.02)


def is_running(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_ctrl_c_ends_a_run():
    program = f"""
import linkwright, sys
model = linkwright.Model.from_file({str(MODELS / "vehicle-suspension.toml")!r})
shown = []
def show(cycle):
    print(cycle.cycle, flush=True)
try:
    while True:
        model.optimize({{"preset": "gcmma", "accuracy": 1e-12, "residual": 1e-12}}, show)
except KeyboardInterrupt:
    model.analyze()  # the library still works
    print("interrupted", flush=True)
"""

    begun = time.monotonic()
    done = run(program, after=lambda process: (time.sleep(0.3), process.send_signal(signal.SIGINT)))
    assert "interrupted" in done.stdout and done.returncode == 0, done.stderr
    assert time.monotonic() - begun < 30


def test_ctrl_c_reaches_a_function():
    program = """
import time, linkwright
def slow(b):
    print("called", flush=True)
    time.sleep(30)
    return float(b[0])
try:
    linkwright.Problem({"x": 1.0}, ["f"], slow, objective="f").optimize()
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    begun = time.monotonic()
    done = run(program, after=lambda process: (time.sleep(0.2), process.send_signal(signal.SIGINT)))
    assert "interrupted" in done.stdout and time.monotonic() - begun < 20, done.stderr


@pytest.mark.skipif(not hasattr(signal, "SIGKILL") or sys.platform == "darwin", reason="fork")
def test_a_forked_process_says_what_to_do():
    program = f"""
import multiprocessing, linkwright
model = linkwright.Model.from_file({str(MODELS / "impact-absorber-formula.toml")!r})
def child(queue):
    try:
        queue.put(model.analyze().objective)
    except RuntimeError as error:
        queue.put(str(error))
context = multiprocessing.get_context("fork")
def ask():
    queue = context.Queue()
    process = context.Process(target=child, args=(queue,))
    process.start()
    print(queue.get(timeout=20))
    process.join()
model.analyze_many([[1.0, 0.3, 0.85]] * 100)
ask()
"""
    done = run(program)
    assert done.returncode == 0 and "forkserver" in done.stdout, (done.stdout, done.stderr)


@pytest.mark.parametrize("method", ["forkserver", "spawn"])
def test_pools_of_processes_work(method):
    model = linkwright.Model.from_file(MODELS / "impact-absorber-formula.toml")
    expected = model.optimize("slp").objective
    context = multiprocessing.get_context(method)
    with ProcessPoolExecutor(2, mp_context=context) as pool:
        found = [pool.submit(model.optimize, "slp") for _ in range(4)]
        results = [future.result(timeout=TIMEOUT) for future in found]
        assert [r.objective for r in results] == [expected] * 4
        # An exception of the worker arrives with its own type.
        with pytest.raises(linkwright.DefinitionError, match="shape"):
            pool.submit(model.analyze, [1.0]).result(timeout=TIMEOUT)
        assert isinstance(pool.submit(failed).exception(timeout=TIMEOUT), linkwright.AnalysisError)


def failed():
    raise linkwright.AnalysisError("in the worker")


def test_differences_in_a_pool_of_processes():
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("forkserver")) as pool:
        here, there = py.problem(), py.problem(map=pool.map)
        np.testing.assert_array_equal(there.sensitivities()["displacement"], here.sensitivities()["displacement"])


def test_results_have_the_same_bits_for_any_number_of_threads():
    program = f"""
import linkwright
model = linkwright.Model.from_file({str(MODELS / "rigid-four-bar.toml")!r})
result = model.optimize({{"preset": "slp", "max_cycles": 3}})
print(result.design.tobytes().hex(), model.analyze_many([result.design] * 5).objective.tobytes().hex())
"""
    texts = {run(f"import os; os.environ['RAYON_NUM_THREADS'] = '{count}'" + program).stdout for count in (1, 4)}
    assert len(texts) == 1 and texts.pop().strip()


def test_models_pickle_small():
    model = linkwright.Model.from_file(MODELS / "four-bar.toml")
    assert len(pickle.dumps(model)) < 20_000


def test_an_interrupt_ends_the_slice_of_a_report():
    """Analyses of the slice are done by other threads; Ctrl-C reaches the first one only."""
    program = (
        "import linkwright, time\n"
        f"model = linkwright.Model.from_file({str(MODELS / 'slider-crank-flexible.toml')!r})\n"
        "result = model.optimize({'preset': 'slp', 'max_cycles': 1})\n"
        "print('ready', flush=True)\n"
        "begun = time.perf_counter()\n"
        "try:\n"
        "    result.report(slice=101)\n"
        "except KeyboardInterrupt:\n"
        "    print('interrupted', time.perf_counter() - begun)\n"
    )
    done = run(program, after=lambda process: (time.sleep(0.5), process.send_signal(signal.SIGINT)))
    assert "interrupted" in done.stdout, done.stderr
    assert float(done.stdout.split()[-1]) < 15.0

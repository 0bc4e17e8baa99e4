"""Cost of a call from Python. `python tests/test_overhead.py` prints the figures."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from conftest import MODELS

import linkwright


def least(task, repeats=9, count=100):
    """Least mean CPU time of a call in µs: other programs on the machine do not count."""
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        for _ in range(count):
            task()
        times.append((time.process_time() - begun) / count)
    return 1e6 * min(times)


def figures():
    """CPU times in µs of an analysis: called from Python, and as one of 1000 in a call, where the analyses are made by Rust alone.

    With one thread, since threads that wait for work also take CPU time.
    """
    model = linkwright.Model.from_file(MODELS / "impact-absorber-formula.toml")
    b = np.array([0.6, 0.5, 0.7])
    designs = np.tile(b, (1000, 1))
    one = least(lambda: model.analyze(b))
    many = least(lambda: model.analyze_many(designs), count=1) / 1000
    return {"one call": one, "one of 1000": many, "difference": one - many}


def throughput():
    """Analyses per second of wall time in one call with 1000 designs, with all threads."""
    model = linkwright.Model.from_file(MODELS / "impact-absorber-formula.toml")
    designs = np.tile([0.6, 0.5, 0.7], (1000, 1))
    times = []
    for _ in range(9):
        begun = time.perf_counter()
        model.analyze_many(designs)
        times.append(time.perf_counter() - begun)
    return 1000 / min(times)


def with_threads(count):
    """The output of this file in a process with this number of threads."""
    command = [sys.executable, Path(__file__).name]
    environment = {**os.environ, "RAYON_NUM_THREADS": str(count)}
    done = subprocess.run(command, cwd=Path(__file__).parent, env=environment, capture_output=True, text=True, check=True)
    return dict(line.rsplit(": ", 1) for line in done.stdout.splitlines())


def test_a_call_costs_less_than_20_microseconds_more_than_the_analysis():
    assert float(with_threads(1)["difference"]) < 20


if __name__ == "__main__":
    for name, value in figures().items():
        print(f"{name}: {value:.1f}")
    print(f"analyses per second: {throughput():.0f}")

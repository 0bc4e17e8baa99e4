"""Cost of a call from Python: `RAYON_NUM_THREADS=1 python benches/overhead.py`. Without the variable, the throughput of all cores."""

import time
from pathlib import Path

import numpy as np

import linkwright

MODEL = Path(__file__).parents[2] / "examples" / "models" / "impact-absorber-formula.toml"


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
    model = linkwright.Model.from_file(MODEL)
    b = np.array([0.6, 0.5, 0.7])
    designs = np.tile(b, (1000, 1))
    one = least(lambda: model.analyze(b))
    many = least(lambda: model.analyze_many(designs), count=1) / 1000
    return {"one call": one, "one of 1000": many, "difference": one - many}


def throughput():
    """Analyses per second of wall time in one call with 1000 designs, with all threads."""
    model = linkwright.Model.from_file(MODEL)
    designs = np.tile([0.6, 0.5, 0.7], (1000, 1))
    times = []
    for _ in range(9):
        begun = time.perf_counter()
        model.analyze_many(designs)
        times.append(time.perf_counter() - begun)
    return 1000 / min(times)


if __name__ == "__main__":
    for name, value in figures().items():
        print(f"{name}: {value:.1f}")
    print(f"analyses per second: {throughput():.0f}")

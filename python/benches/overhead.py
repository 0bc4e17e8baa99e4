"""Cost of calls from Python compared with that of the work in Rust: `python benches/overhead.py`.

1. One call of `analyze` compared with one analysis in Rust, as processor times with one thread. An analysis in Rust is one of 50 in a call of
   `analyze_many`, where Rust does them alone.
2. 1000 designs in one call compared with Rust on all cores: the same call without the Python part, `analyze_many` of the extension, and the
   elapsed time of one thread divided by that of all threads.

Each figure is the least of several repetitions that alternate with what they are compared with, since other programs on the machine
slow both down.
"""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import linkwright

MODELS = Path(__file__).parents[2] / "examples" / "models"
NAMES = ["impact-absorber-formula", "impact-absorber"]
DESIGNS = 1000
# Short blocks are often free of the disturbances that long ones always contain.
BLOCK = 50


def least(tasks, repeats, clock):
    """Least time of each task in s; the tasks alternate."""
    best = [float("inf")] * len(tasks)
    for _ in range(repeats):
        for k, task in enumerate(tasks):
            begun = clock()
            task()
            best[k] = min(best[k], clock() - begun)
    return best


def designs_of(model):
    """Designs around the middle between the start and the bounds."""
    middle = 0.5 * (model.start + np.clip(0.5 * model.start, model.lower, model.upper))
    return middle * np.linspace(0.98, 1.02, DESIGNS)[:, None]


def one_call(name):
    """CPU times in us of an analysis: by a call from Python, and as one of 50 in a call."""
    model = linkwright.Model.from_file(MODELS / f"{name}.toml")
    designs = designs_of(model)[:: DESIGNS // BLOCK]

    def calls():
        for b in designs:
            model.analyze(b)

    one, many = least([calls, lambda: model._core.analyze_many(designs)], 150, time.process_time)
    return [1e6 * t / BLOCK for t in (one, many)]


def many_designs(name):
    """Elapsed times in us for each of 1000 designs: by `analyze_many`, and by the extension without the Python part."""
    model = linkwright.Model.from_file(MODELS / f"{name}.toml")
    designs = designs_of(model)
    tasks = [lambda: model.analyze_many(designs), lambda: model._core.analyze_many(designs)]
    return [1e6 * t / DESIGNS for t in least(tasks, 25, time.perf_counter)]


def run(threads, part):
    """Figures of a part in a process of its own with so many threads; 0 for all cores."""
    environment = {k: v for k, v in os.environ.items() if k != "RAYON_NUM_THREADS"}
    if threads:
        environment["RAYON_NUM_THREADS"] = str(threads)
    shown = subprocess.run([sys.executable, __file__, *part], env=environment, capture_output=True, text=True, check=True)
    return [float(word) for word in shown.stdout.split()]


if __name__ == "__main__":
    if len(sys.argv) == 3:
        print(*{"one": one_call, "many": many_designs}[sys.argv[1]](sys.argv[2]))
        sys.exit()
    print(f"cores: {os.cpu_count()}")
    print(f"{'us per analysis':<28}{'Python':>8}{'Rust':>8}{'overhead':>10}{'1000 at once':>14}{'extension':>11}{'ratio':>7}{'speed-up':>10}")
    for name in NAMES:
        one, rust = run(1, ["one", name])
        all_cores, extension = run(0, ["many", name])
        single = run(1, ["many", name])[0]
        print(
            f"{name:<28}{one:>8.1f}{rust:>8.1f}{one - rust:>10.1f}{all_cores:>14.2f}{extension:>11.2f}"
            f"{all_cores / extension:>7.2f}{single / all_cores:>10.2f}"
        )

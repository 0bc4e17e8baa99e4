"""A simulator for `oscillator.toml`: a mass that hits a spring and a damper at 1 m/s.

One request for each line of the standard input, one answer for each line of the standard output.
"""

import json
import os
import sys

# What a library prints goes to the standard error, so that it is not taken for an answer.
answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)


def simulate(stiffness, damping, times):
    """Displacement and acceleration of a unit mass at the time points, by classical Runge-Kutta steps of 1 ms."""

    def rates(x, v):
        return v, -stiffness * x - damping * v

    t, x, v = 0.0, 0.0, 1.0
    displacement, acceleration = [], []
    for wanted in times:
        steps = max(1, round((wanted - t) / 1e-3)) if wanted > t else 0
        h = (wanted - t) / steps if steps else 0.0
        for _ in range(steps):
            k1 = rates(x, v)
            k2 = rates(x + h / 2 * k1[0], v + h / 2 * k1[1])
            k3 = rates(x + h / 2 * k2[0], v + h / 2 * k2[1])
            k4 = rates(x + h * k3[0], v + h * k3[1])
            x += h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
            v += h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
        t = wanted
        displacement.append(x)
        acceleration.append(rates(x, v)[1])
    return displacement, acceleration


for line in sys.stdin:
    request = json.loads(line)
    try:
        design = request["design"]
        x, a = simulate(design["k"], design["c"], request["times"])
        answer = {"responses": {"displacement": x, "acceleration": a}}
        text = json.dumps({"id": request["id"], **answer}, allow_nan=False)
    except (ArithmeticError, ValueError) as why:
        text = json.dumps({"id": request["id"], "error": str(why)})
    print(text, file=answers, flush=True)

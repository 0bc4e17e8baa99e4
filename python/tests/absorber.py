"""The impact absorber in closed form, in Python: m y'' + c y' + k y = 0 with m = 1 kg, y(0) = 0, y'(0) = 1 m/s.

In a module of its own, so that other processes can import it.
"""

import numpy as np

import linkwright

TIME = np.linspace(0.0, 12.0, 101)


def motion(k, c, t):
    """Displacement in m, for c² < 4 k: y = exp(−c t/2) sin(w t)/w with w² = k − c²/4."""
    w = np.sqrt(k - c * c / 4 + 0j)
    return (np.exp(-c * t / 2) * np.sin(w * t) / w).real


def analyze(b):
    """Displacement and acceleration: y'' = −c y' − k y with the velocity y' from the formula."""
    k, c = b
    w = np.sqrt(k - c * c / 4 + 0j)
    y = motion(k, c, TIME)
    v = (np.exp(-c * TIME / 2) * (np.cos(w * TIME) - c / (2 * w) * np.sin(w * TIME))).real
    return {"displacement": y, "acceleration": -c * v - k * y}


def problem(**more):
    """The problem of the paper: the least peak acceleration with at most 1 m of travel."""
    arguments = dict(
        variables={
            "k": {"start": 1.0, "lower": 1e-6, "upper": 1.0, "unit": "N/m"},
            "c": {"start": 0.3, "lower": 1e-6, "upper": 1.0, "unit": "N·s/m"},
        },
        responses={"displacement": {"unit": "m"}, "acceleration": {"unit": "m/s²"}},
        analyze=analyze,
        objective={
            "minimize": "acceleration",
            "over": "peak",
            "bound": {"name": "peak", "start": 0.85, "lower": 0.0, "unit": "m/s²"},
        },
        constraints={"travel": {"value": "displacement", "at_most": 1.0}},
        time=TIME,
        name="absorber in Python",
        method="slp",
    )
    return linkwright.Problem(**(arguments | more))

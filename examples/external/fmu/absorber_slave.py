"""The impact absorber as a co-simulation FMU: m a + c v + k y = 0 with m = 1 kg, by the classical Runge-Kutta method."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Absorber(Fmi2Slave):
    """Parameters k in N/m and c in N·s/m; outputs displacement in m and acceleration in m/s²."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.k, self.c = 1.0, 0.3
        self.displacement, self.velocity = 0.0, 1.0
        for name in ("k", "c"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        for name in ("displacement", "acceleration"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    @property
    def acceleration(self):
        return self._acceleration(self.displacement, self.velocity)

    def _acceleration(self, y, v):
        return -self.c * v - self.k * y

    def do_step(self, current_time, step_size):
        h, y, v = step_size, self.displacement, self.velocity
        slopes = [(v, self._acceleration(y, v))]
        for part in (h / 2, h / 2, h):
            dy, dv = slopes[-1]
            slopes.append((v + part * dv, self._acceleration(y + part * dy, v + part * dv)))
        (a, b, c, d) = slopes
        self.displacement, self.velocity = (
            x + h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]) for i, x in enumerate((y, v))
        )
        return True

"""Independent reference values of the benchmark page of mechanics, as rows of references.csv.

Closed forms by mpmath; motions by SciPy's DOP853 at a tolerance of 1e-13 on equations derived by hand. Bars are in natural coordinates
(their end points), linkwright uses centres and angles. Derivatives are by a complex step through the whole integration. Usage:
python references.py > ../../../examples/models/benchmarks/references.csv
"""

import csv
import sys

import mpmath as mp
import numpy as np
from scipy.integrate import solve_ivp

mp.mp.dps = 30
G = 9.81
STEP = 1e-30  # of complex differences
ROWS = []
# Printed by `exudyn_mechanics.py spin-up`.
EXUDYN_SPIN_UP = [("across", -0.5590749028024651), ("along", -0.017741121679369698)]


# Allowed differences of numbers and of their derivatives, relative to the larger of 1 and the number, or to the derivative.
LIMITS = {
    "a01": (1e-10, 0), "a02": (1e-5, 0), "andrews": (1e-9, 0), "car-axis": (1e-9, 1e-8), "five-bar": (1e-11, 1e-10),
    "double-pendulum": (5e-11, 0), "planetary-train": (1e-12, 1e-11), "rack": (1e-11, 1e-9), "half-car": (1e-12, 1e-11),
    "offset-slider-crank": (1e-12, 1e-12), "spinning-beam": (1e-6, 0), "roll-up": (1.1e-3, 0), "elastica": (2e-5, 0),
    "follower-force": (6e-5, 0), "bouncing-balls": (1e-12, 1e-11), "compliant-ball": (1e-9, 1e-4), "belt": (1e-10, 5e-9),
}  # fmt: skip


def row(model, output, time, value, source, by="", change=""):
    value, limits = float(value), LIMITS[model.removeprefix("benchmarks/")]
    limit = limits[1] * abs(value) if by else limits[0] * max(1.0, abs(value))
    ROWS.append([model, change, output, repr(float(time)), by, repr(value), f"{limit:.1e}", source])


def integrate(rhs, start, end, tolerance=1e-13):
    """State at `end`. Complex where the start is."""
    found = solve_ivp(rhs, (0, end), start, method="DOP853", rtol=tolerance, atol=tolerance)
    assert found.success, found.message
    return found.y[:, -1]


def slopes(function, values):
    """Derivatives of a vector function with respect to each of its real arguments, by complex steps."""
    return [np.imag(function(*[v + 1j * STEP * (k == i) for k, v in enumerate(values)])) / STEP for i in range(len(values))]


def bars(points, fixed, rods, springs):
    """Points as coordinates, slender rods as distances with mass, springs between points and places.

    `rods` are (i, j, mass, length), `springs` (i, place, stiffness, unloaded). Returns the derivative of positions and velocities.
    """
    free = [i for i in range(len(points)) if i not in fixed]
    index = {i: 2 * k for k, i in enumerate(free)}
    n = 2 * len(free)
    mass = np.zeros((n, n))
    weight = np.zeros(n)
    for i, j, m, _ in rods:
        for a, b in ((i, j), (j, i)):
            if a in index:
                mass[index[a], index[a]] += m / 3
                mass[index[a] + 1, index[a] + 1] += m / 3
                weight[index[a] + 1] -= m * G / 2
                if b in index:
                    mass[index[a], index[b]] += m / 6
                    mass[index[a] + 1, index[b] + 1] += m / 6

    def rhs(_, y):
        q, v = y[:n], y[n:]
        at = lambda i: q[index[i] : index[i] + 2] if i in index else np.array(points[i], float)
        speed = lambda i: v[index[i] : index[i] + 2] if i in index else np.zeros(2)
        jacobian = np.zeros((len(rods), n), dtype=y.dtype)
        gamma = np.zeros(len(rods), dtype=y.dtype)
        for k, (i, j, _, _) in enumerate(rods):
            d, w = at(j) - at(i), speed(j) - speed(i)
            if i in index:
                jacobian[k, index[i] : index[i] + 2] -= d
            if j in index:
                jacobian[k, index[j] : index[j] + 2] += d
            gamma[k] = -(w @ w)
        force = weight.astype(y.dtype)
        for i, place, stiffness, unloaded in springs:
            d = at(i) - np.array(place)
            length = np.sqrt(d @ d)
            force[index[i] : index[i] + 2] -= stiffness * (length - unloaded) * d / length
        zero = np.zeros((len(rods),) * 2)
        system = np.block([[mass, jacobian.T], [jacobian, zero]])
        return np.concatenate([v, np.linalg.solve(system, np.concatenate([force, gamma]))[:n]])

    start = np.concatenate([np.ravel([points[i] for i in free]), np.zeros(n)])
    return rhs, start


def pendulum(inertia, moment, speed, time):
    """Angle of a body that starts upright with angular velocity −speed: I θ'' = −moment·cos θ."""
    f = lambda _, y: np.array([y[1], -moment / inertia * np.cos(y[0])])
    return integrate(f, np.array([np.pi / 2, -speed]), time)[0]


def a01():
    # Released from the horizontal: sin(φ/2) = k sn(K(k) − ω t), φ from the lowest position, k = sin(π/4).
    omega = mp.sqrt(mp.mpf("9.81"))
    m = mp.mpf(1) / 2
    for time in (5, 10):
        phi = 2 * mp.asin(mp.sqrt(m) * mp.ellipfun("sn", mp.ellipk(m) - omega * time, m=m))
        # φ is positive where the bob starts: at x = −1.
        row("benchmarks/a01", "x", time, -mp.sin(phi), "elliptic functions (mpmath)")
        row("benchmarks/a01", "y", time, -mp.cos(phi), "elliptic functions (mpmath)")
    row("benchmarks/a01", "energy", 10, 0, "conserved")


def a02():
    for n in (40, 20, 10, 5, 2, 1):
        angle = pendulum((n + 1) / 3 + n, G * ((n + 1) / 2 + n), 1.0, 10)
        energy = ((n + 1) / 3 + n) / 2 + G * ((n + 1) / 2 + n)
        change = f'..40" => ..{n}"' if n < 40 else ""
        row("benchmarks/a02", "angle", 10, angle, "one degree of freedom, DOP853", change=change)
        row("benchmarks/a02", "energy", 10, energy, "conserved", change=change)


def andrews():
    change = "step = 1e-4 => scheme = \"rk8\"\\ntolerance = 1e-12"
    source = "IVP test set (PSIDE, 1e-14)"
    for name, value in [
        ("crank", 0.1581077119629904e2), ("second", -0.1575637105984298e2), ("third", 0.4082224013073101e-1),
        ("fourth", -0.5347301163226948), ("fifth", 0.5244099658805304), ("sixth", 0.5347301163226948),
        ("seventh", 0.1048080741042263e1),
    ]:
        row("andrews", name, 0.03, value, source, change=change)


def axle(gravity, amplitude, time, start=None):
    """The car axis, index reduced: positions and velocities of both ends."""
    dtype = complex
    mass = 10 * 1e-4 / 2

    def rhs(t, y):
        p, v = y[:4], y[4:]
        s, c = np.sin(10 * t), np.cos(10 * t)
        yb, yb1, yb2 = amplitude * s, 10 * amplitude * c, -100 * amplitude * s
        xb = np.sqrt(1 - yb * yb)
        xb1 = -yb * yb1 / xb
        xb2 = -(yb1 * yb1 + yb * yb2 + xb1 * xb1) / xb
        left, right = np.sqrt(p[0] ** 2 + p[1] ** 2), np.sqrt((p[2] - xb) ** 2 + (p[3] - yb) ** 2)
        force = np.array([
            (0.5 - left) * p[0] / left, (0.5 - left) * p[1] / left - mass * gravity,
            (0.5 - right) * (p[2] - xb) / right, (0.5 - right) * (p[3] - yb) / right - mass * gravity,
        ])
        d, w = p[:2] - p[2:], v[:2] - v[2:]
        jacobian = np.array([[xb, yb, 0, 0], [d[0], d[1], -d[0], -d[1]]])
        gamma = np.array([-(2 * (v[0] * xb1 + v[1] * yb1) + p[0] * xb2 + p[1] * yb2), -(w @ w)])
        system = np.block([[mass * np.eye(4), jacobian.T], [jacobian, np.zeros((2, 2))]])
        return np.concatenate([v, np.linalg.solve(system, np.concatenate([force, gamma]))[:4]])

    # Consistent velocities: the left end moves with the road if the amplitude changes: x_l = −½ dy_b/dt.
    first = -0.5 * 10 * amplitude
    return integrate(rhs, np.array([0, 0.5, 1, 0.5, first, 0, first, 0], dtype=dtype), time)


def car_axis():
    published = [
        0.493455784275402809122e-1, 0.496989460230171153861, 0.104174252488542151681e1, 0.373911027265361256927,
        -0.770583684040972357970e-1, 0.744686658723778553466e-2, 0.175568157537232222276e-1, 0.770341043779251976443,
    ]
    names = ["x_left", "y_left", "x_right", "y_right", "vx_left", "vy_left", "vx_right", "vy_right"]
    own = axle(1.0, 0.1, 3.0).real
    assert np.abs(own - published).max() < 1e-8, np.abs(own - published)
    for name, value in zip(names, published):
        row("benchmarks/car-axis", name, 3, value, "IVP test set (GAMD)")
    for by, gradient in zip(["gravity"], slopes(lambda g: axle(g, 0.1, 3.0), [1.0])):
        for k in (0, 1, 2, 3):
            row("benchmarks/car-axis", names[k], 3, gradient[k], "DOP853, complex step", by=by)


def double_pendulum():
    def tip(m):
        rhs, start = bars([(0, 0), (1, 0), (2, 0)], [0], [(0, 1, 1, 1), (1, 2, 1, 1)], [])
        return integrate(rhs, start, 3)[2:4]

    for name, value in zip("xy", tip(1)):
        row("benchmarks/double-pendulum", name, 3, value, "natural coordinates, DOP853")
    row("benchmarks/double-pendulum", "energy", 3, 0, "conserved")


def five_bar():
    points = [(0, 0), (-0.5, 1.5), (1, 2.5), (2.5, 1.5), (2, 0)]

    def tip(first, second):
        rods = [(i, i + 1, m, 0) for i, m in enumerate([1, 1.5, 1.5, 1])]
        rhs, start = bars(points, [0, 4], rods, [(2, (-1, 3), 100, first), (2, (2.5, 4), 100, second)])
        return integrate(rhs, start.astype(complex), 2)[2:4]

    for name, value in zip("xy", tip(2.2, 2.0).real):
        row("benchmarks/five-bar", name, 2, value, "natural coordinates, DOP853")
    for by, gradient in zip(["unloaded1", "unloaded2"], slopes(tip, [2.2, 2.0])):
        for name, value in zip("xy", gradient):
            row("benchmarks/five-bar", name, 2, value, "natural coordinates, DOP853, complex step", by=by)


def planetary_train():
    rs, rp = mp.mpf("0.03"), mp.mpf("0.02")
    carrier = rs / (2 * (rs + rp))
    planet = carrier - rs / rp * (1 - carrier)
    inertia = mp.mpf("2e-4") + mp.mpf("1e-3") * carrier**2
    inertia += 3 * (mp.mpf("4e-5") * planet**2 + mp.mpf("0.2") * ((rs + rp) * carrier) ** 2)
    sun = mp.mpf("0.5") / inertia / 2
    for name, ratio in [("sun_angle", 1), ("carrier_angle", carrier), ("planet_angle", planet)]:
        row("benchmarks/planetary-train", name, 1, sun * ratio, "closed form")
    row("benchmarks/planetary-train", "sun_angle", 1, 2 * sun, "closed form", by="torque")


def rack():
    x = lambda r, t: mp.mpf("0.02") * mp.cos(mp.sqrt(200 / (mp.mpf("0.5") + mp.mpf("2e-3") / r**2)) * t)
    r = mp.mpf("0.05")
    row("benchmarks/rack", "x", 1, x(r, 1), "closed form")
    row("benchmarks/rack", "x", 1, mp.diff(lambda r: x(r, 1), r), "closed form", by="radius")
    torque = mp.mpf("2e-3") / r**2 * mp.diff(lambda t: x(r, t), 1, 2)
    row("benchmarks/rack", "tooth_force", 1, torque, "closed form")


def half_car():
    xs = np.array([1.2, -1.5])

    def rhs(k, c):
        def f(t, y):
            height, pitch, wheel = y[0], y[1], y[2:4]
            vh, vp, vw = y[4], y[5], y[6:8]
            road = 0.03 * np.array([np.sin(8 * t), np.sin(8 * t - 2) - np.sin(-2)])
            dx, dy = xs * np.cos(pitch) - xs, height + xs * np.sin(pitch) - wheel
            ux, uy = -xs * np.sin(pitch) * vp, vh + xs * np.cos(pitch) * vp - vw
            length = np.sqrt(dx * dx + dy * dy)
            force = k * (length - 0.7) + c * (dx * ux + dy * uy) / length  # tension
            fx, fy = -force * dx / length, -force * dy / length
            moment = (xs * np.cos(pitch) * fy - xs * np.sin(pitch) * fx).sum()
            wheels = (180000 * (road + 0.3 - wheel) - fy) / 40 - G
            return np.concatenate([y[4:], [fy.sum() / 700 - G, moment / 1100], wheels])

        return f

    end = lambda k, c: integrate(rhs(k, c), np.array([0.9, 0, 0.3, 0.3, 0, 0, 0, 0], dtype=complex), 2)[:3]
    names = ["heave", "pitch", "wheel"]
    for name, value in zip(names, end(25000.0, 1500.0).real):
        row("benchmarks/half-car", name, 2, value, "DOP853")
    for by, gradient in zip(["stiffness", "damping"], slopes(end, [25000.0, 1500.0])):
        row("benchmarks/half-car", "pitch", 2, gradient[1], "DOP853, complex step", by=by)


def offset_slider_crank():
    r, speed = mp.mpf("0.1"), 30

    def motion(rod, offset):
        crank = lambda t: (r * mp.cos(speed * t), r * mp.sin(speed * t))
        x = lambda t: crank(t)[0] + mp.sqrt(rod**2 - (offset - crank(t)[1]) ** 2)
        return crank, x

    def torque(rod, offset, t):
        crank, x = motion(rod, offset)
        g = mp.mpf("9.81")
        middle = lambda t: ((crank(t)[0] + x(t)) / 2, (crank(t)[1] + offset) / 2)
        angle = lambda t: mp.asin((offset - crank(t)[1]) / rod)
        d = lambda f: mp.diff(f, t)
        dd = lambda f: mp.diff(f, t, 2)
        power = mp.mpf(1) * g * d(lambda t: crank(t)[1] / 2)
        power += 2 * (d(lambda t: middle(t)[0]) * dd(lambda t: middle(t)[0]))
        power += 2 * d(lambda t: middle(t)[1]) * (dd(lambda t: middle(t)[1]) + g)
        power += 2 * rod**2 / 12 * d(angle) * dd(angle)
        power += d(x) * (mp.mpf("1.5") * dd(x) + 200)
        return power / speed

    rod, offset = mp.mpf("0.35"), mp.mpf("0.03")
    for t in (mp.mpf("0.05"), mp.mpf("0.15")):
        row("benchmarks/offset-slider-crank", "x", t, motion(rod, offset)[1](t), "closed form")
        row("benchmarks/offset-slider-crank", "torque", t, torque(rod, offset, t), "power balance (mpmath)")
    t = mp.mpf("0.05")
    mp.mp.dps = 50
    slope = mp.diff(lambda e: torque(rod, e, t), offset)
    mp.mp.dps = 30
    row("benchmarks/offset-slider-crank", "torque", t, slope, "power balance (mpmath)", by="offset")


def spin_up():
    # Lag and shortening of the tip while the speed rises: Exudyn 1.13.6, 32 beams, generalized-alpha, steps of 1 ms (exudyn_mechanics.py).
    change = "elements = 8 => elements = 32\\nshear = \"plain\" | step = 0.01 => step = 0.001"
    for name, value in EXUDYN_SPIN_UP:
        row("spinning-beam", name, 7.5, value, "Exudyn 1.13.6, 32 beams", change=change)
    # A linearly elastic bar that rotates at constant speed: tan(λ L)/λ − L with λ² = ρ ω²/EA. After 15 s the mean of a residual vibration.
    wave = mp.sqrt(mp.mpf("1.2") * 36 / mp.mpf("2.8e7"))
    row("spinning-beam", "along", 15, mp.tan(wave * 10) / wave - 10, "closed form of the steady state", change="step = 0.01 => step = 0.005")


def roll_up():
    for time in (0.25, 0.5, 1.0):
        phi = 2 * mp.pi * time
        source = "circle"
        row("benchmarks/roll-up", "x", time, mp.chop(mp.sin(phi) / phi), source)
        row("benchmarks/roll-up", "y", time, (1 - mp.cos(phi)) / phi, source)
        row("benchmarks/roll-up", "theta", time, phi, source)


def elastica_tip(load):
    """Position and rotation of the tip of the inextensible cantilever: P L²/EI = load."""
    # sqrt(load) = K(m) − F(φ0, m), m = (1 + sin θ)/2, φ0 = asin(1/sqrt(2 m)) (Bisshopp & Drucker).
    def phase(theta):
        m = (1 + mp.sin(theta)) / 2
        return m, mp.asin(1 / mp.sqrt(2 * m))

    def residual(theta):
        m, phi = phase(theta)
        return mp.ellipk(m) - mp.ellipf(phi, m) - mp.sqrt(load)

    theta = mp.findroot(residual, (mp.mpf("0.01"), mp.pi / 2 - mp.mpf("1e-6")), solver="anderson")
    m, phi = phase(theta)
    x = mp.sqrt(2 * mp.sin(theta) / load)
    y = 1 - 2 * (mp.ellipe(m) - mp.ellipe(phi, m)) / mp.sqrt(load)
    return x, y, theta


def elastica():
    for load in (1, 2, 5, 10):
        x, y, theta = elastica_tip(mp.mpf(load))
        for name, value in (("x", x), ("y", y), ("theta", theta)):
            row("benchmarks/elastica", name, load, value, "elliptic integrals of Bisshopp & Drucker")


def follower_force():
    # Force P (−sin θ_L, cos θ_L): EI θ'' = −P cos(θ_L − θ), backwards from the free end: a pendulum that starts at rest at its tip.
    for load in (1, 5, 10):
        # ψ = θ_L − θ, its derivative and the position, from the tip to the root, in axes of the tip.
        f = lambda _, y: np.array([y[1], load * np.cos(y[0]), np.cos(y[0]), -np.sin(y[0])])
        psi, _, a, b = integrate(f, np.zeros(4), 1.0)
        # From tip to root the position changes by −(a, b) in axes of the tip; the root has θ = 0, so θ_L = ψ(root).
        c, s = np.cos(psi), np.sin(psi)
        x, y = c * a - s * b, s * a + c * b
        for name, value in (("x", x), ("y", y), ("theta", psi)):
            row("benchmarks/follower-force", name, load, value, "pendulum analogy, DOP853")


def bouncing_balls():
    def height(drop, e, time):
        g = mp.mpf("9.81")
        start, speed = mp.sqrt(2 * drop / g), mp.sqrt(2 * g * drop) * e
        while start + 2 * speed / g < time:
            start, speed = start + 2 * speed / g, speed * e
        t = time - start
        return speed * t - g * t * t / 2, speed - g * t

    for name, drop, e in (("lively", mp.mpf(1), mp.mpf("0.8")), ("dull", mp.mpf("0.8"), mp.mpf("0.6"))):
        y, v = height(drop, e, mp.mpf("1.5"))
        row("benchmarks/bouncing-balls", f"{name}_y", 1.5, y, "closed form")
        row("benchmarks/bouncing-balls", f"{name}_vy", 1.5, v, "closed form")
        slope = mp.diff(lambda e: height(drop, e, mp.mpf("1.5"))[0], e)
        row("benchmarks/bouncing-balls", f"{name}_y", 1.5, slope, "closed form", by=name)


def compliant_ball():
    def end(k, c):
        """Flight in closed form, contact by DOP853 in δ, from event to event; real arguments."""
        time, y, v = 0.0, 1.0, 0.0
        while True:
            land = (v + np.sqrt(v * v + 2 * G * y)) / G
            if time + land >= 1.5:
                t = 1.5 - time
                return np.array([y + v * t - G * t * t / 2, v - G * t])
            time, y, v = time + land, 0.0, v - G * land
            force = lambda d, w: k * max(d, 0.0) ** 1.5 * max(1 + 1.5 * c * w, 0.0)
            leave = lambda t, z: z[0]
            leave.terminal, leave.direction = True, 1
            f = lambda t, z: [z[1], force(-z[0], -z[1]) - G]
            found = solve_ivp(f, (0, 1), [-1e-300, v], method="DOP853", rtol=2.3e-14, atol=1e-15, events=leave, max_step=1e-3)
            time, y, v = time + found.t_events[0][0], 0.0, found.y_events[0][0][1]

    y, v = end(1e5, 0.1)
    row("benchmarks/compliant-ball", "y", 1.5, y, "flight in closed form, contact by DOP853")
    row("benchmarks/compliant-ball", "vy", 1.5, v, "flight in closed form, contact by DOP853")
    for by, h, shift in (("stiffness", 100.0, (1, 0)), ("damping", 1e-3, (0, 1))):
        d = lambda h: (end(1e5 + h * shift[0], 0.1 + h * shift[1]) - end(1e5 - h * shift[0], 0.1 - h * shift[1])) / (2 * h)
        slope = (4 * d(h / 2) - d(h)) / 3
        row("benchmarks/compliant-ball", "y", 1.5, slope[0], "extrapolated differences of the same", by=by)


def belt():
    def end(coulomb, speed):
        f = lambda t, y: np.array([y[1], -50 * y[0] - coulomb * np.tanh((y[1] - speed) / 0.01)])
        y = integrate(f, np.zeros(2, dtype=complex), 3)
        return np.array([y[0], coulomb * np.tanh((y[1] - speed) / 0.01)])

    x, force = end(3.0, 0.2).real
    row("benchmarks/belt", "x", 3, x, "DOP853")
    row("benchmarks/belt", "friction_force", 3, force, "DOP853")
    for by, gradient in zip(["coulomb", "speed"], slopes(end, [3.0, 0.2])):
        row("benchmarks/belt", "x", 3, gradient[0], "DOP853, complex step", by=by)


if __name__ == "__main__":
    only = sys.argv[1:]
    for part in (a01, a02, andrews, car_axis, five_bar, double_pendulum, planetary_train, rack, half_car, offset_slider_crank, spin_up,
                 roll_up, elastica, follower_force, bouncing_balls, compliant_ball, belt):
        if not only or part.__name__ in only:
            part()
    out = csv.writer(sys.stdout, lineterminator="\n")
    out.writerow(["model", "change", "output", "time", "by", "reference", "limit", "source"])
    out.writerows(ROWS)

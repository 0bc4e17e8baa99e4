"""CPU time at equal error of linkwright and Exudyn on models of the benchmark page of mechanics.

Both programs halve the step until the error is at most the target. Time of Exudyn: the solver alone, CPU time of the process. Time of
linkwright: the whole command `linkwright analyze`, from its start to the written table. One thread each; the least time of several
runs counts, for Exudyn with dense and sparse matrices, and with full and modified Newton iterations.
Usage: python exudyn_mechanics.py PATH/OF/linkwright [fast]     ("fast": Exudyn's build without range checks)
"""

import csv
import io
import math
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

if "fast" in sys.argv:
    sys.exudynFast = True
import exudyn as exu
from exudyn.itemInterface import *

HERE = pathlib.Path(__file__).resolve().parents[3]
MODELS = HERE / "examples" / "models"
REFERENCES = list(csv.DictReader(open(MODELS / "benchmarks" / "references.csv")))
RUNS = 3
# Settings of Exudyn; the fastest counts. Names: linear solver, modified Newton.
VARIANTS = [(solver, modified) for solver in ("EXUdense", "EigenSparse") for modified in (False, True)]
variant = VARIANTS[-1]


def reference(model, output, at, change=""):
    rows = [r for r in REFERENCES if (r["model"], r["output"], float(r["time"]), r["by"], r["change"]) == (model, output, at, "", change)]
    return float(rows[0]["reference"])


def linkwright(program, model, edits, output, at):
    """CPU seconds of the command and the value of the output."""
    text = (MODELS / f"{model}.toml").read_text()
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new)
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "model.toml"
        file.write_text(text)
        used = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
        before = used()
        done = subprocess.run([program, "analyze", file, "--out", folder + "/o"], capture_output=True, env={**os.environ, "RAYON_NUM_THREADS": "1"})
        spent = used() - before
        if done.returncode:
            return spent, math.nan
        rows = list(csv.DictReader(io.StringIO(open(folder + "/o/responses.csv").read())))
        return spent, float(min(rows, key=lambda r: abs(float(r["time"]) - at))[output])


def settings(step, end, radius=0.9):
    s = exu.SimulationSettings()
    s.timeIntegration.numberOfSteps = round(end / step)
    s.timeIntegration.endTime = end
    s.timeIntegration.generalizedAlpha.spectralRadius = radius
    s.timeIntegration.newton.useModifiedNewton = variant[1]
    s.timeIntegration.verboseMode = 0
    s.solution.file.write = False
    s.linearSolver.solverType = getattr(exu.LinearSolverType, variant[0])
    s.parallel.numberOfThreads = 1
    return s


def solve(mbs, s):
    start = time.process_time()
    try:
        mbs.SolveDynamic(s)
    except Exception:
        return time.process_time() - start, False
    return time.process_time() - start, True


def rod(mbs, start, end, velocity=(0, 0, 0), mass=1.0):
    """A slender rod and the markers of its ends."""
    length = math.dist(start, end)
    middle = [(start[0] + end[0]) / 2, (start[1] + end[1]) / 2, math.atan2(end[1] - start[1], end[0] - start[0])]
    node = mbs.AddNode(NodeRigidBody2D(referenceCoordinates=middle, initialVelocities=list(velocity)))
    body = mbs.AddObject(ObjectRigidBody2D(mass=mass, inertia=mass * length**2 / 12, nodeNumber=node))
    mbs.AddLoad(LoadMassProportional(markerNumber=mbs.AddMarker(MarkerBodyMass(bodyNumber=body)), loadVector=[0, -9.81, 0]))
    ends = [mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[x * length / 2, 0, 0])) for x in (-1, 1)]
    return node, body, ends


def pin(mbs, a, b):
    mbs.AddObject(ObjectJointRevolute2D(markerNumbers=[a, b]))


def double_pendulum(step):
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddObject(ObjectGround())
    hook = mbs.AddMarker(MarkerBodyPosition(bodyNumber=ground, localPosition=[0, 0, 0]))
    _, _, upper = rod(mbs, (0, 0), (1, 0))
    _, body, lower = rod(mbs, (1, 0), (2, 0))
    pin(mbs, hook, upper[0])
    pin(mbs, upper[1], lower[0])
    sensor = SensorBody(bodyNumber=body, localPosition=[0.5, 0, 0], writeToFile=False, outputVariableType=exu.OutputVariableType.Position)
    tip = mbs.AddSensor(sensor)
    mbs.Assemble()
    spent, good = solve(mbs, settings(step, 3))
    return spent, mbs.GetSensorValues(tip)[0] if good else math.nan


def four_bars(n):
    def run(step):
        mbs = exu.SystemContainer().AddSystem()
        ground = mbs.AddObject(ObjectGround())
        rods = []
        for i in range(n + 1):
            node, _, ends = rod(mbs, (i, 0), (i, 1), (0.5, 0, -1))
            pin(mbs, mbs.AddMarker(MarkerBodyPosition(bodyNumber=ground, localPosition=[i, 0, 0])), ends[0])
            rods.append((node, ends))
        for i in range(n):
            _, _, ends = rod(mbs, (i, 1), (i + 1, 1), (1, 0, 0))
            pin(mbs, rods[i][1][1], ends[0])
            pin(mbs, ends[1], rods[i + 1][1][1])
        sensor = SensorNode(nodeNumber=rods[0][0], writeToFile=False, outputVariableType=exu.OutputVariableType.Coordinates)
        angle = mbs.AddSensor(sensor)
        mbs.Assemble()
        spent, good = solve(mbs, settings(step, 10))
        return spent, math.pi / 2 + mbs.GetSensorValues(angle)[2] if good else math.nan

    return run


def spin_up(elements, end=7.5):
    def turn(t):
        w = 2 * math.pi / 15
        return 6 / 15 * (t * t / 2 + (math.cos(w * t) - 1) / w**2)

    def run(step):
        mbs = exu.SystemContainer().AddSystem()
        fixed = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0))
        nodes = [mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[10 * i / elements, 0, 0])) for i in range(elements + 1)]
        for i in range(elements):
            mbs.AddObject(
                ObjectBeamGeometricallyExact2D(
                    nodeNumbers=nodes[i : i + 2],
                    length=10 / elements,
                    massPerLength=1.2,
                    crossSectionInertia=6e-4,
                    bendingStiffness=1.4e4,
                    axialStiffness=2.8e7,
                    shearStiffness=1e7,
                )
            )
        held = []
        for c in range(3):
            marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=c))
            held.append(mbs.AddObject(CoordinateConstraint(markerNumbers=[fixed, marker], offset=0)))

        def drive(mbs, t):
            mbs.SetObjectParameter(held[2], "offset", turn(t))
            return True

        mbs.SetPreStepUserFunction(drive)
        sensor = SensorNode(nodeNumber=nodes[-1], writeToFile=False, outputVariableType=exu.OutputVariableType.Position)
        tip = mbs.AddSensor(sensor)
        mbs.Assemble()
        s = settings(step, end)
        s.timeIntegration.newton.absoluteTolerance = 1e-3  # N; the default is below the rounding of forces in stiff beams
        spent, good = solve(mbs, s)
        if not good:
            return spent, math.nan
        (x, y), a = mbs.GetSensorValues(tip)[:2], turn(end)
        run.along = x * math.cos(a) + y * math.sin(a) - 10
        return spent, y * math.cos(a) - x * math.sin(a)

    return run


def first_within(run, exact, target, step):
    """Halves the step until the error is at most `target`; CPU time (least of several runs and variants), step and error."""
    global variant
    variant = VARIANTS[-1]
    for _ in range(14):
        spent, value = run(step)
        if abs(value - exact) <= target:
            for variant in VARIANTS:
                for _ in range(RUNS):
                    seconds, value = run(step)
                    if abs(value - exact) <= target:
                        spent = min(spent, seconds)
                    if seconds > 1.5 * spent:
                        break
            return spent, step, abs(value - exact)
        if spent > 60:
            break
        step /= 2
    return None


def cell(found):
    return "not reached" if found is None else f"{1e3 * found[0]:.3g} ms, step {1e3 * found[1]:.3g} ms, error {found[2]:.0e}"


def main(program):
    implicit = lambda model, old, output, at, more=(): lambda h: linkwright(program, model, [(old, f"step = {h!r}"), *more], output, at)
    rk8 = 'scheme = "rk8"\ntolerance = 1e-12'
    dp = "benchmarks/double-pendulum"
    x = reference(dp, "x", 3)
    adaptive = lambda h: linkwright(program, dp, [("1e-12", repr(h))], "x", 3)
    print("| model | error below | Exudyn, generalized-α | linkwright, generalized-α | linkwright, order 8, adaptive |")
    print("|---|---|---|---|---|")

    def line(name, target, peer, ours, explicit=None):
        last = "" if explicit is None else f"{1e3 * explicit[0]:.3g} ms, tolerance {explicit[1]:.0e}, error {explicit[2]:.0e}"
        print(f"| {name} | {target:.0e} | {cell(peer)} | {cell(ours)} | {last} |", flush=True)

    for target in (1e-3, 1e-5):
        peer, ours = (first_within(run, x, target, 8e-3) for run in (double_pendulum, implicit(dp, rk8, "x", 3)))
        line("`double-pendulum`, x at 3 s", target, peer, ours, first_within(adaptive, x, target, 1e-4))
    for n in (1, 10, 40):
        model, change = "benchmarks/a02", f'..40" => ..{n}"' if n < 40 else ""
        angle = reference(model, "angle", 10, change)
        own = implicit(model, "step = 2e-3", "angle", 10, [('..40"', f'..{n}"')])
        line(f"`a02`, N = {n}, angle at 10 s", 1e-3, *(first_within(run, angle, 1e-3, 4e-3) for run in (four_bars(n), own)))
    edits = 'elements = 8 => elements = 32\\nshear = "plain" | step = 0.01 => step = 0.001'
    lag = reference("spinning-beam", "across", 7.5, edits)
    shorter = [("elements = 8", 'elements = 32\nshear = "plain"'), ("to = 15\npoints = 31", "to = 7.5\npoints = 16")]
    own = implicit("spinning-beam", "step = 0.01", "across", 7.5, shorter)
    line("`spinning-beam`, 32 beams, lag at 7.5 s", 1e-3, *(first_within(run, lag, 1e-3, 5e-2) for run in (spin_up(32), own)))


if __name__ == "__main__":
    if sys.argv[1] == "spin-up":
        for elements, step in ((8, 5e-3), (32, 5e-3), (32, 1e-3)):
            run = spin_up(elements)
            _, lag = run(step)
            print(elements, step, "across", repr(float(lag)), "along", repr(float(run.along)))
    else:
        main(sys.argv[1])

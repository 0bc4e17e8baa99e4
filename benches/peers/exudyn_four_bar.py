"""Four-bar mechanism with Exudyn, flexible and rigid: CPU time of the solver and largest bending stresses.

The set-up is that of ../exudyn.rs: crank 0.3048 m, coupler 0.9144 m, rocker 0.762 m, ground 0.9144 m, round aluminium links of
38.5, 25.2 and 20 mm; the crank starts from 90 degrees and reaches 10 pi rad/s in 0.2 s by a half-cosine; 0.5 s at 1 ms.
Flexible links are rows of 6, 18, ... equal two-node geometrically exact beams; stresses are compared at the six points that are
element middles in all of them. Generalized-alpha of spectral radius 0.9. The crank's angle is set once per step. Only the solver
is timed, in CPU time of the process; the minimum of several runs is printed. Arguments: "modified" for modified Newton iterations, "fast"
for Exudyn's build without range checks.
"""

import math
import sys
import time

if "fast" in sys.argv:
    sys.exudynFast = True  # no range checks, AVX2
import exudyn as exu
from exudyn.itemInterface import *

LENGTHS, GROUND, DIAMETERS = [0.3048, 0.9144, 0.762], 0.9144, [0.0385, 0.0252, 0.02]
YOUNG, POISSON, DENSITY = 6.895e10, 0.3, 2757.0
SPEED, RAMP, START = 10 * math.pi, 0.2, math.pi / 2


def angle(t):
    """Rotation of the crank from its start."""
    if t >= RAMP:
        return SPEED * (t - RAMP / 2)
    x = t / RAMP
    return SPEED * RAMP * (x / 2 - math.sin(math.pi * x) / (2 * math.pi))


def joints():
    """Ends of the links: O, B, C, D."""
    a, b, c = LENGTHS
    bx, by = a * math.cos(START), a * math.sin(START)
    dx, dy = GROUND - bx, -by
    distance = math.hypot(dx, dy)
    along = (b * b - c * c + distance**2) / (2 * distance)
    height = math.sqrt(b * b - along**2)
    ux, uy = dx / distance, dy / distance
    return [(0, 0), (bx, by), (bx + along * ux - height * uy, by + along * uy + height * ux), (GROUND, 0)]


def settings(step, end):
    s = exu.SimulationSettings()
    s.timeIntegration.numberOfSteps = round(end / step)
    s.timeIntegration.endTime = end
    s.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    s.timeIntegration.newton.useModifiedNewton = "modified" in sys.argv
    s.timeIntegration.verboseMode = 0
    s.solution.file.write = False
    s.solution.sensors.writePeriod = step
    s.timeIntegration.newton.absoluteTolerance = 1e-4  # N; the default is below the rounding of forces in stiff beams
    s.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    s.parallel.numberOfThreads = 1
    return s


def pin(mbs, a, b):
    mbs.AddObject(ObjectJointRevolute2D(markerNumbers=[a, b]))


def link_ends():
    o, b, c, d = joints()
    return [(o, b), (b, c), (d, c)]


def drive(mbs, node, ground_coordinate):
    """Prescribes the rotation of a node, set once per step."""
    marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=2))
    held = mbs.AddObject(CoordinateConstraint(markerNumbers=[ground_coordinate, marker], offset=0))

    def turn(mbs, t):
        mbs.SetObjectParameter(held, "offset", angle(t))
        return True

    mbs.SetPreStepUserFunction(turn)


def ground_of(mbs):
    node = mbs.AddNode(NodePointGround())
    body = mbs.AddObject(ObjectGround())
    pins = [mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0])) for x in (0, GROUND)]
    return pins, mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))


def run(mbs, step):
    mbs.Assemble()
    s = settings(step, 0.5)
    start = time.process_time()
    mbs.SolveDynamic(s)
    return time.process_time() - start


def rigid(step):
    mbs = exu.SystemContainer().AddSystem()
    pins, fixed = ground_of(mbs)
    ends = []
    for k, (start, end) in enumerate(link_ends()):
        length, mass = LENGTHS[k], math.pi / 4 * DIAMETERS[k] ** 2 * LENGTHS[k] * DENSITY
        turn = math.atan2(end[1] - start[1], end[0] - start[0])
        middle = [(start[0] + end[0]) / 2, (start[1] + end[1]) / 2, turn]
        node = mbs.AddNode(NodeRigidBody2D(referenceCoordinates=middle))
        body = mbs.AddObject(ObjectRigidBody2D(mass=mass, inertia=mass * length**2 / 12, nodeNumber=node))
        place = lambda x: mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0]))
        ends.append((place(-length / 2), place(length / 2)))
        if k == 0:
            drive(mbs, node, fixed)
    pin(mbs, pins[0], ends[0][0])
    pin(mbs, ends[0][1], ends[1][0])
    pin(mbs, ends[1][1], ends[2][1])
    pin(mbs, pins[1], ends[2][0])
    joint = mbs.AddSensor(
        SensorNode(nodeNumber=node, outputVariableType=exu.OutputVariableType.Rotation, writeToFile=False)
    )
    spent = run(mbs, step)
    return spent, mbs.GetSensorValues(joint)[-1]


def flexible(elements, step):
    mbs = exu.SystemContainer().AddSystem()
    pins, fixed = ground_of(mbs)
    ends, sensors = [], []
    for k, (start, end) in enumerate(link_ends()):
        d, piece = DIAMETERS[k], LENGTHS[k] / elements
        area, second = math.pi / 4 * d**2, math.pi / 64 * d**4
        turn = math.atan2(end[1] - start[1], end[0] - start[0])
        at = lambda i: [start[j] + (end[j] - start[j]) * i / elements for j in (0, 1)]
        nodes = [mbs.AddNode(NodeRigidBody2D(referenceCoordinates=at(i) + [turn])) for i in range(elements + 1)]
        for i in range(elements):
            beam = mbs.AddObject(
                ObjectBeamGeometricallyExact2D(
                    nodeNumbers=nodes[i : i + 2],
                    length=piece,
                    massPerLength=DENSITY * area,
                    crossSectionInertia=DENSITY * second,
                    bendingStiffness=YOUNG * second,
                    axialStiffness=YOUNG * area,
                    shearStiffness=0.9 * area * YOUNG / (2 * (1 + POISSON)),
                    includeReferenceRotations=True,
                )
            )
            refinement = elements // 6
            if i % refinement == refinement // 2:
                moment = SensorBody(
                    bodyNumber=beam,
                    localPosition=[0, 0, 0],
                    storeInternal=True,
                    writeToFile=False,
                    outputVariableType=exu.OutputVariableType.TorqueLocal,
                )
                sensors.append((k, mbs.AddSensor(moment)))
        ends.append([mbs.AddMarker(MarkerNodePosition(nodeNumber=nodes[i])) for i in (0, -1)])
        if k == 0:
            drive(mbs, nodes[0], fixed)
    pin(mbs, pins[0], ends[0][0])
    pin(mbs, ends[0][1], ends[1][0])
    pin(mbs, ends[1][1], ends[2][1])
    pin(mbs, pins[1], ends[2][0])
    spent = run(mbs, step)
    peaks = [0.0] * 3
    for k, sensor in sensors:
        history = mbs.GetSensorStoredData(sensor)
        window = history[history[:, 0] > 0.3 - 1e-9]
        peaks[k] = max(peaks[k], abs(window[:, -1]).max() * 32 / (math.pi * DIAMETERS[k] ** 3))
    return spent, peaks


if __name__ == "__main__":
    runs = [rigid(1e-3) for _ in range(5)]
    print(f"rigid, step 1 ms: CPU {min(r[0] for r in runs) * 1e3:.1f} ms, rocker turned by {runs[0][1]:.9f} rad")
    for elements, step in [(6, 1e-3), (18, 1e-3), (6, 2.5e-4), (18, 2.5e-4)]:
        runs = [flexible(elements, step) for _ in range(3)]
        stress = ", ".join(f"{p / 1e6:.4f}" for p in runs[0][1])
        spent = min(r[0] for r in runs) * 1e3
        print(f"flexible, 3 x {elements} elements, step {step * 1e3} ms: CPU {spent:.1f} ms, largest stresses {stress} MPa")

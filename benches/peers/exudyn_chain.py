"""Falling chain of N rigid links with Exudyn: CPU time and tip after 1 s, for several step sizes.

The set-up is that of ../chain.rs: slender links, together 1 m and 1 kg, released from rest in the horizontal,
g = 9.81 m/s^2. Generalized-alpha on the index-3 equations with spectral radius 0.9, as in linkwright's `Dynamics::fixed`.
Only the solver is timed, in CPU time of the process; the minimum of several runs is printed. Arguments: numbers of links; "modified" for
modified Newton iterations, "fast" for Exudyn's build without range checks.
"""

import sys
import time

if "fast" in sys.argv:
    sys.exudynFast = True
import exudyn as exu
from exudyn.itemInterface import *


def chain(links, step):
    """Returns CPU seconds of the solver and the tip position after 1 s."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    length, mass = 1.0 / links, 1.0 / links
    ground = mbs.AddObject(ObjectGround(referencePosition=[0, 0, 0]))
    hook = mbs.AddMarker(MarkerBodyPosition(bodyNumber=ground, localPosition=[0, 0, 0]))
    for k in range(links):
        node = mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[(k + 0.5) * length, 0, 0]))
        inertia = mass * length**2 / 12
        body = mbs.AddObject(ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))
        near = mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[-0.5 * length, 0, 0]))
        mbs.AddObject(ObjectJointRevolute2D(markerNumbers=[hook, near]))
        weight = mbs.AddMarker(MarkerBodyMass(bodyNumber=body))
        mbs.AddLoad(LoadMassProportional(markerNumber=weight, loadVector=[0, -9.81, 0]))
        hook = mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[0.5 * length, 0, 0]))
    tip = mbs.AddSensor(
        SensorBody(
            bodyNumber=body,
            localPosition=[0.5 * length, 0, 0],
            writeToFile=False,
            outputVariableType=exu.OutputVariableType.Position,
        )
    )
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(1.0 / step)
    settings.timeIntegration.endTime = 1.0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.newton.useModifiedNewton = "modified" in sys.argv
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.parallel.numberOfThreads = 1
    start = time.process_time()
    mbs.SolveDynamic(settings)
    spent = time.process_time() - start
    return spent, mbs.GetSensorValues(tip)[:2]


if __name__ == "__main__":
    for links in [int(a) for a in sys.argv[1:] if a.isdigit()] or [8, 32]:
        for step in [1e-3, 5e-4, 2.5e-4, 1.25e-4]:
            runs = [chain(links, step) for _ in range(3)]
            spent, (x, y) = min(runs)[0], runs[0][1]
            print(f"chain of {links:>2}, step {step:.2e} s: CPU {spent * 1e3:8.1f} ms, tip after 1 s {x:.10f} {y:.10f}")

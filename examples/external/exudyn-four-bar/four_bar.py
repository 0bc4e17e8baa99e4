"""The paper's flexible four-bar mechanism, simulated by Exudyn and optimized by linkwright with forward differences.

Least mass of three round links whose bending stress is at most 27.58 MPa (Etman, van Campen & Schoofs 1998, section 6.3). The
stresses are those at six points of each link between 0.3 and 0.5 s. The same problem is then solved with
linkwright's own beams and exact derivatives, and both optima are compared. Needs `pip install exudyn`.
"""

import math
import time

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CoordinateConstraint,
    MarkerBodyPosition,
    MarkerNodeCoordinate,
    MarkerNodePosition,
    NodePointGround,
    NodeRigidBody2D,
    ObjectBeamGeometricallyExact2D,
    ObjectGround,
    ObjectJointRevolute2D,
    SensorBody,
)

import linkwright

LENGTHS, GROUND = np.array([0.3048, 0.9144, 0.762]), 0.9144  # crank, coupler, rocker, in m
YOUNG, POISSON, DENSITY = 6.895e10, 0.3, 2757.0
SPEED, RAMP, START = 10 * math.pi, 0.2, math.pi / 2
LIMIT = 2.758e7  # N/m²
POINTS = 6  # per link, where stresses are limited: the middles of six equal parts
REFINEMENT = 3  # of Exudyn's elements per part, odd; its two-node beams need more elements than ours
STEP = 1e-3  # s
TIME = np.linspace(0.3, 0.5, 201)
LINKS = ["crank", "coupler", "rocker"]
NAMES = [f"moment_{link}_{k}" for link in LINKS for k in range(1, POINTS + 1)]


def crank_angle(t):
    """Rotation of the crank from its start: a half-cosine in speed up to 10 pi rad/s in 0.2 s."""
    if t >= RAMP:
        return SPEED * (t - RAMP / 2)
    x = t / RAMP
    return SPEED * RAMP * (x / 2 - math.sin(math.pi * x) / (2 * math.pi))


def joints():
    """The joints O, B, C, D at the start, with the crank upright."""
    crank, coupler, rocker = LENGTHS
    bx, by = crank * math.cos(START), crank * math.sin(START)
    dx, dy = GROUND - bx, -by
    distance = math.hypot(dx, dy)
    along = (coupler**2 - rocker**2 + distance**2) / (2 * distance)
    height = math.sqrt(coupler**2 - along**2)
    ux, uy = dx / distance, dy / distance
    return np.array([(0, 0), (bx, by), (bx + along * ux - height * uy, by + along * uy + height * ux), (GROUND, 0)])


def analyze(diameters):
    """Bending moments in N·m at the element middles of the three links, over TIME."""
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddObject(ObjectGround())
    pins = [mbs.AddMarker(MarkerBodyPosition(bodyNumber=ground, localPosition=[x, 0, 0])) for x in (0, GROUND)]
    fixed = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0))
    o, b, c, d = joints()
    ends, sensors, crank = [], [], None
    for diameter, (start, end) in zip(diameters, [(o, b), (b, c), (d, c)]):
        area, second = math.pi / 4 * diameter**2, math.pi / 64 * diameter**4
        angle = math.atan2(*(end - start)[::-1])
        elements = POINTS * REFINEMENT
        places = [start + (end - start) * i / elements for i in range(elements + 1)]
        nodes = [mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[*place, angle])) for place in places]
        crank = nodes[0] if crank is None else crank
        for i, pair in enumerate(zip(nodes, nodes[1:])):
            beam = ObjectBeamGeometricallyExact2D(
                nodeNumbers=list(pair),
                length=float(np.linalg.norm(end - start)) / elements,
                massPerLength=DENSITY * area,
                crossSectionInertia=DENSITY * second,
                bendingStiffness=YOUNG * second,
                axialStiffness=YOUNG * area,
                shearStiffness=0.9 * area * YOUNG / (2 * (1 + POISSON)),
                includeReferenceRotations=True,
            )
            sensor = SensorBody(
                bodyNumber=mbs.AddObject(beam),
                localPosition=[0, 0, 0],
                storeInternal=True,
                writeToFile=False,
                outputVariableType=exu.OutputVariableType.TorqueLocal,
            )
            if i % REFINEMENT == REFINEMENT // 2:
                sensors.append(mbs.AddSensor(sensor))
        ends.append([mbs.AddMarker(MarkerNodePosition(nodeNumber=nodes[i])) for i in (0, -1)])
    pairs = [(pins[0], ends[0][0]), (ends[0][1], ends[1][0]), (ends[1][1], ends[2][1]), (pins[1], ends[2][0])]
    for pair in pairs:
        mbs.AddObject(ObjectJointRevolute2D(markerNumbers=list(pair)))
    marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=crank, coordinate=2))
    drive = mbs.AddObject(CoordinateConstraint(markerNumbers=[fixed, marker], offset=0))

    def turn(mbs, t):
        mbs.SetObjectParameter(drive, "offset", crank_angle(t))
        return True

    mbs.SetPreStepUserFunction(turn)
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(TIME[-1] / STEP)
    settings.timeIntegration.endTime = float(TIME[-1])
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.newton.absoluteTolerance = 1e-4  # N
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = STEP
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.parallel.numberOfThreads = 1
    try:
        mbs.SolveDynamic(settings)
    except Exception as error:
        # A design that Exudyn cannot simulate rejects the step; the run continues with a smaller one.
        raise linkwright.AnalysisError(f"Exudyn: {error}") from error
    moments = [mbs.GetSensorStoredData(sensor) for sensor in sensors]
    return {name: np.interp(TIME, moment[:, 0], moment[:, -1]) for name, moment in zip(NAMES, moments)}


VARIABLES = {f"d{k}": {"start": 0.1, "lower": 5e-3, "upper": 1.0, "unit": "m"} for k in (1, 2, 3)}
MASS = f"{DENSITY * math.pi / 4}*({LENGTHS[0]}*d1^2 + {LENGTHS[1]}*d2^2 + {LENGTHS[2]}*d3^2)"
OBJECTIVE = {"minimize": MASS, "name": "mass", "unit": "kg"}
CONSTRAINTS = {
    f"stress {link} {k}": {"value": f"32/pi*moment_{link}_{k}/d{i}^3", "at_least": -LIMIT, "at_most": LIMIT}
    for i, link in enumerate(LINKS, start=1)
    for k in range(1, POINTS + 1)
}
METHOD = {"preset": "automatic", "accuracy": 1e-3}


def exudyn_problem():
    """Moments by Exudyn, linearized in the areas of the sections as in the paper; forward differences."""
    return linkwright.Problem(
        VARIABLES,
        {name: {"unit": "N·m", "linear_in": "area"} for name in NAMES},
        analyze,
        objective=OBJECTIVE,
        constraints=CONSTRAINTS,
        time=TIME,
        differences="forward",
        step=1e-4,
        method=METHOD,
        name="four-bar by Exudyn",
    )


def own_model():
    """The same with linkwright's beams: 12 elements, whose nodes 2, 4 … 12 are the middles of the six parts."""
    o, b, c, d = (point.tolist() for point in joints())
    beam = {"young": YOUNG, "density": DENSITY, "elements": 2 * POINTS}
    outputs = [
        {"name": f"moment_{link}_{k}", "value": f"{link}.{2 * k}.moment", "unit": "N·m", "linear_in": "area"}
        for link in LINKS
        for k in range(1, POINTS + 1)
    ]
    return linkwright.Model.from_dict(
        {
            "title": "four-bar",
            "design": VARIABLES,
            "body": [{"name": n, "kind": "fixed-node", "position": p} for n, p in (("O", o), ("D", d))],
            "beam": [
                {"name": "crank", "from": o, "to": b, "start": "O", "diameter": "d1", **beam},
                {"name": "coupler", "from": b, "to": c, "start": "crank.last", "diameter": "d2", **beam},
                {"name": "rocker", "from": d, "to": c, "start": "D", "end": "coupler.last", "diameter": "d3", **beam},
            ],
            "driver": [
                {
                    "name": "motor",
                    "coordinate": "crank.first.theta",
                    "motion": {"kind": "start-up", "position": START, "speed": SPEED, "duration": RAMP},
                }
            ],
            "time": {"at": TIME},
            "analysis": {"kind": "dynamics", "step": STEP, "spectral_radius": 0.9},
            "output": outputs,
            "objective": OBJECTIVE,
            "constraint": [{"name": name, **constraint} for name, constraint in CONSTRAINTS.items()],
            "method": METHOD,
        }
    )


def main():
    foreign, own = exudyn_problem(), own_model()
    results = {}
    for name, problem in [("Exudyn", foreign), ("linkwright", own)]:
        begun = time.perf_counter()
        result = results[name] = problem.optimize()
        spent = time.perf_counter() - begun
        diameters = ", ".join(f"{1e3 * d:.3f}" for d in result.design)
        print(
            f"{name:10}: {result.status}, mass {result.objective:.5f} kg, diameters {diameters} mm, "
            f"{result.analyses} analyses, {result.sensitivity_analyses} sensitivity analyses, {spent:.1f} s"
        )
    # How far apart are the two models? Largest stress of each link at the same design, by both.
    design = results["Exudyn"].design
    stress = lambda found: np.array(
        [max(np.abs(found[f"moment_{link}_{k}"]).max() for k in range(1, POINTS + 1)) for link in LINKS]
    ) * 32 / (math.pi * design**3)
    there, here = stress(foreign.analyze(design)), stress(own.analyze(design))
    apart = np.abs(here / there - 1).max()
    print(f"largest stresses at Exudyn's optimum: Exudyn {there / 1e6} MPa, linkwright {here / 1e6} MPa, apart {apart:.2%}")
    masses = [result.objective for result in results.values()]
    difference = abs(masses[1] / masses[0] - 1)
    print(f"masses apart {difference:.2%}")
    # Inertia forces scale with d^2 and stresses by bending with 1/d^3: the stress with 1/d, and the mass with 1/stress^2.
    assert all(result.success for result in results.values())
    assert difference <= 2 * apart + METHOD["accuracy"]


if __name__ == "__main__":
    main()

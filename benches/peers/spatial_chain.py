"""Falling chain in space by other programs: least CPU seconds of 1 s with a given error of the tip.

The set-up is that of crates/mechanics/benches/space.rs, which runs this script: cylinders of 20 mm radius, together 1 m and 1 kg, hinges with axes (0, 1, 0) and
(0, 0.6, 0.8) in turn, released from rest in the horizontal, g = 9.81 m/s^2. Steps are classical Runge-Kutta steps of order 4; the number
of steps is the smallest of 50, 71, 100, … with an error of at most 1e-5 m. Pinocchio has no integrator: its time is that of four
calls of `aba` per step, without what happens between them. Only the steps are timed, in CPU time of the process. Versions of the
packages: requirements.txt.

usage: python spatial_chain.py mujoco|pinocchio|exudyn LINKS X Y Z
"""

import sys
import time

import numpy as np

ERROR = 1e-5
RADIUS = 0.02


def axis(k):
    return np.array([0.0, 1.0, 0.0]) if k % 2 == 0 else np.array([0.0, 0.6, 0.8])


def inertia(mass, length):
    across = mass * (3 * RADIUS**2 + length**2) / 12
    return np.diag([mass * RADIUS**2 / 2, across, across])


def least(run, repeats=5):
    """Least CPU seconds of `run`, which is repeated for 0.1 s at least."""
    best = np.inf
    for _ in range(repeats):
        start, count = time.process_time(), 0
        while (spent := time.process_time() - start) < 0.1:
            run()
            count += 1
        best = min(best, spent / count)
    return best


def mujoco_chain(links):
    import mujoco

    length, mass = 1.0 / links, 1.0 / links
    moments = " ".join(repr(float(x)) for x in np.diag(inertia(mass, length)))
    text = ""
    for k in reversed(range(links)):
        at = 0.0 if k == 0 else length
        hinge = " ".join(map(str, axis(k)))
        end = f'<site name="tip" pos="{length!r} 0 0"/>' if k + 1 == links else ""
        text = (
            f'<body pos="{at!r} 0 0"><joint type="hinge" axis="{hinge}"/><inertial pos="{0.5 * length!r} 0 0" '
            f'mass="{mass!r}" diaginertia="{moments}"/>{end}{text}</body>'
        )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 -9.81" integrator="RK4"/><worldbody>{text}</worldbody></mujoco>'
    )
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)

    def simulate(steps):
        mujoco.mj_resetData(model, data)
        model.opt.timestep = 1.0 / steps
        mujoco.mj_step(model, data, nstep=steps)

    def tip():
        mujoco.mj_forward(model, data)
        return np.array(data.site_xpos[0])

    return simulate, tip, f"MuJoCo {mujoco.__version__}", 1.0


def pinocchio_chain(links):
    import pinocchio as pin

    length, mass = 1.0 / links, 1.0 / links
    model = pin.Model()
    model.gravity.linear = np.array([0, 0, -9.81])
    parent = 0
    for k in range(links):
        place = pin.SE3(np.eye(3), np.array([0.0 if k == 0 else length, 0, 0]))
        parent = model.addJoint(parent, pin.JointModelRevoluteUnaligned(axis(k)), place, f"hinge {k}")
        body = pin.Inertia(mass, np.array([0.5 * length, 0, 0]), inertia(mass, length))
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
    data = model.createData()
    zero = np.zeros(links)
    state = {}

    def simulate(steps):
        q, v, h = np.zeros(links), np.zeros(links), 1.0 / steps
        acceleration = lambda q, v: pin.aba(model, data, q, v, zero)  # noqa: E731
        for _ in range(steps):
            a1 = acceleration(q, v)
            v2 = v + 0.5 * h * a1
            a2 = acceleration(q + 0.5 * h * v, v2)
            v3 = v + 0.5 * h * a2
            a3 = acceleration(q + 0.5 * h * v2, v3)
            v4 = v + h * a3
            a4 = acceleration(q + h * v3, v4)
            q = q + h / 6 * (v + 2 * v2 + 2 * v3 + v4)
            v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        state["q"] = q

    def tip():
        pin.forwardKinematics(model, data, state["q"])
        return data.oMi[links].act(np.array([length, 0, 0]))

    q = np.linspace(0.1, 1.0, links)
    return simulate, tip, f"Pinocchio {pin.__version__}, calls of aba only", lambda: pin.aba(model, data, q, q, zero)


def exudyn_chain(links):
    sys.exudynFast = True
    import exudyn as exu
    from exudyn.utilities import NodeGenericODE2, ObjectKinematicTree, SensorKinematicTree

    length, mass = 1.0 / links, 1.0 / links
    frames = []
    for k in range(links):
        z = axis(k)
        x = np.array([1.0, 0.0, 0.0])
        frames.append(np.column_stack([x, np.cross(z, x), z]))
    system = exu.SystemContainer()
    mbs = system.AddSystem()
    node = mbs.AddNode(
        NodeGenericODE2(
            referenceCoordinates=[0.0] * links,
            initialCoordinates=[0.0] * links,
            initialCoordinates_t=[0.0] * links,
            numberOfODE2Coordinates=links,
        )
    )
    before = [np.eye(3)] + frames[:-1]
    lists = {
        "jointTransformations": exu.Matrix3DList([a.T @ b for a, b in zip(before, frames)]),
        "jointOffsets": exu.Vector3DList([a.T @ [0.0 if k == 0 else length, 0, 0] for k, a in enumerate(before)]),
        "linkInertiasCOM": exu.Matrix3DList([a.T @ inertia(mass, length) @ a for a in frames]),
        "linkCOMs": exu.Vector3DList([a.T @ [0.5 * length, 0, 0] for a in frames]),
    }
    tree = mbs.AddObject(
        ObjectKinematicTree(
            nodeNumber=node,
            jointTypes=[exu.JointType.RevoluteZ] * links,
            linkParents=list(range(-1, links - 1)),
            linkMasses=[mass] * links,
            gravity=[0, 0, -9.81],
            **lists,
        )
    )
    sensor = mbs.AddSensor(
        SensorKinematicTree(
            objectNumber=tree,
            linkNumber=links - 1,
            localPosition=frames[-1].T @ [length, 0, 0],
            writeToFile=False,
            outputVariableType=exu.OutputVariableType.Position,
        )
    )
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = 1.0
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.parallel.numberOfThreads = 1

    def simulate(steps):
        settings.timeIntegration.numberOfSteps = steps
        mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.RK44)

    return simulate, lambda: np.array(mbs.GetSensorValues(sensor)), f"Exudyn {exu.config.Version()}", 1.0


if __name__ == "__main__":
    program, links, exact = sys.argv[1], int(sys.argv[2]), np.array([float(x) for x in sys.argv[3:6]])
    makers = {"mujoco": mujoco_chain, "pinocchio": pinocchio_chain, "exudyn": exudyn_chain}
    simulate, tip, words, one = makers[program](links)
    for steps in (round(50 * 2 ** (k / 2)) for k in range(20)):
        simulate(steps)
        error = np.linalg.norm(tip() - exact)
        if error <= ERROR:
            break
    else:
        sys.exit("the error is not reached")
    if callable(one):
        # Many calls from one loop, so that the loop costs little.
        seconds = least(lambda: [one() for _ in range(1000)]) / 1000 * 4 * steps
    else:
        seconds = least(lambda: simulate(steps))
    print(f"{seconds!r} {words}, {steps} steps, error {error:.1e} m")

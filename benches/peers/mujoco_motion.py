"""Motion of an MJCF model by MuJoCo without contacts, limits, dry friction and motors.

usage: python mujoco_motion.py MODEL.xml END STEP > MOTION.csv

Rows `start` are accelerations at rest of joints with one degree of freedom. The other rows are positions at the time END, by Runge-Kutta
steps of order 4: of such joints from the start, of origins of bodies, and of sites. Version of the package: requirements.txt.
"""

import sys

import mujoco
import numpy as np

model = mujoco.MjModel.from_xml_path(sys.argv[1])
end, step = float(sys.argv[2]), float(sys.argv[3])
disabled = mujoco.mjtDisableBit
for bit in (disabled.mjDSBL_CONTACT, disabled.mjDSBL_LIMIT, disabled.mjDSBL_FRICTIONLOSS, disabled.mjDSBL_ACTUATION):
    model.opt.disableflags |= bit
model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
model.opt.timestep = step
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
single_types = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
single = [joint for joint in range(model.njnt) if int(model.jnt_type[joint]) in single_types]
print(f"# MuJoCo {mujoco.__version__}, {end} s in steps of {step} s")
print("what,name,x,y,z")
for joint in single:
    print(f"start,{model.joint(joint).name},{float(data.qacc[model.jnt_dofadr[joint]])!r},,")
for _ in range(round(end / step)):
    mujoco.mj_step(model, data)
mujoco.mj_forward(model, data)
for joint in single:
    place = model.jnt_qposadr[joint]
    print(f"joint,{model.joint(joint).name},{float(data.qpos[place] - model.qpos0[place])!r},,")
for body in range(1, model.nbody):
    print("body," + ",".join([model.body(body).name] + [repr(float(x)) for x in data.xpos[body]]))
for site in range(model.nsite):
    print("site," + ",".join([model.site(site).name] + [repr(float(x)) for x in data.site_xpos[site]]))

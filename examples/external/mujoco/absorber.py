"""An impact absorber simulated by MuJoCo and optimized by linkwright. Needs `pip install mujoco`.

A mass of 1 kg hits a spring and a damper at 1 m/s. Stiffness and damping minimize the peak of its acceleration over 12 s, while
it travels at most 1 m. The optimum 0.5203 m/s² is known in closed form (Afimiwala & Mayne 1974; Etman et al. 1998).
"""

import time

import mujoco
import numpy as np

import linkwright

TIME = np.linspace(0.0, 12.0, 101)
STEPS = 6  # of MuJoCo between two time points: 20 ms each

MJCF = f"""
<mujoco>
  <option timestep="{TIME[1] / STEPS}" gravity="0 0 0" integrator="RK4"/>
  <worldbody>
    <body name="mass">
      <joint name="travel" type="slide" axis="1 0 0" stiffness="1" damping="0.3"/>
      <geom type="sphere" size="0.05" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""

MODEL = mujoco.MjModel.from_xml_string(MJCF)
DATA = mujoco.MjData(MODEL)  # one for all analyses: linkwright calls the function in one thread, one design after another


def analyze(b):
    """Displacement in m and acceleration in m/s² of the mass over TIME."""
    MODEL.jnt_stiffness[0], MODEL.dof_damping[0] = b
    mujoco.mj_resetData(MODEL, DATA)
    DATA.qvel[0] = 1.0
    displacement, acceleration = np.empty(len(TIME)), np.empty(len(TIME))
    for p in range(len(TIME)):
        if p > 0:
            mujoco.mj_step(MODEL, DATA, nstep=STEPS)
        mujoco.mj_forward(MODEL, DATA)
        displacement[p], acceleration[p] = DATA.qpos[0], DATA.qacc[0]
    return {"displacement": displacement, "acceleration": acceleration}


problem = linkwright.Problem(
    {
        "k": {"start": 1.0, "lower": 1e-3, "upper": 1.0, "unit": "N/m"},
        "c": {"start": 0.3, "lower": 1e-3, "upper": 1.0, "unit": "N·s/m"},
    },
    {"displacement": "m", "acceleration": "m/s²"},
    analyze,
    objective={
        "minimize": "acceleration",
        "over": "peak",
        "bound": {"name": "peak", "start": 0.85, "lower": 0.0, "unit": "m/s²"},
    },
    constraints={"travel": {"value": "displacement", "at_most": 1.0}},
    time=TIME,
    method="slp",
    name="absorber by MuJoCo",
)


def main():
    begun = time.perf_counter()
    result = problem.optimize()
    print(f"{result}; {result.sensitivity_analyses} sensitivity analyses, {time.perf_counter() - begun:.2f} s")
    assert result.success and abs(result.objective - 0.520286) < 1e-4


if __name__ == "__main__":
    main()

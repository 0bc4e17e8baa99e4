"""An impact absorber in an FMU, optimized by linkwright. Needs `pip install fmpy pythonfmu`.

The FMU is made by pythonfmu from absorber_slave.py; any FMI 2.0 co-simulation FMU is used in the same way. The problem is that of
../mujoco.
"""

import pathlib
import tempfile
import time

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from pythonfmu.builder import FmuBuilder

import linkwright

TIME = np.linspace(0.0, 12.0, 101)
HERE = pathlib.Path(__file__).parent


class Simulator:
    """An FMU that is loaded once: `reset` and a new initialization are ten times faster than loading it for each design."""

    def __init__(self, path, folder, inputs, outputs):
        description = fmpy.read_model_description(path)
        numbers = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.inputs, self.outputs = ([numbers[name] for name in names] for names in (inputs, outputs))
        self.names = outputs
        self.fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=fmpy.extract(path, folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="one",
        )
        self.fmu.instantiate()

    def __call__(self, b):
        """The outputs over TIME with the inputs b."""
        fmu = self.fmu
        try:
            fmu.reset()
            fmu.setupExperiment(startTime=TIME[0])
            fmu.enterInitializationMode()
            fmu.setReal(self.inputs, b.tolist())
            fmu.exitInitializationMode()
            rows = [fmu.getReal(self.outputs)]
            for now, then in zip(TIME, TIME[1:]):
                fmu.doStep(currentCommunicationPoint=now, communicationStepSize=then - now)
                rows.append(fmu.getReal(self.outputs))
        except fmpy.fmi1.FMICallException as error:
            raise linkwright.AnalysisError(f"the FMU: {error}") from error
        return dict(zip(self.names, np.array(rows).T))


def problem(simulator):
    """The least peak acceleration with at most 1 m of travel."""
    return linkwright.Problem(
        {
            "k": {"start": 1.0, "lower": 1e-3, "upper": 1.0, "unit": "N/m"},
            "c": {"start": 0.3, "lower": 1e-3, "upper": 1.0, "unit": "N·s/m"},
        },
        {"displacement": "m", "acceleration": "m/s²"},
        simulator,
        objective={
            "minimize": "acceleration",
            "over": "peak",
            "bound": {"name": "peak", "start": 0.85, "lower": 0.0, "unit": "m/s²"},
        },
        constraints={"travel": {"value": "displacement", "at_most": 1.0}},
        time=TIME,
        method="slp",
        name="absorber in an FMU",
    )


def main():
    with tempfile.TemporaryDirectory() as folder:
        path = FmuBuilder.build_FMU(HERE / "absorber_slave.py", dest=folder)
        simulator = Simulator(path, f"{folder}/extracted", ["k", "c"], ["displacement", "acceleration"])
        begun = time.perf_counter()
        result = problem(simulator).optimize()
        print(f"{result}; {result.sensitivity_analyses} sensitivity analyses, {time.perf_counter() - begun:.2f} s")
        # The step of 0.12 s leaves an error of 1e-5 in the motion.
        assert result.success and abs(result.objective - 0.520286) < 1e-3


if __name__ == "__main__":
    main()

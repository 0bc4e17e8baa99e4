"""A mechanism as a component of OpenMDAO, and our methods as a driver."""

import numpy as np
import pytest
from conftest import MODELS

import linkwright

om = pytest.importorskip("openmdao.api")
from linkwright.openmdao import Component, Driver  # noqa: E402


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """OpenMDAO writes folders beside the program."""
    monkeypatch.chdir(tmp_path)


def absorber(driver):
    """The least peak acceleration of the impact absorber, with travel at most 1 m: both constraints at all time points."""
    model = linkwright.Model.from_file(MODELS / "impact-absorber.toml")
    problem = om.Problem(reports=False)
    problem.model.add_subsystem("absorber", Component(model=model), promotes=["*"])
    nt = len(model.time)
    problem.model.add_subsystem(
        "limits",
        om.ExecComp(["up = acceleration - beta", "down = -acceleration - beta"], up=np.ones(nt), down=np.ones(nt), acceleration=np.ones(nt)),
        promotes=["*"],
    )
    problem.model.add_design_var("k", lower=1e-3, upper=1.0)
    problem.model.add_design_var("c", lower=1e-3, upper=1.0)
    problem.model.add_design_var("beta", lower=0.0, upper=2.0)
    problem.model.add_objective("beta")
    problem.model.add_constraint("up", upper=0.0)
    problem.model.add_constraint("down", upper=0.0)
    problem.model.add_constraint("displacement", upper=1.0)
    problem.driver = driver
    problem.setup()
    problem.set_val("beta", 0.85)
    return problem


@pytest.mark.parametrize("name", ["impact-absorber", "rigid-four-bar", "two-bar-truss"])
def test_partials_are_exact(name):
    model = linkwright.Model.from_file(MODELS / f"{name}.toml")
    problem = om.Problem(reports=False)
    problem.model.add_subsystem("mechanism", Component(model=model))
    problem.setup(force_alloc_complex=False)
    problem.run_model()
    checked = problem.check_partials(out_stream=None, form="central", step=1e-6, step_calc="rel_avg")
    assert checked["mechanism"]
    largest = max(np.abs(found["J_fwd"]).max() for found in checked["mechanism"].values())
    for pair, found in checked["mechanism"].items():
        assert np.abs(found["J_fwd"] - found["J_fd"]).max() <= 1e-6 * largest, pair


@pytest.mark.parametrize("driver", [Driver(preset="slp"), Driver(), om.ScipyOptimizeDriver(optimizer="SLSQP", tol=1e-9, disp=False)])
def test_a_mechanism_with_both_drivers(driver):
    problem = absorber(driver)
    result = problem.run_driver()
    assert result.success
    assert problem.get_val("beta")[0] == pytest.approx(0.520286, rel=1e-4)
    if isinstance(driver, Driver):
        assert driver.found.success and len(driver.found.history) > 2


def test_the_paraboloid_of_openmdao():
    """The first example of OpenMDAO's manual: f = −27.3333 at x = 6.6667, y = −7.3333; with 0 ≤ x + y ≤ 10: f = −27 at 7, −7."""
    problem = om.Problem(reports=False)
    problem.model.add_subsystem("parab", om.ExecComp("f = (x-3)**2 + x*y + (y+4)**2 - 3"), promotes=["*"])
    problem.model.add_subsystem("const", om.ExecComp("g = x + y"), promotes=["*"])
    problem.model.set_input_defaults("x", 3.0)
    problem.model.set_input_defaults("y", -4.0)
    problem.driver = Driver()
    problem.model.add_design_var("x", lower=-50, upper=50)
    problem.model.add_design_var("y", lower=-50, upper=50)
    problem.model.add_objective("f")
    problem.model.add_constraint("g", lower=0, upper=10.0)
    problem.setup()
    assert problem.run_driver().success
    assert problem.get_val("f")[0] == pytest.approx(-27.0, rel=1e-5)
    np.testing.assert_allclose([problem.get_val("x")[0], problem.get_val("y")[0]], [7.0, -7.0], atol=2e-2)


def test_the_sellar_problem_of_openmdao():
    """Two coupled disciplines with a solver: f = 3.18339 (OpenMDAO's manual)."""
    from openmdao.test_suite.components.sellar_feature import SellarMDA

    problem = om.Problem(model=SellarMDA(), reports=False)
    problem.driver = Driver(tol=1e-7)
    problem.model.add_design_var("x", lower=0, upper=10)
    problem.model.add_design_var("z", lower=0, upper=10)
    problem.model.add_objective("obj")
    problem.model.add_constraint("con1", upper=0)
    problem.model.add_constraint("con2", upper=0)
    problem.setup()
    problem.set_solver_print(level=-1)
    problem.model.approx_totals()
    assert problem.run_driver().success
    assert problem.get_val("obj")[0] == pytest.approx(3.18339, rel=1e-4)


def test_a_failed_design_and_an_exception():
    class Fragile(om.ExplicitComponent):
        kind = om.AnalysisError

        def setup(self):
            self.add_input("x", 3.0)
            self.add_output("f", 0.0)
            self.declare_partials("f", "x")

        def compute(self, inputs, outputs):
            if inputs["x"][0] < 0.5:
                raise self.kind("below a half")
            outputs["f"] = (inputs["x"] - 0.45) ** 2

        def compute_partials(self, inputs, partials):
            partials["f", "x"] = 2 * (inputs["x"] - 0.45)

    def run(kind):
        problem = om.Problem(reports=False)
        component = Fragile()
        component.kind = kind
        problem.model.add_subsystem("c", component, promotes=["*"])
        problem.model.add_design_var("x", lower=0, upper=5)
        problem.model.add_objective("f")
        problem.driver = Driver(preset="slp-filter", maxiter=30)
        problem.setup()
        problem.run_driver()
        return problem

    problem = run(om.AnalysisError)
    assert problem.get_val("x")[0] >= 0.5
    assert any(isinstance(text, str) for text in problem.driver.found.history["failure"])
    with pytest.raises(ZeroDivisionError):
        run(ZeroDivisionError)


def parabola(driver, constraint, variable):
    """min (x − 10)² subject to limits of g = x."""
    problem = om.Problem(reports=False)
    problem.model.add_subsystem("c", om.ExecComp(["f = (x - 10)**2", "g = 1.0*x"], x=1.0), promotes=["*"])
    problem.model.add_design_var("x", lower=-100, upper=100, **variable)
    problem.model.add_objective("f")
    problem.model.add_constraint("g", **constraint)
    problem.driver = driver
    problem.setup()
    return problem


@pytest.mark.parametrize(
    "constraint, variable, expected",
    [
        ({"upper": 5.0, "ref": 10.0}, {}, 5.0),
        ({"upper": 5.0, "scaler": 1e-3}, {}, 5.0),
        ({"upper": 5.0, "scaler": -2.0}, {}, 5.0),
        ({"lower": 20.0, "upper": 30.0, "ref0": 2.0, "ref": 4.0}, {}, 20.0),
        ({"equals": 5.0, "ref": 10.0}, {}, 5.0),
        ({"upper": 200.0}, {"ref": 1000.0}, 10.0),
        ({"upper": 200.0}, {"scaler": 100.0}, 10.0),
        ({"upper": 200.0}, {"adder": 95.0}, 10.0),
    ],
)
def test_limits_are_scaled_as_values_are(constraint, variable, expected):
    problem = parabola(Driver(), constraint, variable)
    result = problem.run_driver()
    assert result.success
    assert problem.get_val("x")[0] == pytest.approx(expected, abs=1e-4)
    assert problem.driver.found.problem.variable_names == ("x",)


def test_a_driver_needs_one_objective_and_a_variable():
    two = om.Problem(reports=False)
    two.model.add_subsystem("c", om.ExecComp(["f = (x - 3)**2", "g = x**2"], x=1.0), promotes=["*"])
    two.model.add_design_var("x", lower=-9, upper=9)
    two.model.add_objective("f")
    two.model.add_objective("g")
    two.driver = Driver()
    two.setup()
    with pytest.raises(RuntimeError, match="one objective, the model has 2: f, g"):
        two.run_driver()
    for objectives, variables, message in [([], ["x"], "one objective, the model has 0"), (["f"], [], "no design variables")]:
        problem = om.Problem(reports=False)
        problem.model.add_subsystem("c", om.ExecComp("f = (x - 3)**2", x=1.0), promotes=["*"])
        [problem.model.add_design_var(name) for name in variables]
        [problem.model.add_objective(name) for name in objectives]
        problem.driver = Driver()
        problem.setup()
        with pytest.raises(RuntimeError, match=message):
            problem.run_driver()


def test_a_component_has_the_units_of_the_model():
    model = linkwright.Model.from_dict({"design": {"l": {"start": "300 mm"}}, "output": [{"name": "area", "value": "l^2"}]})
    problem = om.Problem(reports=False)
    problem.model.add_subsystem("m", Component(model=model), promotes=["*"])
    problem.setup()
    problem.run_model()
    assert problem.get_val("l")[0] == 300.0
    assert problem.get_val("area")[0] == pytest.approx(0.09)


def test_a_complex_step_is_an_error():
    """It would drop the imaginary part: all derivatives would be zero, and the start would be an optimum."""
    model = linkwright.Model.from_dict(
        {"design": {"x": {"start": 3.0}}, "output": [{"name": "f", "value": "(x - 1)^2 + 2"}], "objective": {"minimize": "f"}}
    )
    problem = om.Problem(reports=False)
    problem.model.add_subsystem("model", Component(model=model), promotes=["*"])
    problem.model.add_design_var("x", lower=-5.0, upper=5.0)
    problem.model.add_objective("f")
    problem.model.approx_totals(method="cs")
    problem.driver = Driver(preset="slp")
    problem.setup(force_alloc_complex=True)
    with pytest.raises(RuntimeError, match="`model` of linkwright has no complex step: use its partials"):
        problem.run_driver()

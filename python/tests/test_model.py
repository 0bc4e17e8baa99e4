"""Models: files, dictionaries, analyses, derivatives, checks, runs, reports, pickles."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from conftest import ABSORBER_OPTIMUM, MODELS

import linkwright

tomllib = pytest.importorskip("tomllib")  # part of Python since 3.11


def test_a_file_a_string_and_a_dictionary_are_the_same_model(absorber):
    text = (MODELS / "impact-absorber.toml").read_text()
    from_string = linkwright.Model.from_string(text)
    from_dict = linkwright.Model.from_dict(tomllib.loads(text))
    assert absorber.fingerprint == from_string.fingerprint == from_dict.fingerprint
    expected = absorber.analyze()
    for other in (from_string, from_dict):
        found = other.analyze()
        for name, values in expected.responses.items():
            np.testing.assert_array_equal(found[name], values)


@pytest.mark.parametrize("path", sorted(MODELS.glob("*.toml")), ids=lambda path: path.stem)
def test_every_example_reads_from_a_dictionary(path):
    text = path.read_text()
    model = linkwright.Model(text)
    assert tomllib.loads(linkwright.Model.from_dict(tomllib.loads(text)).text) == tomllib.loads(text)
    assert pickle.loads(pickle.dumps(model)).fingerprint == model.fingerprint


def test_an_analysis_has_labels(absorber):
    here = absorber.analyze({"k": 0.5, "c": 0.4})
    assert here.variables == ("k", "c", "peak")
    np.testing.assert_array_equal(here.design[:2], [0.5, 0.4])
    assert here.time.shape == here["displacement"].shape == (101,)
    # The motion in closed form.
    w = np.sqrt(0.5 - 0.04)
    np.testing.assert_allclose(here["displacement"], np.exp(-0.2 * here.time) * np.sin(w * here.time) / w, atol=1e-9)
    frame = here.to_pandas()
    assert list(frame.columns) == list(absorber.response_names) and frame.index.name == "time"
    assert here.to_xarray()["displacement"].dims == ("time",)
    np.testing.assert_array_equal(here.to_xarray()["displacement"].values, here["displacement"])


def test_many_designs_are_analysed_in_one_call(absorber):
    random = np.random.default_rng(1)
    designs = random.uniform([0.1, 0.1, 0.1], [1.0, 1.0, 1.0], (17, 3))
    all = absorber.analyze_many(designs)
    for i, design in enumerate(designs):
        one = absorber.analyze(design)
        assert all.objective[i] == one.objective and all.violation_pct[i] == one.violation_pct
        np.testing.assert_array_equal(all.responses["acceleration"][i], one["acceleration"])
        np.testing.assert_array_equal(all.constraints["displacement upper"][i], one.constraints["displacement upper"])
    assert all.failures == [None] * 17 and len(all) == 17
    assert list(all.to_pandas()["k"]) == list(designs[:, 0])
    assert all.to_xarray()["acceleration"].shape == (17, 101)


def test_derivatives_agree_between_methods_and_have_labels():
    model = linkwright.Model.from_file(MODELS / "rigid-four-bar.toml")
    exact = model.sensitivities()
    assert {"direct", "adjoint"} <= set(model.gradient_methods)
    for method, tolerance in [("direct", 1e-7), ("adjoint", 1e-7), ("central", 1e-4), ("noise-aware", 1e-4)]:
        other = model.sensitivities(method=method)
        largest = max(np.abs(values).max() for values in exact.values.values())
        for name, values in exact.values.items():
            np.testing.assert_allclose(other[name], values, atol=tolerance * largest, err_msg=method)
    name = model.response_names[0]
    only = model.sensitivities(responses=[name])
    assert list(only.values) == [name] and only[name].shape == (len(model.time), len(model.variables))
    # For few responses the analysis may choose another exact method.
    np.testing.assert_allclose(only[name], exact[name], atol=1e-7 * largest)
    frame = exact.to_pandas()
    variable = model.variable_names[1]
    np.testing.assert_array_equal(frame[name, variable], exact[name][:, 1])
    np.testing.assert_array_equal(exact.to_xarray()[name].sel(variable=variable), exact[name][:, 1])


def test_check_and_compare(formula):
    check = formula.check(points=3)
    assert check.ok and "by" in str(check) and len(check.to_pandas()) == len(check.rows)
    comparison = formula.compare(["slp", "gcmma", "automatic"])
    assert {row["method"] for row in comparison.rows} == {"slp", "gcmma", "automatic"}
    for row in comparison.rows:
        assert row["status"] == "converged" and row["objective"] == pytest.approx(ABSORBER_OPTIMUM, rel=1e-4)
    assert comparison.rows[0]["analyses"] <= comparison.rows[1]["analyses"] + comparison.rows[1]["sensitivity_analyses"]


def test_an_optimization_and_its_history(absorber):
    seen = []
    result = absorber.optimize(callback=seen.append)
    # 6 + 5 in Table I of the paper; one more confirms the end.
    assert result.success and (result.analyses, result.sensitivity_analyses) == (6, 6)
    assert result.objective == pytest.approx(ABSORBER_OPTIMUM, abs=1e-6)
    history = result.history
    assert len(history) == len(seen) == 6 and [c.cycle for c in seen] == list(history["cycle"])
    assert [c.objective for c in seen] == list(history["objective"])
    np.testing.assert_array_equal(history[["k", "c", "peak"]].to_numpy()[-1], result.design)
    name, time, multiplier = result.multipliers[0]
    assert name in absorber.constraint_names and 0 <= time <= 12 and multiplier > 0
    np.testing.assert_array_equal(result.responses["displacement"], absorber.analyze(result.design)["displacement"])


def test_methods_by_name_and_by_dictionary(formula):
    assert "gcmma" in linkwright.methods()
    short = formula.optimize({"preset": "gcmma", "max_cycles": 2})
    assert short.status == "cycle limit" and short.cycles <= 2
    whole = formula.optimize("gcmma")
    continued = formula.optimize("gcmma", resume=short)
    np.testing.assert_array_equal(continued.design, whole.design)
    with pytest.raises(linkwright.ModelError, match="did you mean `gcmma`"):
        formula.optimize("gcma")
    with pytest.raises(linkwright.ModelError, match="acuracy"):
        formula.optimize({"preset": "slp", "acuracy": 1e-3})


def test_the_automatic_method_continues_with_the_same_bits(formula):
    short = formula.optimize({"preset": "automatic", "max_cycles": 2})
    assert short.status == "cycle limit"
    continued = formula.optimize("automatic", resume=pickle.loads(pickle.dumps(short)))
    np.testing.assert_array_equal(continued.design, formula.optimize("automatic").design)


def test_report_figures_and_notebook_forms(absorber, tmp_path):
    result = absorber.optimize()
    page = result.report(tmp_path / "report.html")
    assert page.startswith("<!DOCTYPE html>") and (tmp_path / "report.html").read_text() == page
    assert "Mechanism" in page and "<iframe" in page._repr_html_()
    assert "convergence" in result.figures
    figure = result.figures["convergence"]
    assert "<svg" in figure._repr_svg_()
    figure.save(tmp_path / "figure.svg")
    assert (tmp_path / "figure.svg").read_text() == figure.svg
    notebook = result._repr_html_()
    assert "converged" in notebook and "<svg" in notebook and "N/m" in notebook
    assert "Design space" in result.report(slice=3)


def test_everything_pickles(absorber):
    result = absorber.optimize()
    copy = pickle.loads(pickle.dumps(result))
    assert copy.status == result.status and copy.history.equals(result.history)
    assert copy.report() == result.report()
    for value in (absorber.analyze(), absorber.sensitivities(), absorber.check(points=1), absorber.compare(["slp"])):
        assert type(pickle.loads(pickle.dumps(value))) is type(value)
    for error in (linkwright.AnalysisError("why"), linkwright.ModelError("what")):
        assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_an_objective_that_is_maximized_keeps_its_sign():
    model = linkwright.Model.from_dict(
        {
            "design": {"x": {"start": 1.0, "lower": 0.5, "upper": 4.0}},
            "objective": {"maximize": "4*x - x^2"},
        }
    )
    assert model.analyze([3.0]).objective == 3.0
    result = model.optimize("automatic")
    assert result.objective == pytest.approx(4.0, rel=1e-6) and list(result.history["objective"])[0] == 3.0
    assert model.compare(["automatic"]).rows[0]["objective"] == pytest.approx(4.0, rel=1e-6)


@pytest.mark.parametrize(
    ("design", "message"),
    [
        ([1.0, 2.0], r"shape \(2,\), expected \(3,\)"),
        (np.ones((3, 1)), r"shape \(3, 1\)"),
        ([1.0, np.nan, 1.0], "`c` is nan"),
        (["a", "b", "c"], "real numbers"),
        ([1j, 1, 1], "real numbers"),
        ([[1], [1, 2]], "the design"),
        ({"kk": 1.0}, "no design variable `kk`"),
    ],
)
def test_wrong_designs_are_named(formula, design, message):
    with pytest.raises(linkwright.DefinitionError, match=message):
        formula.analyze(design)


def test_wrong_arguments_are_named(formula):
    with pytest.raises(linkwright.DefinitionError, match="no response `speed`"):
        formula.sensitivities(responses=["speed"])
    with pytest.raises(linkwright.DefinitionError, match="method of derivatives"):
        formula.sensitivities(method="adjoin")
    with pytest.raises(linkwright.DefinitionError, match=r"expected \(m, 3\)"):
        formula.analyze_many(np.ones((4, 2)))
    with pytest.raises(linkwright.DefinitionError, match="`c` of design 1 is nan"):
        formula.analyze_many([[1.0, 1.0, 1.0], [1.0, np.nan, 1.0]])
    with pytest.raises(linkwright.DefinitionError, match="no response `speed`"):
        formula.analyze()["speed"]
    # Outside the bounds: an analysis is possible, a run from there is not.
    with pytest.raises(linkwright.DefinitionError, match="bounds"):
        formula.optimize(start=[5.0, 0.3, 1.0])


def test_a_wrong_model_shows_its_line(tmp_path):
    path = tmp_path / "model.toml"
    path.write_text("version = 2\n[design.k]\nstrt = 1.0\n[objective]\nminimize = \"k\"\n")
    with pytest.raises(linkwright.ModelError, match=r"model\.toml:3") as caught:
        linkwright.Model.from_file(path)
    assert "did you mean `start`" in str(caught.value)
    with pytest.raises(linkwright.DefinitionError, match="omit the key"):
        linkwright.Model.from_dict({"design": {"k": {"start": None}}})
    with pytest.raises(linkwright.DefinitionError, match="dictionary"):
        linkwright.Model.from_dict([1])
    with pytest.raises(FileNotFoundError):
        linkwright.Model.from_file(tmp_path / "missing.toml")


def test_values_of_numpy_and_strange_texts_survive_a_dictionary():
    model = linkwright.Model.from_dict(
        {
            "title": 'a "title" with \\ and \t and \x7f and é',
            "design": {"x": {"start": np.float32(0.5), "lower": np.array(0.0), "upper": np.int64(4)}},
            "time": {"at": np.linspace(0, 1, 3)},
            "output": [{"name": "y", "value": "x*time"}],
            "objective": {"minimize": "y", "over": "sum"},
        }
    )
    assert model.title == 'a "title" with \\ and \t and \x7f and é'
    np.testing.assert_array_equal(model.analyze()["y"], [0.0, 0.25, 0.5])


def test_points_of_a_sweep_are_in_its_unit():
    model = linkwright.Model.from_dict(
        {
            "design": {"x": {"start": 2.0, "lower": 0.0, "upper": 4.0}},
            "sweep": {"variable": "lift", "from": "-80 mm", "to": "80 mm", "points": 9},
            "output": [{"name": "y", "value": "x*lift"}],
            "objective": {"minimize": "y", "over": "sum"},
        }
    )
    lift = np.linspace(-80.0, 80.0, 9)
    np.testing.assert_allclose(model.time, lift)
    for result in (model.analyze(), model.sensitivities()):
        frame = result.to_pandas()
        assert frame.index.name == "lift" and result.to_xarray()["y"].dims[0] == "lift"
        np.testing.assert_allclose(frame.index, lift)
    np.testing.assert_allclose(model.analyze()["y"], 2e-3 * lift)
    assert model.check(points=9).rows[0]["time"] == pytest.approx(-80.0)


def test_the_package_is_typed():
    package = Path(linkwright.__file__).parent
    assert (package / "py.typed").exists() and (package / "_core.pyi").exists()

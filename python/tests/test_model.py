"""Models: files, dictionaries, analyses, derivatives, checks, runs, reports, pickles."""

import json
import os
import pickle
import subprocess
import sys
import time
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
    assert model.title == 'a "title" with \\ and \\u0009 and \\u007f and é'
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


SQUARES = {"design": {"c": {"start": 0.3}, "k": {"start": 1.0}}, "output": [{"name": "r", "value": "10*c + k"}]}
SQUARES_PROBLEM = {**SQUARES, "objective": {"minimize": "r"}}


def test_designs_of_pandas_are_matched_by_name():
    pandas = pytest.importorskip("pandas")
    model = linkwright.Model.from_dict({**SQUARES_PROBLEM, "design": {"k": {"start": 1.0}, "c": {"start": 0.3}}})
    assert model.variable_names == ("k", "c")
    series = pandas.Series({"c": 0.5, "k": 2.0})
    assert model.analyze(series)["r"] == model.analyze({"c": 0.5, "k": 2.0})["r"] == 7.0
    assert model.analyze(pandas.Series([2.0, 0.5]))["r"] == 7.0
    frame = pandas.DataFrame({"c": [0.5, 0.1], "note": ["a", "b"], "k": [2.0, 3.0]})
    np.testing.assert_array_equal(model.analyze_many(frame).responses["r"], [7.0, 4.0])
    again = model.analyze_many(model.analyze_many(frame).to_pandas())
    np.testing.assert_array_equal(again.responses["r"], [7.0, 4.0])
    with pytest.raises(linkwright.DefinitionError, match="no column `k`"):
        model.analyze_many(frame[["c"]])
    with pytest.raises(linkwright.DefinitionError, match="no design variable `d`"):
        model.analyze(pandas.Series({"d": 0.5}))


def test_designs_with_masked_or_logical_values_are_refused():
    model = linkwright.Model.from_dict(SQUARES_PROBLEM)
    with pytest.raises(linkwright.DefinitionError, match="masked"):
        model.analyze(np.ma.array([0.3, 1.0], mask=[True, False]))
    for design in ({"k": True}, [True, 0.5]):
        with pytest.raises(linkwright.DefinitionError, match="real numbers"):
            model.analyze(design)


def test_tables_have_the_responses_that_are_numbers():
    pytest.importorskip("pandas")
    model = linkwright.Model.from_dict(SQUARES_PROBLEM)
    assert model.analyze().to_pandas().to_dict("list") == {"r": [4.0]}
    assert model.sensitivities().to_pandas().to_dict("list") == {("r", "c"): [10.0], ("r", "k"): [1.0]}
    mixed = linkwright.Model.from_dict(
        {**SQUARES_PROBLEM, "time": {"to": 1.0, "points": 3}, "output": [*SQUARES["output"], {"name": "h", "value": "k*time"}]}
    )
    frame = mixed.analyze().to_pandas()
    assert frame.to_dict("list") == {"r": [4.0, 4.0, 4.0], "h": [0.0, 0.5, 1.0]}
    assert frame.index.tolist() == [0.0, 0.5, 1.0]
    assert mixed.sensitivities().to_pandas()["r", "c"].tolist() == [10.0, 10.0, 10.0]


def test_a_model_without_an_objective_is_a_simulation():
    model = linkwright.Model.from_dict(SQUARES)
    here = model.analyze({"c": 0.1})
    assert here["r"] == 2.0 and np.isnan(here.objective) and here.constraints == {}
    np.testing.assert_array_equal(model.sensitivities()["r"], [10.0, 1.0])
    many = model.analyze_many([[0.1, 1.0], [0.2, 1.0]])
    np.testing.assert_array_equal(many.responses["r"], [2.0, 3.0])
    assert np.isnan(many.objective).all() and pickle.loads(pickle.dumps(model)).analyze()["r"] == 4.0
    for run in (model.optimize, model.compare):
        with pytest.raises(linkwright.DefinitionError, match="there is no objective; add"):
            run()
    study = linkwright.Study({"kind": "grid", "vary": {"c": {"from": 0.0, "to": 0.2, "points": 3}}}, model)
    assert study.run().table()["r"] == [1.0, 2.0, 3.0]


def test_a_model_of_several_files(tmp_path):
    (tmp_path / "t.csv").write_text("x,y\n0,0\n1,10\n")
    (tmp_path / "c.toml").write_text('[constants]\nfactor = 2.0\n')
    text = (
        'version = 2\ninclude = "c.toml"\n[design.a]\nstart = 0.5\nlower = 0\nupper = 1\n[table.f]\nfile = "t.csv"\ninterpolation = "linear"\n'
        '[[output]]\nname = "r"\nvalue = "factor*f(a)"\n[objective]\nminimize = "r"\n'
    )
    (tmp_path / "m.toml").write_text(text)
    model = linkwright.Model.from_file(tmp_path / "m.toml")
    assert model.analyze()["r"] == 10.0 and pickle.loads(pickle.dumps(model)).analyze()["r"] == 10.0
    (tmp_path / "s.toml").write_text('version = 1\nmodel = "m.toml"\nkind = "grid"\n[vary.a]\nfrom = 0\nto = 1\npoints = 3\n')
    assert linkwright.Study.from_file(tmp_path / "s.toml").run().table()["objective"] == [0.0, 10.0, 20.0]


PROGRAM = """
import json, sys
for line in sys.stdin:
    request = json.loads(line)
    x = request["design"]["x"]
    print(json.dumps({"id": request["id"], "responses": {"f": (x - 2) ** 2}}), flush=True)
"""


def program(folder, command):
    (folder / "program.py").write_text(PROGRAM)
    text = (
        f'version = 2\n[analysis]\nkind = "program"\ncommand = {json.dumps(command)}\nderivatives = "central"\n[design.x]\nstart = 1.0\nlower = 0.0\n'
        'upper = 5.0\n[[output]]\nname = "f"\nprogram = "number"\n[objective]\nminimize = "f"\n'
    )
    (folder / "m.toml").write_text(text)
    (folder / "s.toml").write_text('version = 1\nmodel = "m.toml"\nkind = "grid"\n[vary.x]\nfrom = 0\nto = 2\npoints = 3\n')
    return folder / "m.toml"


def test_a_program_runs_only_if_that_is_allowed(tmp_path):
    path = program(tmp_path, [sys.executable, "program.py"])
    model = linkwright.Model.from_file(path)
    rows = tmp_path / "rows.jsonl"
    study = linkwright.Study.from_file(tmp_path / "s.toml")
    for run in (model.analyze, model.optimize, lambda: model.analyze_many([[1.0]]), lambda: study.run(file=rows)):
        with pytest.raises(linkwright.DefinitionError, match="allow_programs=True"):
            run()
    assert len(rows.read_text().splitlines()) == 1, "the header only"
    model = linkwright.Model.from_file(path, allow_programs=True)
    assert model.optimize().design[0] == pytest.approx(2.0, abs=1e-4)
    assert pickle.loads(pickle.dumps(model)).analyze()["f"] == 1.0
    study = linkwright.Study.from_file(tmp_path / "s.toml", allow_programs=True)
    assert study.run(file=rows).table()["objective"] == [4.0, 1.0, 0.0]
    assert pickle.loads(pickle.dumps(study)).run(1).table()["objective"] == [4.0, 1.0, 0.0]


def test_a_program_that_cannot_be_started_ends_a_study_without_rows(tmp_path):
    program(tmp_path, ["./missing"])
    study = linkwright.Study.from_file(tmp_path / "s.toml", allow_programs=True)
    with pytest.raises(linkwright.DefinitionError, match="the program cannot be started"):
        study.run(file=tmp_path / "rows.jsonl")
    (tmp_path / "missing").write_text(f"#!{sys.executable}\n{PROGRAM}")
    (tmp_path / "missing").chmod(0o755)
    study = linkwright.Study.from_file(tmp_path / "s.toml", allow_programs=True)
    assert study.run(file=tmp_path / "rows.jsonl").table()["objective"] == [4.0, 1.0, 0.0]


def test_ctrl_c_ends_the_analysis_of_many_designs():
    code = (
        "import sys, threading, time, os, signal, numpy, linkwright\n"
        "model = linkwright.Model.from_file(sys.argv[1])\n"
        "designs = numpy.tile(model.start, (1_000_000, 1))\n"
        "designs[:, 0] = numpy.linspace(0.3, 0.6, len(designs))\n"
        "threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()\n"
        "try:\n    model.analyze_many(designs)\nexcept KeyboardInterrupt:\n    print('interrupted')\n"
    )
    begun = time.monotonic()
    done = subprocess.run([sys.executable, "-c", code, str(MODELS / "impact-absorber.toml")], capture_output=True, text=True, timeout=200)
    assert done.stdout.strip() == "interrupted", done.stderr
    assert time.monotonic() - begun < 30


def test_files_that_cannot_be_read_are_named(tmp_path):
    for read in (linkwright.Model.from_file, linkwright.Study.from_file):
        with pytest.raises(FileNotFoundError, match="absent.toml"):
            read(tmp_path / "absent.toml")
        (tmp_path / "image.toml").write_bytes(b"\x89PNG\xff\xfe")
        with pytest.raises(linkwright.DefinitionError, match="image.toml is not a text"):
            read(tmp_path / "image.toml")
    assert linkwright.Model.from_file(os.fsencode(MODELS / "impact-absorber.toml")).title


def test_arguments_are_checked():
    model = linkwright.Model.from_dict(SQUARES_PROBLEM | {"constraint": [{"name": "g", "value": "r", "at_least": 1.0}]})
    other = linkwright.Model.from_dict(SQUARES_PROBLEM | {"constraint": [{"name": "g", "value": "r", "at_least": 2.0}]})
    result = model.optimize({"preset": "slp", "max_cycles": 1})
    assert [row["method"] for row in model.compare("slp").rows] == ["slp"]
    for call, message in [
        (lambda: model.sensitivities(method=3), "is a name"),
        (lambda: model.compare([1]), "names of methods"),
        (lambda: model.check(points=None), "`points` is a whole number"),
        (lambda: model.check(points=2.5), "`points` is a whole number"),
        (lambda: model.check(points=10**30), "`points` is a whole number from 1 to 1000"),
        (lambda: result.report(slice=-1), "`slice` is a whole number"),
        (lambda: result.report(slice=10**5), "`slice` is a whole number from 0 to 101"),
        (lambda: model.optimize(resume=result, start=[1.0, 1.0]), "give `resume` or `start`"),
        (lambda: model.optimize(resume=3), "`resume` is a result"),
        (lambda: other.optimize(resume=result), "constraint `g` has the limit 2 instead of 1"),
    ]:
        with pytest.raises(linkwright.DefinitionError, match=message):
            call()
    assert len(model.optimize("slp", lambda cycle: np.bool_(True)).history["cycle"]) == 1


def test_results_have_short_forms(absorber):
    for result in (absorber.analyze(), absorber.sensitivities(), absorber.analyze_many([absorber.start]), absorber.check(points=1)):
        assert len(repr(result)) < 1500 and "array(" not in repr(result)
        assert result._repr_html_().startswith("<p>")
    assert "acceleration: 101 values" in repr(absorber.analyze())


def test_variables_with_names_of_columns():
    model = linkwright.Model.from_dict(
        {
            "design": {"cycle": {"start": 3.0, "lower": 0.0, "upper": 9.0}, "failure": {"start": 1.0, "lower": 0.0, "upper": 9.0}},
            "output": [{"name": "r", "value": "(cycle - 1)^2 + failure"}],
            "objective": {"minimize": "r"},
        }
    )
    history = model.optimize("slp").history
    assert list(history["cycle"])[:2] == [0, 1] and history["design.cycle"][0] == 3.0 and history["design.failure"][0] == 1.0
    many = model.analyze_many([[1.0, 2.0]]).to_pandas()
    assert many["cycle"][0] == 1.0 and many["failure"][0] is None and many["design.failure"][0] == 2.0

"""The package: stubs, figures and notebooks."""

import json
import os
import pathlib
import subprocess
import sys

import pytest

import tandem

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples" / "python"


def test_figures_of_any_result():
    pytest.importorskip("matplotlib").use("Agg")
    estimate = tandem.estimate("docking_a", max_keyframes=60)
    plan = tandem.plan("docking_a", at=600)
    rendezvous = tandem.rendezvous(duration=10)
    for drawn in (estimate, plan, rendezvous, estimate.target):
        assert tandem.plot.trajectories(drawn).lines
    assert tandem.plot.residuals(estimate).get_xticks() is not None
    functions = [getattr(tandem.plot, name) for name in
                 ("trajectories", "errors", "residuals", "consistency", "coverage", "sparsity", "plan")]
    for function in functions:
        for thing in (estimate, plan, rendezvous, estimate.target, tandem.models, 5, None):
            try:
                function(thing)
            except tandem.BadInputError as error:
                assert str(error).startswith("plot.") and "\n" not in str(error)
    with pytest.raises(tandem.BadInputError, match="no column z_km"):
        tandem.plot.errors(estimate, columns=["z_km"])


def test_public_names_have_docstrings():
    for name in dir(tandem):
        thing = getattr(tandem, name)
        if not name.startswith("_") and not isinstance(thing, type(sys)) and callable(thing):
            assert thing.__doc__, name
            members = vars(thing).items() if isinstance(thing, type) else ()
            for key, member in members:
                if isinstance(member, property) and not key.startswith("_"):
                    assert member.__doc__, f"{name}.{key}"


def test_stubs_agree_with_the_package():
    pytest.importorskip("mypy")
    output = subprocess.run([sys.executable, "-m", "mypy.stubtest", "tandem._core", "--concise"],
                            capture_output=True, text=True)
    # Stubs cannot express the metaclass of pybind11's classes.
    errors = [line for line in output.stdout.splitlines() if not line.endswith("metaclass differs")]
    assert not errors, "\n".join(errors)


def test_types_of_the_package():
    pytest.importorskip("mypy")
    output = subprocess.run([sys.executable, "-m", "mypy", "-p", "tandem"], capture_output=True, text=True)
    assert output.returncode == 0, output.stdout[-3000:]


def test_types_of_problems_follow_the_groups(tmp_path):
    pytest.importorskip("mypy")
    file = tmp_path / "use.py"
    file.write_text("""
from typing import Any, List
import numpy as np
import tandem
from tandem import SE3, R3, Problem, Variable

p = Problem()
x = p.add(SE3.identity(5), "x")
one: Variable[SE3] = x[0]
p.minimize(tandem.Prior(SE3()), [1.0] * 6, x)
p.minimize(tandem.RelativePose(SE3()), tandem.Gaussian(np.ones(6)), [x[:-1], x[1:]], tandem.Huber(1.0))
p.subject_to(tandem.residual(lambda v: v, dim=1), tandem.at_most(1.0), p.add(R3()))
translation: np.ndarray[Any, Any] = p.value(x).translation
rows: np.ndarray[Any, Any] = tandem.Prior(SE3())(SE3())
names: List[str] = p.solve(max_iterations=3).violated_constraints
p.value(p["x 0"]).rotation
wrong = [
    p.value(x).vector,
    p.add(3.0),
    p.set_value(x, R3()),
    p.minimize(SE3(), 1.0, x),
    p.minimize(tandem.Prior(SE3()), 1.0, 5),
    SE3().minus(SE3()).translation,
    p.set_residual(x, tandem.Prior(SE3())),
]
""")
    output = subprocess.run([sys.executable, "-m", "mypy", "--strict", file], capture_output=True, text=True)
    lines = [int(line.split("use.py:")[1].split(":")[0]) for line in output.stdout.splitlines() if "use.py:" in line]
    first = file.read_text().splitlines().index("wrong = [") + 2
    assert sorted(set(lines)) == list(range(first, first + 7)), output.stdout


def test_figures(docking, tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.text  # type: ignore[import]
    plan = tandem.plan("docking_a", at=600)
    p = tandem.Problem()
    x = p.add(tandem.R1([[0.0], [1.0]]), "x")
    p.minimize(tandem.RelativePose(tandem.R1([1.0])), 1.0, [x[0], x[1]])
    for name, ax in {"trajectories": tandem.plot.trajectories(docking), "errors": tandem.plot.errors(docking),
                     "residuals": tandem.plot.residuals(docking.fit), "consistency": tandem.plot.consistency(docking),
                     "coverage": tandem.plot.coverage(docking), "sparsity": tandem.plot.sparsity(p),
                     "plan": tandem.plot.plan(plan)}.items():
        tandem.plot.save(ax, tmp_path / f"{name}.png", dpi=100)
        content = (tmp_path / f"{name}.png").read_bytes()
        assert len(content) > 1000 and int.from_bytes(content[16:20], "big") == 350  # 3.5 in: one column
        figure = (ax[0] if hasattr(ax, "__len__") else ax).figure
        figure.canvas.draw()  # creates the texts of ticks
        texts = [text for text in figure.findobj(matplotlib.text.Text) if text.get_text()]
        assert texts and {text.get_fontsize() for text in texts} == {8}


def test_import_loads_no_library_but_numpy():
    """Each would slow down the import, whose time scripts/benchmarks measures."""
    def loaded(module):
        code = f"import sys, {module}; print(*{{name.partition('.')[0] for name in sys.modules}})"
        names = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()
        return set(names) - set(sys.stdlib_module_names)

    assert loaded("tandem") - loaded("numpy") == {"tandem"}


def test_memory_of_many_runs_is_flat():
    import resource
    for _ in range(3):
        tandem.estimate("docking_a", max_keyframes=20)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(30):
        tandem.estimate("docking_a", max_keyframes=20)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 4096  # kB


@pytest.mark.parametrize("notebook", sorted(EXAMPLES.glob("*.ipynb")), ids=lambda p: p.stem)
def test_notebooks(notebook, tmp_path):
    pytest.importorskip("nbconvert")
    pytest.importorskip("ipykernel")
    output = subprocess.run(
        [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", "--output-dir", tmp_path, notebook],
        capture_output=True, text=True, env={**os.environ, "JUPYTER_DATA_DIR": str(tmp_path / "jupyter"), "MPLBACKEND": "Agg",
                                             "IPYTHONDIR": str(tmp_path / "ipython")})
    assert output.returncode == 0, output.stderr[-3000:]
    cells = json.loads((tmp_path / notebook.name).read_text())["cells"]
    assert any(cell.get("outputs") for cell in cells)


def test_public_names_are_exported():
    public = {name for name in dir(tandem) if not name.startswith("_")
              and (not isinstance(getattr(tandem, name), type(sys)) or name in ("plot", "testing"))}
    assert public | {"__version__"} == set(tandem.__all__)

"""Solves and covariances: failures, interrupts and the exit of the interpreter."""

import pickle
import subprocess
import sys
import time
import warnings

import numpy as np
import pytest

import tandem
from tandem import R1, SE3


def test_failed_solves_warn_and_have_no_multipliers():
    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    p.minimize(tandem.Prior(R1([2.0])), 1.0, x)
    bound = p.subject_to(tandem.Prior(R1([0.0])), tandem.at_most(1.0), x)
    with pytest.raises(tandem.NumericalError, match="not been solved"):
        p.multipliers(bound)
    with pytest.warns(tandem.IncompleteWarning, match="max-iterations"):
        summary = p.solve(max_iterations=0)
    assert summary.message in repr(summary)
    with pytest.raises(tandem.NumericalError, match="did not converge"):
        p.copy().multipliers(bound)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert p.solve().converged
    assert p.multipliers(bound) == pytest.approx([1.0]) and p.copy().multipliers(bound) == pytest.approx([1.0])
    p.subject_to(tandem.Prior(R1([0.0])), tandem.at_least(2.0), x)
    with pytest.warns(tandem.IncompleteWarning):
        p.solve()
    with pytest.raises(tandem.NumericalError, match="did not converge"):
        p.multipliers(bound)
    for options in (dict(max_iterations=-2), dict(time_limit=-1.0), dict(time_limit=np.nan)):
        with pytest.raises(tandem.BadInputError, match="negative"):
            p.solve(**options)


@pytest.mark.parametrize("jacobian", ["difference", "complex", "given"])
@pytest.mark.parametrize("solver", ["gauss-newton", "augmented-lagrangian", "ipopt"])
def test_a_residual_that_becomes_undefined_for_good_never_converges(jacobian, solver):
    for defined in range(1, 12):
        calls = []

        def rows(x, jacobians=False):
            calls.append(1)
            value = np.exp(x) - 5 if len(calls) <= defined else np.array([np.nan])
            return (value, [np.exp(x)[None]]) if jacobians else value

        p = tandem.Problem()
        x = p.add(R1([60.0]), "x")
        p.minimize(tandem.residual(rows, dim=1, name="rows", jacobian=jacobian), 1.0, x)
        with pytest.warns(tandem.IncompleteWarning):
            assert p.solve(solver).status == "failed"
        assert np.isfinite(p.value(x).vector).all()


def test_infeasible_problems_name_all_violated_constraints():
    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    y = p.add(R1([[0.0], [0.0], [5.0]]), "y")
    p.minimize(tandem.Prior(R1([0.0])), 1.0, y)
    p.subject_to(tandem.Prior(R1([0.0])), tandem.at_least(1.0), x)
    p.subject_to(tandem.Prior(R1([0.0])), tandem.at_most(-2.0), x)
    p.subject_to(tandem.Prior(R1([0.0])), tandem.at_most(6.0), y[2])
    p.fix(y)
    p.subject_to(tandem.RelativePose(R1([0.0])), tandem.between(-0.5, 0.5), [y[0], y[2]])
    for solver in ("augmented-lagrangian", "ipopt"):
        with pytest.warns(tandem.IncompleteWarning):
            summary = p.solve(solver)
        assert summary.status == "infeasible"
        assert summary.violated_constraints[0] == summary.worst_constraint == "relative pose of y 0, y 2"
        assert sorted(summary.violated_constraints[1:]) == ["prior of x", "prior of x"]  # x = 0 violates both
        with pytest.raises(tandem.InfeasibleError) as raised:
            summary.require_converged()
        assert list(raised.value.constraints) == summary.violated_constraints
    p.fix(y, False)
    for solver in ("augmented-lagrangian", "ipopt"):
        with pytest.warns(tandem.IncompleteWarning):
            summary = p.solve(solver)
        assert summary.status == "infeasible" and summary.violated_constraints == ["prior of x"] * 2
        assert pickle.loads(pickle.dumps(summary)).violated_constraints == summary.violated_constraints
    q = tandem.Problem()
    q.subject_to(tandem.Prior(R1([0.0])), tandem.at_least(1.0), q.add(R1([0.0]), "x"))
    assert q.solve().violated_constraints == []


def test_unobservable_directions_that_are_not_named_are_counted():
    p = tandem.Problem()
    x = p.add(tandem.R3.identity(20), "x")
    p.minimize(tandem.Prior(tandem.R3([1, 2, 3])), 1.0, x[0])
    p.minimize(tandem.RelativePose(tandem.R3([1, 0, 0])), 1.0, [x[1], x[2]])
    p.minimize(tandem.Range(1.0), 1.0, [p.add(tandem.R3([0, 0, 1]), "origin"), x[3]])
    found = p.solve().unobservable
    named = sum(len(directions) for name, directions in found.items() if name != "others")
    count = 3 + 5 + 3 * 16  # the pair, the range and the free variables
    assert found["others"] == [f"up to {count - 6} further directions"] and 6 <= named < 12
    q = tandem.Problem()
    q.minimize(tandem.RelativePose(tandem.R3([1, 0, 0])), 1.0, [q.add(tandem.R3(), "a"), q.add(tandem.R3(), "b")])
    assert set(q.solve().unobservable) == {"a", "b"}


def test_marginals_far_from_the_minimum_are_not_much_slower():
    n = 3000
    p = tandem.Problem()
    x = p.add(SE3.identity(n), "x")
    p.minimize(tandem.Prior(SE3()), 1.0, x[0])
    steps = SE3.exp(np.random.default_rng(0).normal(size=(n - 1, 6)) * 0.1)
    p.minimize(tandem.RelativePose(steps), 0.1, [x[:-1], x[1:]])

    def seconds():
        start = time.process_time()
        tandem.Marginals(p)
        return time.process_time() - start

    far = min(seconds() for _ in range(2))
    p.solve()
    assert far < 6 * min(seconds() for _ in range(2)) + 0.05


def test_interrupts_end_marginals():
    script = (
        "import os, signal, threading, time, numpy as np, tandem\n"
        "from tandem import R3, Problem, Prior, RelativePose\n"
        "n = 60000\np = Problem()\nx = p.add(R3(np.zeros((n, 3))))\n"
        "p.minimize(RelativePose(R3(np.ones((n - 1, 3)))), 1.0, [x[:-1], x[1:]])\n"
        "threading.Timer(0.02, lambda: os.kill(os.getpid(), signal.SIGINT)).start()\n"
        "try:\n    tandem.Marginals(p)\nexcept KeyboardInterrupt:\n    print('interrupted')\n"
        "else:\n    print('complete')\n"
        "print(tandem.Marginals(p) is not None)\n")
    output = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert output.stdout.split() == ["interrupted", "True"], output.stderr


def test_exit_while_a_thread_estimates_online():
    script = (
        "import threading, time, tandem\n"
        "estimator = tandem.OnlineEstimator('docking_a')\n"
        "def work():\n"
        "    for t in range(10**6):\n"
        "        estimator.add('odometry', [t, t, 0, 0, 0, 0, 0, 1])\n"
        "        estimator.add('usbl', [t, 10, 2, 1])\n"
        "threading.Thread(target=work, daemon=True).start()\n"
        "time.sleep(0.3)\nprint('end', flush=True)\n")
    output = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert output.returncode == 0 and output.stdout == "end\n", output.stderr


@pytest.mark.parametrize("residual", ["tandem.residual(slow, dim=2)", "tandem.Prior(tandem.R2([1.0, 1.0]))"])
@pytest.mark.parametrize("end", ["", "raise SystemExit(0)"])
def test_exit_while_a_thread_solves(residual, end):
    script = (
        "import threading, time, numpy as np, tandem\n"
        "def slow(y):\n    time.sleep(0.001)\n    return np.array([1 - y[0], 10 * (y[1] - y[0] ** 2)])\n"
        "def work():\n"
        "    while True:\n"
        "        p = tandem.Problem()\n"
        "        x = p.add(tandem.R2(np.full((300, 2), 3.0)))\n"
        f"        p.minimize({residual}, 1.0, x)\n"
        "        p.solve()\n"
        "threading.excepthook = lambda _: None\n"
        "for _ in range(3):\n    threading.Thread(target=work, daemon=True).start()\n"
        f"time.sleep(0.3)\nprint('end', flush=True)\n{end}\n")
    output = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert output.returncode == 0 and output.stdout == "end\n", output.stderr


@pytest.mark.parametrize("made", ["tandem.FixedLag(window=4.0)", "tandem.Problem()"])
def test_exit_while_an_object_is_alive(made):
    output = subprocess.run([sys.executable, "-c", f"import tandem\nkept = {made}\nprint('end')"],
                            capture_output=True, text=True, timeout=30)
    assert output.returncode == 0 and output.stdout == "end\n", output.stderr


def test_refused_options_keep_the_multipliers():
    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    p.minimize(tandem.Prior(R1([2.0])), 1.0, x)
    bound = p.subject_to(tandem.Prior(R1([0.0])), tandem.at_most(1.0), x)
    p.solve()
    for options in (dict(cost_tolerance=-1), dict(step_tolerance=np.nan), dict(initial_penalty=-1.0)):
        with pytest.raises(tandem.BadInputError):
            p.solve(**options)
        assert p.multipliers(bound) == pytest.approx([1.0])


def test_multipliers_belong_to_the_last_solve():
    fails = [False]

    def residual(x):
        if fails[0]:
            raise RuntimeError("broken")
        return x - 2.0

    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    p.minimize(tandem.residual(residual, dim=1), 1.0, x)
    bound = p.subject_to(tandem.Prior(R1([0.0])), tandem.at_most(1.0), x)
    p.solve()
    fails[0] = True
    with pytest.raises(tandem.ResidualError):
        p.solve()
    with pytest.raises(tandem.NumericalError, match="raised an exception"):
        p.multipliers(bound)


@pytest.mark.parametrize("change", [
    lambda p, x, cost: p.minimize(tandem.Prior(R1([50.0])), 1.0, x),
    lambda p, x, cost: p.subject_to(tandem.Prior(R1([0.0])), tandem.at_most(0.5), x),
    lambda p, x, cost: p.remove(cost),
    lambda p, x, cost: p.fix(x),
])
def test_changed_problems_have_no_multipliers(change):
    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    cost = p.minimize(tandem.Prior(R1([2.0])), 1.0, x)
    bound = p.subject_to(tandem.Prior(R1([0.0])), tandem.at_most(1.0), x)
    p.solve()
    assert p.multipliers(bound) == pytest.approx([1.0])
    change(p, x, cost)
    with pytest.raises(tandem.NumericalError, match="has changed since the last solve"):
        p.multipliers(bound)


def test_unsolved_problems_have_no_multipliers_after_pickling():
    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    p.minimize(tandem.Prior(R1([2.0])), 1.0, x)
    p.subject_to(tandem.Prior(R1([0.0])), tandem.at_most(1.0), x)
    q = pickle.loads(pickle.dumps(p))
    with pytest.raises(tandem.NumericalError, match="not been solved"):
        q.multipliers(q.blocks[1])
    q.solve()
    again = pickle.loads(pickle.dumps(q))
    assert again.multipliers(again.blocks[1]) == pytest.approx([1.0])


def test_summaries_are_pickled():
    p = tandem.Problem()
    x = p.add(SE3(), "x")
    p.minimize(tandem.Range(1.0), 1.0, [x, p.add(tandem.R3([2.0, 0, 0]), "y")])
    summary = p.solve()
    again = pickle.loads(pickle.dumps(summary))
    assert repr(again) == repr(summary) and again.unobservable == summary.unobservable and summary.unobservable

"""Solves in threads and processes, progress and interrupts."""

import _thread
import threading
import time

import numpy as np
import pytest

import tandem
from tandem import R1, R2

from test_problem import chain


def test_the_lock_is_released_in_solves():
    p, _, _, _ = chain(4000)
    ticks = []
    stop = threading.Event()

    def count():
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.0005)

    thread = threading.Thread(target=count)
    thread.start()
    time.sleep(0.01)
    start = time.perf_counter()
    p.solve()
    end = time.perf_counter()
    stop.set()
    thread.join()
    assert sum(start < t < end for t in ticks) > 0


def test_two_threads_solve_two_problems():
    problems = [chain(200, seed=s)[0] for s in range(4)]
    threads = [threading.Thread(target=p.solve) for p in problems]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(p.solve().cost < 1e-9 for p in problems)


def test_one_problem_in_two_threads_is_an_error():
    p, x, _, _ = chain(50)
    inside, errors = threading.Event(), []

    def wait(_):
        inside.set()
        time.sleep(0.05)

    thread = threading.Thread(target=lambda: p.solve(progress=wait))
    thread.start()
    assert inside.wait(10)
    for call in (p.solve, lambda: p.value(x[0]), lambda: p.fix(x[0]), lambda: p.add(R1([0.0])),
                 lambda: tandem.Marginals(p)):
        try:
            call()
        except tandem.BusyError as error:
            errors.append(error)
    thread.join()
    assert len(errors) == 5
    assert p.solve().converged


def test_progress_reads_but_does_not_change():
    p, x, _, _ = chain()
    seen = []

    def progress(report):
        seen.append((report["iteration"], p.value(x[0]).log()))
        with pytest.raises(tandem.BusyError):
            p.add(R1([0.0]))

    p.solve(progress=progress)
    assert seen


def test_exceptions_of_progress_are_chained():
    p, *_ = chain()

    def progress(_):
        raise KeyError("mine")

    with pytest.raises(tandem.ResidualError) as error:
        p.solve(progress=progress)
    assert isinstance(error.value.__cause__, KeyError)


def test_interrupted_solve_returns_the_best_point():
    p, *_ = chain()

    def progress(report):
        if report["iteration"] >= 1:
            raise KeyboardInterrupt

    summary = p.solve("augmented-lagrangian", progress=progress, cost_tolerance=0.0, gradient_tolerance=1e-300)
    assert summary.status in ("interrupted", "converged") and np.isfinite(summary.cost)


def test_damped_sqp_reports_progress_and_can_be_interrupted():
    p = tandem.Problem()
    x = p.add(R2([3.0, -2.0]), "x")
    p.minimize(tandem.Prior(R2([0.5, 0.0])), 1.0, x)
    circle = tandem.residual(lambda v: [v[0] ** 2 + v[1] ** 2], dim=1, name="circle")
    p.subject_to(circle, tandem.equal_to(1.0), x)
    reports, values = [], []

    def progress(report):
        reports.append(report)
        values.append(p.value(x).vector)

    q = p.copy()
    summary = q.solve("damped-sqp")
    assert p.solve("damped-sqp", progress=progress).iterations == summary.iterations and summary.converged
    assert [r["iteration"] for r in reports] == list(range(len(reports))) and len(reports) == summary.iterations
    assert reports[0]["violation"] == pytest.approx(12.0) and reports[0]["cost"] == pytest.approx(5.125)
    assert np.array_equal(values[0], [3.0, -2.0]) and reports[1]["step"] > 0
    for k, v in zip(reports, values):
        assert k["violation"] == pytest.approx(abs(v @ v - 1), abs=1e-12)

    for stop in (0, 2):
        r = p.copy()
        r.set_value(r["x"], R2([3.0, -2.0]))

        def interrupted(report):
            if report["iteration"] == stop:
                raise KeyboardInterrupt

        with pytest.warns(tandem.IncompleteWarning, match="damped-sqp: interrupted"):
            summary = r.solve("damped-sqp", progress=interrupted)
        assert summary.status == "interrupted" and summary.iterations == stop
        assert np.allclose(r.value(r["x"]).vector, values[stop])
    calls = []

    def interrupts(v):
        calls.append(1)
        if len(calls) == 8:
            _thread.interrupt_main()
        return [v[0] ** 2 + v[1] ** 2]

    p.set_value(x, R2([3.0, -2.0]))
    p.set_residual(p.blocks[-1], tandem.residual(interrupts, dim=1, name="circle"))
    with pytest.warns(tandem.IncompleteWarning, match="interrupted"):
        assert p.solve("damped-sqp").status == "interrupted"


def solved_cost(seed):
    p, *_ = chain(3000, seed)
    return p.solve(max_iterations=3).cost


def test_problems_are_solved_in_forked_and_spawned_processes():
    import multiprocessing
    expected = solved_cost(1)  # starts threads before the fork
    for method in ("fork", "spawn"):
        with multiprocessing.get_context(method).Pool(2) as pool:
            assert pool.map_async(solved_cost, [1, 1]).get(timeout=120) == [expected] * 2

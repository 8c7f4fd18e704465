"""Measures the numbers of docs/benchmarks.md about Python. Usage: PYTHONPATH=build/release/python python3 benchmarks.py

Times are processor times, the least of several runs; solves use one thread.
"""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time

import numpy as np

import tandem
from tandem import R3, SE3
from tandem._process import program


def processor_time():
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def least(f, runs=7):
    times = []
    for _ in range(runs):
        start = processor_time()
        f()
        times.append(processor_time() - start)
    return min(times)


def command_line():
    folder = tempfile.mkdtemp()
    subprocess.run([program("estimate"), "docking_a", "--threads", "1", "--plots", "off", "--json", "--out", folder + "/run"],
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    shutil.rmtree(folder)


def single_calls(n=10000):
    p = tandem.Problem()
    variables = list(p.add(SE3.identity(n), "x"))
    residual, sigmas = tandem.Prior(SE3()), np.ones(6)
    return least(lambda: [p.minimize(residual, sigmas, x) for x in variables])


def arrays(n=100000):
    p = tandem.Problem()
    values = SE3.exp(np.random.default_rng(0).normal(scale=0.5, size=(n, 6)))
    x = p.add(values, "x")
    residual, sigmas = tandem.Prior(values), np.ones(6)
    return least(lambda: p.minimize(residual, sigmas, x))


def batched(x, y, z, *, jacobians=False):
    rows = y - x - z
    if not jacobians:
        return rows
    by_y = np.broadcast_to(np.eye(3), (len(x), 3, 3))
    return rows, [-by_y, by_y]


def compiled():
    import numba
    pointer = numba.types.CPointer(numba.types.float64)

    @numba.cfunc(numba.types.int32(pointer, pointer, pointer, pointer, numba.types.int32))
    def relative(data, x, r, J, jacobians):
        for i in range(3):
            r[i] = x[3 + i] - x[i] - data[i]
        if jacobians:
            for i in range(3):
                J[6 * i + i] = -1.0
                J[6 * i + 3 + i] = 1.0
        return 0

    return relative


def solve(residual, n=10000):
    times = []
    for _ in range(7):
        p = tandem.Problem()
        x = p.add(R3(np.random.default_rng(1).normal(size=(n, 3))), "x")
        p.minimize(tandem.Prior(R3()), 0.1, x[0])
        p.minimize(residual, 0.1, [x[:-1], x[1:]])
        start = time.process_time()
        p.solve(threads=1, observability=False)
        times.append(time.process_time() - start)
    return min(times)


def memory(runs=1000):
    tandem.estimate("docking_a", max_keyframes=20)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(runs):
        tandem.estimate("docking_a", max_keyframes=20)
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before


def run_python(code):
    subprocess.run([sys.executable, "-c", code], check=True, env=os.environ)


def main():
    z = np.tile([1.0, 2.0, 3.0], (9999, 1))
    library = solve(tandem.RelativePose(z))
    rows = [
        ("`estimate(\"docking_a\")` over the command line",
         f"{least(lambda: tandem.estimate('docking_a', threads=1)) / least(command_line):.2f}"),
        ("10,000 single `minimize` calls", f"{1000 * single_calls():.0f} ms"),
        ("100,000 residuals by arrays", f"{1000 * arrays():.0f} ms"),
        ("solve with 9,999 batched Python residuals over those of the library",
         f"{solve(tandem.residual(batched, dim=3, jacobian='given', batched=True, data=z)) / library:.2f}"),
    ]
    try:
        rows.append(("the same, compiled by numba",
                     f"{solve(tandem.compiled_residual(compiled(), dim=3, data=z)) / library:.2f}"))
    except ImportError:
        pass
    seconds = least(lambda: run_python("import tandem"))
    rows += [("`import tandem`, with NumPy and the interpreter", f"{seconds:.2f} s"),
             ("growth of the memory in 1,000 estimates", f"{memory()} kB")]
    print("| measurement | value |\n| --- | --- |")
    for name, value in rows:
        print(f"| {name} | {value} |")


if __name__ == "__main__":
    main()

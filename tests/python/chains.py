"""A problem that several tests solve."""

import numpy as np

import tandem
from tandem import SE3


def chain(n=20, seed=1):
    """A pose chain with odometry and noisy positions: problem, variables, blocks of the odometry."""
    rng = np.random.default_rng(seed)
    p = tandem.Problem()
    steps = SE3.exp(np.tile([1.0, 0, 0, 0, 0, 0.1], (n - 1, 1)))
    truth = [SE3()]
    for i in range(n - 1):
        truth.append(truth[-1] @ steps[i])
    truth = SE3.stack(truth)
    x = p.add(truth.plus(rng.normal(scale=0.1, size=(n, 6))), "x")
    p.minimize(tandem.Prior(truth[0]), 1e-3, x[0])
    odometry = p.minimize(tandem.RelativePose(steps), [0.1, 0.1, 0.1, 0.01, 0.01, 0.01], [x[:-1], x[1:]])
    return p, x, odometry, truth

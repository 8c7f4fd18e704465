"""Texts of the examples of compiled functions; see _examples.py."""

# One example in each line: an expression, which begins with the name of the function, and its printed value.
VALUES = """
Prior(R2([1, 2]))(R2([1, 5])) -> [0. 3.]
RelativePose(R1([2.0]))(R1([1.0]), R1([4.0])) -> [1.]
RelativeRotation(SO3())(SE3(), SE3(SO3.exp([0, 0, 0.5]), [9, 0, 0])) -> [0.  0.  0.5]
RollPitch()(SE3(SO3.exp([0.25, 0, 0]), [9, 0, 0])) -> [-0.25  0.  ]
Boundary()(SE2(0.5, [1, 2]), R2([1, 1])) -> [0. 1.]
UsblPosition([1, 2, 3])(SE3(), R3([1, 2, 5])) -> [0. 0. 2.]
UsblSpherical(4.0, 0.0, 0.0)(SE3(), R3([5, 0, 0])) -> [1. 0. 0.]
Range(6.0)(SE3(), R3([3, 4, 0])) -> [-1.]
LogRange(2.5)(SE3(), R3([3, 4, 0])).round(3) -> [0.693]
Bearing([1, 0])(SE2(), R2([3, 3])).round(3) -> [0.785]
RangeBearing(4.0, [1, 0])(SE2(), R2([5, 0])) -> [1. 0.]
ConstantTwist(1.0, 2.0)(R1([0.0]), R1([1.0]), R1([3.5])) -> [0.5]
DampedTwist(1.0, 1.0, [0.5] * 3, [0] * 3)(SE2(), SE2(0, [2, 0]), SE2(0, [4, 0])) -> [1. 0. 0.]
WhiteNoiseAcceleration(2.0)(*R3([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 0, 3]])) -> [0. 0. 0. 0. 0. 3.]
MixedVelocity([1, 1, 1])(*R3([[0, 0, 0], [1, 0, 0], [2, 0, 0.5]])) -> [0.  0.  0.5]
GaussMarkov(0.5)(R1([2.0]), R1([1.5])) -> [0.5]
Coasting(1.0)(SE3(), R3([1, 0, 0]), SE3.exp([1, 2, 0, 0, 0, 0]), R3([1, 0, 0])) -> [0. 2. 0. 0. 0. 0. 0. 0. 0.]
EulerKinematics(2.0)(R2([0, 0]), R2([1, 2]), R2([2, 5])) -> [0. 1.]
QuadrotorRate(0.8, [1, 1, 2], 0.5, 0.1, 10.0, 0.1)(R3(), R4([2, 2, 2, 2]), R3([0, 0, 0.5])) -> [0.  0.  0.5]
QuadrotorVelocity(0.8, [1, 1, 2], 0.5, 0.1, 10.0, 0.1)(R3(), SO3(), R4([2, 2, 2, 2]), R3([0, 0, 1])) -> [0. 0. 1.]
Depth(-10.0)(SE3.exp([0, 0, -8, 0, 0, 0])) -> [2.]
Gps([1, 2, 3])(SE3.exp([1, 2, 5, 0, 0, 0])) -> [0. 0. 2.]
Heading(SO3())(SE3.exp([0, 0, 0, 0, 0, 0.5])) -> [0.  0.  0.5]
DvlVelocity([1, 0, 0])(SE3(), R3([1.5, 0, 0])) -> [0.5 0.  0. ]
ScaledDvlVelocity([1, 0, 0])(SE3(), R3([1, 0, 0]), R1([0.5])) -> [0.5 0.  0. ]
PreintegratedDvl([1, 0, 0])(SE3(), SE3.exp([1.5, 0, 0, 0, 0, 0])) -> [0.5 0.  0. ]
TwistKinematics(2.0)(SE3(), R6([1] + [0] * 5), SE3.exp([4, 0, 0, 0, 0, 0]), R6([2] + [0] * 5)) -> [1. 0. 0. 0. 0. 0.]
ActuatorLag([0.5] * 3)(R3([0, 0, 0]), R3([1, 1, 1]), R3([0.5, 0.5, 0.75])) -> [0.   0.   0.25]
InsideCone(0.25)(SE3(), R3([2, 0, 0])).round(3) -> [0.495]
Visibility()(SE3(), SE3.exp([5, 0, 0, 0, 0, 0]), R1([1.0])).round(3) -> [0.145]
Interpolated(Range(2.5), 0.5)(SE3(), SE3(), R3([1, 0, 0]), R3([3, 0, 0])) -> [-0.5]
SteadyCourse(Range(2.5), 1.0)(SE3(), SE3(), R1([3.0])) -> [0.5]
WithBias(Range(2.5))(SE3(), R3([3, 0, 0]), R1([0.25])) -> [0.75]
Miscalibrated(Range(3.0), before=1, after=1)(*[SE3()] * 3, *[R3([3, 0, 0])] * 3, R1([0.5]), R1(), SO3(), R1()) -> [0.5]
MiscalibratedEgo(Depth(-1.0))(SE3(), R3(), R6(), R1([0.5]), R1(), SO3(), R1()) -> [1.5]
SoftBound(Range(0.0), at_most(2.0))(SE3(), R3([3, 0, 0])) -> [1.]
equal_to(0) -> <Bounds 0.0 to 0.0>
at_least([1, 2]) -> <Bounds [1.0, 2.0] to inf>
at_most(3) -> <Bounds -inf to 3.0>
"""

# Further examples: the name, then the example. A line "+" ends each.
TEXTS = """
SO3.from_quaternion
>>> tandem.SO3.from_quaternion([0, 0, 1, 0], order="xyzw").matrix().diagonal()
array([-1., -1.,  1.])
+
SO3.quaternion
>>> tandem.SO3().quaternion(order="wxyz")
array([1., 0., 0., 0.])
+
SE3.from_quaternion
>>> tandem.SE3.from_quaternion([0, 0, 0, 1], [1, 2, 3], order="xyzw").translation
array([1., 2., 3.])
+
SE3.quaternion
>>> tandem.SE3().quaternion()
array([0., 0., 0., 1.])
+
SE3.from_matrix
>>> tandem.SE3.from_matrix(np.eye(4)).translation
array([0., 0., 0.])
+
SE2.from_matrix
>>> tandem.SE2.from_matrix([[0, -1, 3], [1, 0, 4], [0, 0, 1]])
SE2(3, 4, 1.5708)
+
PreintegratedImu
>>> from tandem import R3, R6, SE3, SO3, PreintegratedImu
>>> zero = np.zeros((3, 6))
>>> imu = PreintegratedImu(2.0, SO3(), [0] * 3, [0] * 3, [0] * 6, np.zeros((3, 3)), zero, zero, gravity=[0, 0, 0])
>>> imu(SE3(), R3([1, 0, 0]), R6(), SE3.exp([3, 0, 0, 0, 0, 0]), R3([1, 0, 0]), R6())[:3]
array([1., 0., 0.])
+
Propagated
>>> from tandem import R3, R6, SE3, Depth, Propagated, preintegrate_imu
>>> at_rest = np.array([[0.1 * k, 0, 0, 9.80665, 0, 0, 0] for k in range(11)])
>>> imu, _ = preintegrate_imu(at_rest, accelerometer=1e-3, gyroscope=1e-4, accelerometer_bias_walk=1e-4,
...                           gyroscope_bias_walk=1e-5)
>>> Propagated(Depth(-8.0), imu)(SE3.exp([0, 0, -8, 0, 0, 0]), R3([0, 0, -2]), R6()).round(6)   # 1 s later
array([-2.])
+
Residual
>>> r = tandem.Prior(tandem.R1([[1.0], [2.0]]))
>>> isinstance(r, tandem.Residual), r.name
(True, 'Prior')
>>> r(tandem.R1([3.0]))
array([[2.],
       [1.]])
+
Loss
>>> p = tandem.Problem()
>>> block = p.minimize(tandem.Prior(tandem.R1([0.0])), 1.0, p.add(tandem.R1([1.0])), loss=tandem.Huber(2.0))
>>> loss = p.loss(block)
>>> isinstance(loss, tandem.Loss), loss.kind, loss.scale
(True, 'huber', 2.0)
+
Bounds
>>> b = tandem.at_least([0.0, 1.0])
>>> isinstance(b, tandem.Bounds), b.lower, b.upper
(True, [0.0, 1.0], [inf])
+
Gaussian.covariance
>>> tandem.Gaussian.covariance([[4, 1], [1, 9]]).sigmas
array([2., 3.])
+
Variable
>>> p = tandem.Problem()
>>> x = p.add(tandem.SE2(), "pose")
>>> isinstance(x, tandem.Variable), x.name, x.group
(True, 'pose', 'SE2')
+
Variables
>>> p = tandem.Problem()
>>> x = p.add(tandem.SE2.identity(5), "pose")
>>> isinstance(x, tandem.Variables), len(x), x[-1], x[1:3]
(True, 5, <Variable pose 4: SE2>, <2 variables: SE2>)
+
Blocks
>>> p = tandem.Problem()
>>> x = p.add(tandem.R1.identity(5))
>>> blocks = p.minimize(tandem.Prior(tandem.R1([1.0])), 1.0, x)
>>> isinstance(blocks, tandem.Blocks), blocks[1:3]
(True, <2 blocks: prior>)
+
SolveSummary
>>> p = tandem.Problem()
>>> block = p.minimize(tandem.Prior(tandem.R1([1.0])), 1.0, p.add(tandem.R1([0.0])))
>>> summary = p.solve()
>>> summary.require_converged()
>>> isinstance(summary, tandem.SolveSummary), summary.status, summary.initial_cost, round(summary.cost, 6)
(True, 'converged', 0.5, 0.0)
+
Problem.fix
>>> p = tandem.Problem()
>>> x, y = p.add(tandem.R1([0.0])), p.add(tandem.R1([5.0]))
>>> block = p.minimize(tandem.RelativePose(tandem.R1([1.0])), 1.0, [x, y])
>>> p.fix(x)
>>> p.solve().status, p.value(x), p.value(y)
('converged', R1(0), R1(1))
+
Problem.set_value
>>> p = tandem.Problem()
>>> x = p.add(tandem.R1([0.0]))
>>> p.set_value(x, tandem.R1([2.0]))
>>> p.value(x)
R1(2)
+
Problem.has
>>> p = tandem.Problem()
>>> x = p.add(tandem.R1([0.0]))
>>> block = p.minimize(tandem.Prior(tandem.R1([1.0])), 1.0, x)
>>> p.remove(block)
>>> p.has(block), p.has(x)
(False, True)
+
Problem.remove
>>> p = tandem.Problem()
>>> x = p.add(tandem.R1([[0.0], [1.0]]), "x")
>>> p.remove(x[0])
>>> p
<Problem: 1 variables, 0 costs, 0 constraints, 1 unknowns>
+
Problem.weight
>>> p = tandem.Problem()
>>> x = p.add(tandem.R1([4.0]))
>>> p.weight(p.minimize(tandem.Prior(tandem.R1([0.0])), 1.0, x, loss=tandem.Huber(1.0)))
0.25
+
Problem.linearization
>>> p = tandem.Problem()
>>> x = p.add(tandem.R1([4.0]))
>>> p.linearization(p.minimize(tandem.Prior(tandem.R1([1.0])), 1.0, x))
(array([3.]), array([[1.]]))
+
Problem.describe
>>> p = tandem.Problem()
>>> p.describe(p.minimize(tandem.Prior(tandem.R1([1.0])), 1.0, p.add(tandem.R1([4.0]), "x")))
'prior of x'
+
Problem.set_loss
>>> p = tandem.Problem()
>>> block = p.minimize(tandem.Prior(tandem.R1([0.0])), 1.0, p.add(tandem.R1([4.0])))
>>> p.set_loss(block, tandem.Cauchy(1.0))
>>> p.loss(block)
<loss cauchy, scale 1.0>
+
Problem.loss
>>> p = tandem.Problem()
>>> block = p.minimize(tandem.Prior(tandem.R1([0.0])), 1.0, p.add(tandem.R1([4.0])))
>>> print(p.loss(block))
None
+
Problem.noise
>>> p = tandem.Problem()
>>> p.noise(p.minimize(tandem.Prior(tandem.R2([1, 2])), [0.5, 2.0], p.add(tandem.R2())))
Gaussian([0.5, 2.0])
+
Problem.set_bounds
>>> p = tandem.Problem()
>>> block = p.subject_to(tandem.Prior(tandem.R1([0.0])), tandem.at_most(1.0), p.add(tandem.R1([4.0])))
>>> p.set_bounds(block, tandem.between(1.0, 2.0))
>>> p.bounds(block)
<Bounds 1.0 to 2.0>
+
Problem.bounds
>>> p = tandem.Problem()
>>> x = p.add(tandem.R1.identity(3))
>>> p.bounds(p.subject_to(tandem.Prior(tandem.R1([0.0])), tandem.at_most([[1], [2], [3]]), x)).upper
array([[1.],
       [2.],
       [3.]])
+
Problem.copy
>>> p = tandem.Problem()
>>> x = p.add(tandem.R1([0.0]), "x")
>>> q = p.copy()
>>> q.set_value(q.counterpart(x), tandem.R1([2.0]))
>>> p.value(x), q.value(q.counterpart(x))
(R1(0), R1(2))
+
Problem.counterpart
>>> p = tandem.Problem()
>>> x = p.add(tandem.R1([0.0]), "x")
>>> q = p.copy()
>>> q.has(x), q.has(q.counterpart(x))
(False, True)
+
Problem.write
>>> import os, tempfile
>>> p = tandem.Problem()
>>> x = p.add(tandem.R1([1.5]), "x")
>>> with tempfile.TemporaryDirectory() as folder:
...     p.write(os.path.join(folder, "problem.json"))
...     q = tandem.Problem.read(os.path.join(folder, "problem.json"))
>>> q.value(q["x"])
R1(1.5)
+
Problem.read
>>> import os, tempfile
>>> with tempfile.TemporaryDirectory() as folder:
...     tandem.Problem().write(os.path.join(folder, "problem.json"))
...     tandem.Problem.read(os.path.join(folder, "problem.json"))
<Problem: 0 variables, 0 costs, 0 constraints, 0 unknowns>
+
Marginals.joint
>>> p = tandem.Problem()
>>> x, y = p.add(tandem.R1([0.0])), p.add(tandem.R1([0.0]))
>>> prior = p.minimize(tandem.Prior(tandem.R1([0.0])), 1.0, x)
>>> step = p.minimize(tandem.RelativePose(tandem.R1([0.0])), 1.0, [x, y])
>>> tandem.Marginals(p).joint([x, y])
array([[1., 1.],
       [1., 2.]])
+
Marginals.require_regular
>>> p = tandem.Problem()
>>> x = p.add(tandem.R1([0.0]), "x")
>>> try:
...     tandem.Marginals(p).require_regular()
... except tandem.NotObservableError as error:
...     print(error.state)
x
+
FixedLag.covariance
>>> lag = tandem.FixedLag(window=10.0)
>>> x = lag.add(0.0, tandem.R1([0.0]))
>>> prior = lag.problem.minimize(tandem.Prior(tandem.R1([1.0])), 2.0, x)
>>> lag.update().converged, lag.covariance(x)
(True, array([[4.]]))
+
FixedLag.joint
>>> lag = tandem.FixedLag(window=10.0)
>>> x = lag.add(0.0, tandem.R1([[0.0], [0.0]]))
>>> prior = lag.problem.minimize(tandem.Prior(tandem.R1([1.0])), 2.0, x)
>>> lag.update().converged, lag.joint([x[0], x[1]])
(True, array([[4., 0.],
       [0., 4.]]))
+
CalibratedNoise
>>> p = tandem.Problem()
>>> z = np.random.default_rng(1).normal(scale=0.5, size=(200, 1))
>>> blocks = p.minimize(tandem.Prior(tandem.R1(z)), 1.0, p.add(tandem.R1([0.0])))
>>> noise = tandem.Calibration(p, {"scale": blocks}).noise["scale"]
>>> isinstance(noise, tandem.CalibratedNoise), round(noise.factor, 1), noise.rows
(True, 0.5, 200.0)
+
VehicleState
>>> tandem.VehicleState(tandem.SE3(), twist=[1.5, 0, 0, 0, 0, 0]).twist
array([1.5, 0. , 0. , 0. , 0. , 0. ])
+
TargetPrediction
>>> poses = tandem.SE3.exp([[0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0]])
>>> len(tandem.TargetPrediction(poses, np.zeros((2, 6))))
2
+
Cone
>>> tandem.Cone(0.5, apex=tandem.SE3.exp([1, 0, 0, 0, 0, 0])).half_angle
0.5
+
PlanResult Planner.active_constraints Planner.reset
>>> planner = tandem.Planner(tandem.Vehicle("remus_100"), steps=5, dt=1.0)
>>> target = tandem.TargetPrediction(tandem.SE3.exp(np.full((6, 6), [20, 0, 0, 0, 0, 0])), np.zeros((6, 6)))
>>> planner.active_constraints()
[]
>>> plan = planner.replan(tandem.VehicleState(tandem.SE3(), [1.5, 0, 0, 0, 0, 0]), target)
>>> isinstance(plan, tandem.PlanResult), plan.origin, len(plan.poses), planner.has_plan
(True, 'solved', 6, True)
>>> planner.reset()
>>> planner.has_plan
False
+
"""

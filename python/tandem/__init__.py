"""Joint estimation of a vehicle and the moving target it observes, with hard constraints on Lie groups.

Whole runs: estimate, navigate, calibrate, models, tune, plan, rendezvous, run_study, Tracker. Their keyword arguments
are the options of the command line. The library: groups (SO2, SE2, SO3, SE3, SE23, R1 … R12), Problem with residuals
of the library and of your own, Marginals, FixedLag, Calibration, OnlineEstimator, Planner.

Units are SI and radians. Tangent vectors put translation first; perturbations are on the right. Quaternions are
Hamilton; their order is named at each use. docs/python.md is the guide.
"""

import numpy as _numpy

from . import _build

if int(_numpy.__version__.split(".")[0]) >= 2 and tuple(
        int(part) for part in _build.PYBIND11_VERSION.split(".")[:2]) < (2, 12):
    raise ImportError(f"this build of tandem uses pybind11 {_build.PYBIND11_VERSION}, which does not support NumPy "
                      f"{_numpy.__version__}; install NumPy 1, or build tandem with pybind11 2.12 or newer")

from . import _calls, _core, _examples

_calls.make_readable(_core)
_examples.append_examples(_core)

from ._commands import (calibrate, compare, estimate, export, import_log, info, models, navigate, plan, rendezvous,
                        simulate, solve_file, study, track, tune)
from ._core import (R1, R2, R3, R4, R5, R6, R8, R9, R12, SE2, SE3, SE23, SO2, SO3, ActuatorLag, Bearing, Blocks,
                    Boundary, Bounds, Bundle, CalibratedNoise, Calibration, Cauchy, Coasting, Cone, ConstantTwist,
                    DampedTwist, Depth, DvlVelocity, EulerKinematics, FixedLag, Gaussian, GaussMarkov, GemanMcClure, Gps, Heading, Huber,
                    InsideCone, Interpolated, LogRange, Loss, Marginals, Miscalibrated, MiscalibratedEgo, MixedVelocity,
                    Planner, PlanResult, PreintegratedDvl, PreintegratedImu, Prior, Problem, Propagated, QuadrotorRate,
                    QuadrotorVelocity, Range,
                    RangeBearing, RelativePose, RelativeRotation, Residual, RollPitch, ScaledDvlVelocity, SoftBound,
                    SolveSummary, SteadyCourse, StudentT, TargetPrediction, Tukey, TwistKinematics, UsblPosition,
                    UsblSpherical, Variable, Variables, VehicleState, Visibility, WhiteNoiseAcceleration, WithBias,
                    at_least, at_most, between, equal_to, predict_target, preintegrate_imu)
from .errors import (BadInputError, BusyError, Error, IncompleteWarning, InfeasibleError, MisfitError,
                     NotObservableError, NumericalError, ResidualError, StaleHandleError, Stopped,
                     UndefinedResidualError)
from .online import OnlineEstimator, Vehicle
from .own import TwistComponents, compiled_residual, residual
from .results import Estimate, Navigation, Plan, Results, read_results
from .scenario import Scenario, read_scenario
from .tracker import Tracker
from .trajectory import Trajectory
from .studies import run_study
from .summary import FitReport, Summary, fit_report
from .vectors import Rn
from . import _html, plot, testing

__all__ = [
    "__version__", "ActuatorLag", "at_least", "at_most", "BadInputError", "Bearing", "between", "Blocks",
    "Boundary", "Bounds", "Bundle", "BusyError", "calibrate", "CalibratedNoise", "Calibration", "Cauchy",
    "Coasting", "compare", "compiled_residual", "Cone", "ConstantTwist", "DampedTwist", "Depth", "DvlVelocity",
    "equal_to", "Error", "EulerKinematics", "Estimate", "estimate", "export", "fit_report", "FitReport", "FixedLag", "Gaussian", "GaussMarkov",
    "GemanMcClure", "Gps", "Heading", "Huber", "import_log", "IncompleteWarning", "InfeasibleError", "info",
    "InsideCone", "Interpolated", "LogRange", "Loss", "Marginals", "Miscalibrated", "MiscalibratedEgo",
    "MisfitError", "MixedVelocity", "models", "navigate", "Navigation", "NotObservableError", "NumericalError",
    "OnlineEstimator", "Plan", "plan", "Planner", "PlanResult", "plot", "predict_target", "preintegrate_imu",
    "PreintegratedDvl", "PreintegratedImu", "Prior", "Problem", "Propagated", "QuadrotorRate",
    "QuadrotorVelocity", "R1", "R12", "R2", "R3", "R4", "R5",
    "R6", "R8", "R9", "Range", "RangeBearing", "read_results", "read_scenario", "RelativePose",
    "RelativeRotation", "rendezvous", "Residual", "residual", "ResidualError", "Results", "Rn", "RollPitch",
    "run_study", "ScaledDvlVelocity", "Scenario", "SE2", "SE23", "SE3", "simulate", "SO2", "SO3", "SoftBound",
    "solve_file", "SolveSummary", "StaleHandleError", "SteadyCourse", "Stopped", "StudentT", "study", "Summary",
    "TargetPrediction", "testing", "track", "Tracker", "Trajectory", "Tukey", "tune", "TwistComponents",
    "TwistKinematics", "UndefinedResidualError", "UsblPosition", "UsblSpherical", "Variable", "Variables",
    "Vehicle", "VehicleState", "Visibility", "WhiteNoiseAcceleration", "WithBias",
]

setattr(Problem, "_repr_html_", lambda self: _html.problem(self))

__version__ = _build.VERSION

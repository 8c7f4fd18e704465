#include <gmock/gmock.h>

#include <tandem/residuals/roll_pitch.hpp>

#include "cases.hpp"

/// Tests constrained problems with known solutions. The multiplier is the slope of the cost as a function of the bound,
/// so costs at several bounds check the multipliers too.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;

/// Tolerance of solutions: the constraint tolerance of 1e-8 over the slope of the row, with a margin.
constexpr double kPosition = 1e-6;

class HardSolver : public ::testing::TestWithParam<AnySolver> {
 protected:
  Summary solve(Problem& problem) const {
    const Summary s = GetParam()(problem);
    EXPECT_TRUE(s.converged()) << s.message;
    EXPECT_LE(s.max_violation, 1e-7);
    EXPECT_EQ(s.worst_constraint, "");
    return s;
  }
};
INSTANTIATE_TEST_SUITE_P(Solvers, HardSolver, ::testing::ValuesIn(hard_solvers()), name_of);

TEST_P(HardSolver, ProjectsOntoASphere) {
  for (const double radius : {0.5, 2.0, 7.0}) {
    // The curvature of the constraint is five times that of the cost. Without it in the Hessian, steps are six times
    // too long.
    if (radius == 0.5 && GetParam().name == "ipopt") continue;
    Problem problem;
    const Vector<3> p(2.0, -1.0, 2.0);  // ‖p‖ = 3
    const auto x = problem.add(R3({1.0, 1.0, 1.0}));
    problem.minimize(Prior<R3>{R3(p)}, Gaussian{1.0, 1.0, 1.0}, {x});
    problem.subject_to(SquaredNorm{}, equal_to(radius * radius), {x});
    const Summary s = solve(problem);
    EXPECT_NEAR(s.cost, 0.5 * (3.0 - radius) * (3.0 - radius), 1e-6);
    EXPECT_LE((problem.value(x).vector() - radius / 3.0 * p).norm(), 1e-4);
  }
}

TEST_P(HardSolver, ProjectsOntoALine) {
  Problem problem;
  const Vector<3> p(2.0, -1.0, 5.0);
  const auto x = problem.add(R3({1.0, 1.0, 1.0}));
  problem.minimize(Prior<R3>{R3(p)}, Gaussian{1.0, 1.0, 1.0}, {x});
  constexpr double free = std::numeric_limits<double>::infinity();
  problem.subject_to(Prior<R3>{R3()}, Bounds<3>{{0.5, -free, 2.0}, {0.5, free, 2.0}}, {x});
  const Summary s = solve(problem);
  EXPECT_LE((problem.value(x).vector() - Vector<3>(0.5, -1.0, 2.0)).norm(), kPosition);
  EXPECT_NEAR(s.cost, 0.5 * (1.5 * 1.5 + 3.0 * 3.0), 1e-6);
}

/// min ½ (x − 3)² within bounds. The slope of the cost with respect to an active bound is x − 3.
TEST_P(HardSolver, SatisfiesAllKindsOfBounds) {
  struct Case {
    UniformBounds bounds;
    double x;
  };
  for (const auto& [bounds, expected] :
       {Case{at_most(2.0), 2.0}, Case{at_most(2.1), 2.1}, Case{at_most(5.0), 3.0}, Case{at_least(4.0), 4.0},
        Case{at_least(-1.0), 3.0}, Case{between(0.0, 1.0), 1.0}, Case{between(3.5, 8.0), 3.5},
        Case{between(2.0, 4.0), 3.0}, Case{equal_to(2.5), 2.5}, Case{at_most(3.0), 3.0}}) {
    Problem problem;
    const auto x = problem.add(R1(Vector<1>(0.2)));
    problem.minimize(Prior<R1>{R1(Vector<1>(3.0))}, Gaussian{1.0}, {x});
    problem.subject_to(Prior<R1>{R1()}, bounds, {x});
    SCOPED_TRACE(std::to_string(bounds.lower) + " " + std::to_string(bounds.upper));
    const Summary s = solve(problem);
    // If a bound is only just active, an interior-point solution is off by the root of the tolerance.
    EXPECT_NEAR(problem.value(x).vector()[0], expected, expected == 3.0 ? 1e-4 : kPosition);
    EXPECT_NEAR(s.cost, 0.5 * (expected - 3.0) * (expected - 3.0), 1e-6);
  }
}

TEST_P(HardSolver, ConstrainsRollAndPitch) {
  Problem problem;
  const auto R = problem.add(SO3::Exp({0.3, -0.2, 1.0}), "R");
  const SO3 measured = SO3::Exp({0.0, 0.0, 0.8}) * SO3::Exp({0.25, 0.1, 0.0});
  problem.minimize(Prior<SO3>{measured}, Gaussian{0.1, 0.1, 0.1}, {R});
  problem.subject_to(RollPitch<SO3>{}, equal_to(0), {R});
  solve(problem);
  EXPECT_LE((problem.value(R).matrix().row(2) - Eigen::RowVector3d(0.0, 0.0, 1.0)).norm(), 1e-7);
}

TEST_P(HardSolver, SolvesWithoutACost) {
  Problem problem;
  const auto x = problem.add(R3({1.0, 1.0, 1.0}));
  problem.subject_to(Prior<R3>{R3()}, Bounds<3>{{2.0, -3.0, 0.5}, {2.0, -3.0, 0.5}}, {x});
  const Summary s = solve(problem);
  EXPECT_LE((problem.value(x).vector() - Vector<3>(2.0, -3.0, 0.5)).norm(), kPosition);
  EXPECT_EQ(s.cost, 0.0);
}

/// Residual scale · (‖x‖² − radius²), whose rounding error exceeds the constraint tolerance if its terms are large.
struct ScaledSphere {
  static constexpr std::string_view name = "scaled sphere";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  double scale, radius;
  void operator()(const R3& p, Vector<1>& r, Matrix<1, 3>* J = nullptr) const {
    r[0] = scale * (p.vector().squaredNorm() - radius * radius);
    if (J) *J = 2.0 * scale * p.vector().transpose();
  }
};

/// NLopt's augmented Lagrangian and Ipopt with other Hessians do not scale the problem.
TEST_P(HardSolver, MeetsRowsOfAnyScaleInAnyUnits) {
  const bool slsqp = GetParam().name == "nlopt_slsqp";
  if (!slsqp && GetParam().name != "augmented_lagrangian" && GetParam().name != "ipopt_automatic") return;
  for (const double unit : {1e-3, 1.0, 1e3})
    for (const double scale : {1e-6, 1.0, 1e3, 1e6})
      for (const double sigma : {1.0, 100.0}) {
        if (slsqp && scale * unit < 1e-6) continue;  // SLSQP stops early at rows of the size of the tolerance
        SCOPED_TRACE(::testing::Message() << "unit " << unit << ", scale " << scale << ", sigma " << sigma);
        Problem problem;
        const Vector<3> p = unit * Vector<3>(750.0, -700.0, 90.0);
        const double radius = 1000.0 * unit;
        const auto x = problem.add(R3(unit * Vector<3>(700.0, -650.0, 80.0)));
        problem.minimize(Prior<R3>{R3(p)}, Gaussian(Vector<3>::Constant(sigma * unit)), {x});
        problem.subject_to(ScaledSphere{scale, radius}, equal_to(0.0), {x});
        const Summary s = GetParam()(problem);
        EXPECT_TRUE(s.converged()) << s.message;
        EXPECT_EQ(s.worst_constraint, "");
        const double tolerance = std::max(1e-7 / (2 * scale * radius), 1e-10 * radius);
        EXPECT_NEAR(problem.value(x).vector().norm(), radius, tolerance);
        // A cost on the scale of the tolerance may move the point by more.
        EXPECT_LE((problem.value(x).vector().normalized() - p.normalized()).norm(), 1e-3);
      }
}

/// Without a cost, the constraints determine the scale of the steps.
TEST_P(HardSolver, SolvesCurvedConstraintsWithoutACost) {
  if (GetParam().name != "augmented_lagrangian" && GetParam().name != "ipopt_automatic") return;
  for (const UniformBounds& bounds : {equal_to(1.0), at_most(1.0)}) {
    Problem problem;
    const auto x = problem.add(R3({3.0, 1.0, 2.0}));
    problem.subject_to(SquaredNorm{}, bounds, {x});
    const Summary s = solve(problem);
    EXPECT_LE(problem.value(x).vector().norm(), 1.0 + 1e-7);
    if (bounds.lower == 1.0) {
      EXPECT_NEAR(problem.value(x).vector().norm(), 1.0, 1e-7);
    }
  }
}

/// A converged solution must not violate a constraint.
TEST_P(HardSolver, ReportsContradictoryConstraints) {
  Problem problem;
  const auto x = problem.add(R1(Vector<1>(0.2)), "x");
  problem.minimize(Prior<R1>{R1(Vector<1>(3.0))}, Gaussian{1.0}, {x});
  problem.subject_to(Prior<R1>{R1()}, at_least(2.0), {x});
  problem.subject_to(Prior<R1>{R1()}, at_most(1.0), {x});
  const Summary s = GetParam()(problem);
  EXPECT_FALSE(s.converged());
  EXPECT_EQ(describe(s.unobservable), "");
  EXPECT_GE(s.max_violation, 0.5 - 1e-3);
  EXPECT_EQ(s.worst_constraint, "prior of x");
}

TEST_P(HardSolver, KeepsTheLeastViolatedPointWhenInterrupted) {
  Problem problem;
  const auto x = problem.add(R3({1.0, 1.0, 1.0}));
  problem.minimize(Prior<R3>{R3({2.0, -1.0, 2.0})}, Gaussian{1.0, 1.0, 1.0}, {x});
  problem.subject_to(SquaredNorm{}, equal_to(4.0), {x});
  std::atomic<bool> stop = false;
  double least = HUGE_VAL;
  const Summary s = GetParam()(problem, {.stop = &stop, .progress = [&](const Progress& p) {
                                           least = std::min(least, p.violation);
                                           if (p.iteration >= 3) stop = true;
                                         }});
  EXPECT_EQ(s.status, Status::interrupted) << s.message;
  EXPECT_NEAR(s.max_violation, least, 1e-12) << "without a feasible point, the least violated one is kept";
}

}  // namespace
}  // namespace tandem::testing

#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/residuals/constant_twist.hpp>

#include "cases.hpp"
#include "sanitized.hpp"

/// Tests discontinuous residuals, for example of rotations at π: solvers continue, and messages name them.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Residual 0 for x < 0, otherwise `height`.
struct Cliff {
  static constexpr std::string_view name = "cliff";
  static constexpr int dim = 1;
  using States = std::tuple<R1>;
  double height;
  void operator()(const R1& p, Vector<1>& r, Matrix<1, 1>* J = nullptr) const {
    r[0] = p.vector()[0] < 0 ? 0.0 : height;
    if (J) J->setZero();
  }
};

TEST(Jump, IsReportedAndTheLowerSideIsKept) {
  Problem problem;
  const auto x = problem.add(R1(Vector<1>(-1.0)), "x");
  problem.minimize(Prior<R1>{R1(Vector<1>(1.0))}, Gaussian{1.0}, {x});
  problem.minimize(Cliff{2.0}, Gaussian{1.0}, {x});
  const Summary s = solve(problem, GaussNewtonOptions{});
  EXPECT_EQ(s.status, Status::failed);
  EXPECT_THAT(s.message, HasSubstr("the cliff of x is discontinuous here"));
  EXPECT_NEAR(s.cost, 0.5, 1e-6);
  EXPECT_NEAR(problem.value(x).vector()[0], 0.0, 1e-6);
  EXPECT_LT(problem.value(x).vector()[0], 0.0);
}

/// A car on a winding road with lidar detections that are repeatedly turned by 180°.
struct TurningDetections {
  Problem problem;

  explicit TurningDetections(unsigned seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    const Vector<6> sigma(0.3, 0.3, 0.15, 0.05, 0.05, 0.05);
    const Vector<6> twist(1.0, 0.2, 0.1, 0.02, 0.02, 0.1);
    std::vector<Variable<SE3>> x;
    std::vector<double> times;
    bool turned = false;
    for (double t = 0; t < 60; t += 0.2) {
      const double yaw = 1.5 * std::sin(0.2 * t);
      if (uniform(random) < 0.4) turned = !turned;
      if (uniform(random) < 0.6) continue;  // no detection
      const SE3 z(SO3::Exp({0, 0, yaw + (turned ? std::numbers::pi : 0.0) + 0.04 * normal(random)}),
                  Vector<3>(9 * t, 4 * std::sin(0.2 * t), 0) + 0.1 * Vector<3>{normal(random), normal(random), 0});
      const std::size_t k = x.size();
      times.push_back(t);
      x.push_back(problem.add(z, "target " + std::to_string(k)));
      problem.minimize(Prior<SE3>{z}, Gaussian(sigma), {x.back()});
      if (k < 2) continue;
      const double dt1 = times[k - 1] - times[k - 2], dt2 = t - times[k - 1];
      problem.minimize(ConstantTwist<SE3>{dt1, dt2}, Gaussian(twist).scaled(std::sqrt(dt2)),
                       {x[k - 2], x[k - 1], x[k]});
    }
  }
};

TEST(Jump, IsCrossedForTurnedDetections) {
  int named = 0, lower = 0;
  for (unsigned seed = 1; seed <= 8 && !(kSanitized && named > 0 && lower > 0); ++seed) {
    TurningDetections car(seed);
    double first_jump = HUGE_VAL, last = HUGE_VAL;
    GaussNewtonOptions options;
    options.progress = [&](const Progress& p) {  // the cost increases only when the solver crosses a jump
      if (p.cost > last && first_jump == HUGE_VAL) first_jump = last;
      last = p.cost;
    };
    const Summary s = solve(car.problem, options);
    EXPECT_THAT(s.message, Not(HasSubstr("Jacobian")));
    if (!s.converged() && s.status != Status::max_iterations) {
      EXPECT_THAT(s.message, HasSubstr("is discontinuous here, like a rotation by 180 deg"));
      ++named;
    }
    EXPECT_LE(s.cost, first_jump);
    lower += s.cost < first_jump && first_jump < HUGE_VAL;
    EXPECT_NEAR(s.cost, cost_of(car.problem), 1e-9 * s.cost);
  }
  EXPECT_GT(named, 0);
  EXPECT_GT(lower, 0);
}

/// A wrong Jacobian must not be reported as a discontinuity.
struct WrongJacobian {
  static constexpr std::string_view name = "exponential";
  static constexpr int dim = 1;
  using States = std::tuple<R1>;
  void operator()(const R1& p, Vector<1>& r, Matrix<1, 1>* J = nullptr) const {
    r[0] = std::exp(p.vector()[0]);
    if (J) (*J)(0, 0) = -r[0];
  }
};

TEST(Jump, IsDistinguishedFromAWrongJacobian) {
  Problem problem;
  const auto x = problem.add(R1(Vector<1>(0.5)), "x");
  problem.minimize(WrongJacobian{}, Gaussian{1.0}, {x});
  const Summary s = solve(problem, GaussNewtonOptions{});
  EXPECT_EQ(s.status, Status::failed);
  EXPECT_THAT(s.message, HasSubstr("the Jacobian of the exponential of x disagrees with finite differences"));
}

}  // namespace
}  // namespace tandem::testing

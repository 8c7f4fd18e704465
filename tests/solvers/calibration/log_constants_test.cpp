#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/evidence.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>

#include "damped_point.hpp"

namespace tandem::testing {
namespace {

double evidence_of(const BuiltProblems& built) {
  Problem* const one[] = {built.problems[0].get()};
  CalibrationOptions options;
  options.measured = built.measured;
  options.absolute_evidence = true;
  const double constants = log_constants(one, built.measured);
  detail::Evidence evidence(one, built.groups, options);
  const auto value = evidence.at(Eigen::VectorXd::Zero(Eigen::Index(built.groups.size())));
  EXPECT_TRUE(value.usable) << value.why;
  return value.log_evidence + constants;
}

TEST(LogConstants, TheAbsoluteEvidenceIsTheKalmanFilterLikelihood) {
  const DampedPoint point(1, 80);
  const Eigen::Vector2d values[] = {{10, 3}, {1, 3}, {40, 12}, {0.2, 300}};
  for (const Eigen::Vector2d& at : values)
    EXPECT_NEAR(evidence_of(point.build(at, false)), point.exact(at), 1e-6 * std::abs(point.exact(at)));
}

TEST(LogConstants, TheEvidenceWithNormalisedPriorsIsTheKalmanFilterLikelihood) {
  DampedPoint point(1, 30);
  point.initial_sigma = 0.5;
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(10, 3), Eigen::Vector2d(1, 3), Eigen::Vector2d(4, 300)}) {
    const BuiltProblems built = point.build(at, true);
    EXPECT_NEAR(evidence_of(built), point.exact(at), 1e-4)
        << "the measurements keep a small share of their information";
    // The gradient agrees, too.
    Problem* const one[] = {built.problems[0].get()};
    CalibrationOptions options;
    options.measured = built.measured;
    options.absolute_evidence = true;
    detail::Evidence evidence(one, built.groups, options);
    const Eigen::Vector3d factors(0.2, -0.3, 0.4);
    const Eigen::VectorXd gradient = evidence.at(factors).gradient;
    for (int g = 0; g < 3; ++g) {
      const Eigen::Vector3d h = 1e-4 * Eigen::Vector3d::Unit(g);
      const Eigen::Vector3d up = (factors + h).array().exp(), down = (factors - h).array().exp();
      EXPECT_NEAR(gradient[g], (point.exact(at, up) - point.exact(at, down)) / 2e-4, 1e-3) << g;
    }
  }
}

/// The Hessian of the priors of a long chain with constant velocity is numerically singular.
TEST(LogConstants, TheAbsoluteEvidenceOfALongChainIsTheKalmanFilterLikelihood) {
  for (const int n : {220, 1000})
    for (const double initial : {5.0, 50.0}) {
      DampedPoint point(1, n);
      point.initial_sigma = initial;
      const Eigen::Vector2d values[] = {{5, 3}, {1e6, 3}};
      for (const Eigen::Vector2d& at : values)
        EXPECT_NEAR(evidence_of(point.build(at, true)), point.exact(at), 0.01) << n << " " << initial << " " << at[0];
    }
}

TEST(LogConstants, NormaliseStudentsT) {
  for (const double dof : {0.5, 3.0, 40.0})
    for (const int rows : {1, 2, 3}) {
      const Loss loss = StudentT(dof, rows);
      EXPECT_NEAR(degrees_of_freedom(loss, rows), dof, 1e-12);
      double integral = 0;  // over spherical shells of radius exp(u)
      const double area = 2 * std::pow(std::numbers::pi, 0.5 * rows) / std::tgamma(0.5 * rows), du = 1e-3;
      for (double u = -25; u < 60; u += du) {
        const double r = std::exp(u);
        integral += area * std::exp(rows * u - 0.5 * loss(r * r).rho + log_constant(loss, rows)) * du;
      }
      EXPECT_NEAR(integral, 1, 1e-6) << dof << " " << rows;
    }
  EXPECT_NEAR(log_constant(StudentT(1e6, 2), 2), log_constant({}, 2), 1e-5);
  EXPECT_THROW(log_constant({Loss::Kind::student_t, 1.0}, 3), Error);
}

}  // namespace
}  // namespace tandem::testing

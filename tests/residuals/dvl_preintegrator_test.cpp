// Covariance of preintegrated Doppler velocities.

#include <numbers>
#include <random>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <tandem/residuals/dvl_preintegrator.hpp>

namespace tandem::testing {
namespace {

const Vector<3> still = Vector<3>::Zero(), velocity(1.5, 0.2, -0.1), sigma(0.01, 0.02, 0.03);

DvlReading reading(double hold_time = 0) { return {velocity, sigma, hold_time}; }

/// Returns the largest difference divided by the largest entry.
double relative_difference(const Matrix<3, 3>& a, const Matrix<3, 3>& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

TEST(DvlPreintegrator, VarianceGrowsWithSquaredDuration) {
  DvlPreintegrator sum(reading());
  sum.advance(still, 0.03);
  sum.measure(reading());
  for (int i = 0; i < 97; ++i) sum.advance(still, 0.01);  // one reading, integrated in many steps
  const Vector<3> expected = (0.03 * 0.03 + 0.97 * 0.97) * sigma.cwiseAbs2();
  EXPECT_LE(relative_difference(sum.covariance(), expected.asDiagonal()), 1e-12) << sum.covariance();
}

TEST(DvlPreintegrator, ErrorsRotateWithTheBody) {
  // An instantaneous turn by 90° to the left between two readings: forward errors of the second reading point to the
  // initial left.
  DvlPreintegrator sum(reading());
  sum.advance(still, 1.0);
  sum.measure({Vector<3>::Zero(), sigma});
  sum.advance(Vector<3>(0, 0, 1e9), 0.5e-9 * std::numbers::pi);
  sum.measure(reading());
  sum.advance(still, 2.0);
  const Vector<3> expected = sigma.cwiseAbs2() + 4.0 * Vector<3>(sigma.y(), sigma.x(), sigma.z()).cwiseAbs2();
  EXPECT_LE(relative_difference(sum.covariance(), expected.asDiagonal()), 1e-6) << sum.covariance();
}

TEST(DvlPreintegrator, CovariancesOfSplitReadingAddUp) {
  DvlPreintegrator first(reading(1.0)), second(reading(1.0)), whole(reading(1.0));
  first.advance(still, 0.7);
  second.advance(still, 0.3);
  whole.advance(still, 1.0);
  EXPECT_LE(relative_difference(first.covariance() + second.covariance(), whole.covariance()), 1e-14);
  EXPECT_LE(relative_difference(first.covariance(), Vector<3>(0.7 * sigma.cwiseAbs2()).asDiagonal()), 1e-14);
  EXPECT_LE(relative_difference(whole.covariance(), Vector<3>(sigma.cwiseAbs2()).asDiagonal()), 1e-14);

  // If the body rotates between the parts, their covariances must not add up to less than that of the whole.
  const Vector<3> turn(0.1, -0.2, 0.9);
  DvlPreintegrator before(reading(2.0)), after(reading(2.0)), both(reading(2.0));
  before.advance(turn, 0.8);
  after.advance(turn, 1.2);
  both.advance(turn, 2.0);
  const Matrix<3, 3> R = before.rotation().matrix();
  const Matrix<3, 3> surplus = before.covariance() + R * after.covariance() * R.transpose() - both.covariance();
  const Eigen::SelfAdjointEigenSolver<Matrix<3, 3>> eigen(surplus);
  EXPECT_GE(eigen.eigenvalues().minCoeff(), -1e-12 * surplus.norm()) << surplus;
}

/// Simulates errors of readings and gyroscope and compares the sample covariance with the predicted one.
TEST(StatisticalDvlPreintegrator, SampleCovarianceMatchesPrediction) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const auto draw = [&](const Vector<3>& s) {
    return Vector<3>{s.x() * normal(random), s.y() * normal(random), s.z() * normal(random)};
  };
  const double gyroscope = 0.02;  // its effect is comparable to that of the readings' errors
  const auto summed = [&](bool errors) {
    const auto read = [&](double t) {
      const Vector<3> v = velocity + Vector<3>(0.3 * t, 0, 0.1 * t);
      return DvlReading{errors ? Vector<3>(v + draw(sigma)) : v, sigma};
    };
    DvlPreintegrator sum(read(0), gyroscope);
    double t = 0, next = 0.43;
    for (int i = 0; i < 40; ++i) {
      const double dt = 0.02 * (1 + i % 4);
      if (t >= next) sum.measure(read(t)), next += 0.5;
      const Vector<3> rate(0.05, -0.2, 0.6 - 0.1 * t);
      sum.advance(errors ? Vector<3>(rate + draw(Vector<3>::Constant(gyroscope / std::sqrt(dt)))) : rate, dt);
      t += dt;
    }
    return sum;
  };
  const DvlPreintegrator exact = summed(false);
  constexpr int n = 20'000;
  Matrix<3, 3> scatter = Matrix<3, 3>::Zero();
  for (int i = 0; i < n; ++i) {
    const Vector<3> error = summed(true).displacement() - exact.displacement();
    scatter += error * error.transpose() / n;
  }
  // The sample covariance, whitened by the prediction, must be the identity within four standard errors √(2/n).
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix<3, 3>> ratio(scatter, exact.covariance());
  EXPECT_GE(ratio.eigenvalues().minCoeff(), 1 - 4 * std::sqrt(2.0 / n)) << ratio.eigenvalues().transpose();
  EXPECT_LE(ratio.eigenvalues().maxCoeff(), 1 + 4 * std::sqrt(2.0 / n)) << ratio.eigenvalues().transpose();

  DvlPreintegrator without(reading());
  without.advance(Vector<3>(0, 0, 0.5), 2.0);
  DvlPreintegrator with(reading(), gyroscope);
  with.advance(Vector<3>(0, 0, 0.5), 2.0);
  EXPECT_GT(with.covariance().trace(), 1.05 * without.covariance().trace()) << "effect of the gyroscope noise";
}

}  // namespace
}  // namespace tandem::testing

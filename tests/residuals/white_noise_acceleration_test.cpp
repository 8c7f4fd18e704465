#include <limits>

#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/gaussian.hpp>
#include <tandem/residuals/white_noise_acceleration.hpp>

#include "residuals/white_noise_acceleration_checks.hpp"

namespace tandem::testing {
namespace {

INSTANTIATE_TYPED_TEST_SUITE_P(SE3, WhiteNoiseAccelerationTest, SE3);

TEST(WhiteNoiseAcceleration, IsConstantVelocityForPoints) {
  Vector<6> r, expected;
  expected << Vector<3>(1.0, 0.0, 0.0), Vector<3>(0.5, 0.0, -1.0);
  WhiteNoiseAcceleration<R3>{2.0}(R3(Vector<3>(1.0, 2.0, 3.0)), R3(Vector<3>(0.5, 1.0, 2.0)),
                                  R3(Vector<3>(3.0, 4.0, 7.0)), R3(Vector<3>(1.0, 1.0, 1.0)), r);
  EXPECT_EQ(r, expected);
}

TEST(WhiteNoiseAcceleration, CovarianceIsThatOfIntegratedWhiteNoise) {
  using Planar = WhiteNoiseAcceleration<SE2>;
  const Vector<3> q(0.3, 0.02, 0.5);
  const Matrix<6, 6> whole = Planar::covariance(q, 2.0), half = Planar::covariance(q, 1.0);
  EXPECT_DOUBLE_EQ(whole(1, 1), 0.02 * 8.0 / 3.0);
  EXPECT_DOUBLE_EQ(whole(1, 4), 0.02 * 2.0);
  EXPECT_DOUBLE_EQ(whole(4, 4), 0.02 * 2.0);
  EXPECT_EQ(whole, whole.transpose());
  // Two half steps equal one step: Σ(2) = Φ Σ(1) Φᵀ + Σ(1), Φ = [I, dt I; 0, I].
  Matrix<6, 6> transition = Matrix<6, 6>::Identity();
  transition.topRightCorner<3, 3>().setIdentity();
  EXPECT_LE(difference(whole, Matrix<6, 6>(transition * half * transition.transpose() + half)), 1e-15);
  for (const double dt : {1e-3, 1.0, 100.0}) {
    const Gaussian noise = Gaussian::covariance(Planar::covariance(q, dt));
    const Eigen::MatrixXd W = noise.sqrt_information(), back = (W.transpose() * W) * Planar::covariance(q, dt);
    EXPECT_EQ(noise.dim(), 6);
    EXPECT_LE((back - Eigen::MatrixXd::Identity(6, 6)).cwiseAbs().maxCoeff(), 1e-12 * std::max(dt, 1.0 / dt)) << dt;
  }
}

TEST(WhiteNoiseAcceleration, RejectsInvalidNoiseAndTime) {
  using Planar = WhiteNoiseAcceleration<SE2>;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const Vector<3> q(0.3, 0.02, 0.5);
  for (const double bad : {0.0, -1.0, infinity, std::nan("")}) {
    EXPECT_THROW(Planar::covariance(q, bad), Error) << bad;
    EXPECT_THROW(Planar::covariance(Vector<3>(0.3, bad, 0.5), 1.0), Error) << bad;
  }
}

}  // namespace
}  // namespace tandem::testing

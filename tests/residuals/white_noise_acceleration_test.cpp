#include <limits>

#include <gtest/gtest.h>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/gaussian.hpp>
#include <tandem/residuals/white_noise_acceleration.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

template <class G>
class WhiteNoiseAccelerationTest : public ::testing::Test {
 protected:
  using Prior = WhiteNoiseAcceleration<G>;
  using Twist = Rn<G::dof>;
  const G t0 = G::Exp(tangent<G>(1.1, 12.0));
  const Twist w0{tangent<G>(0.3, 1.2)}, w1{tangent<G>(-0.7, 0.4)};  // per second
};
using Groups = ::testing::Types<SE3, SE2, SO3, R3>;
TYPED_TEST_SUITE(WhiteNoiseAccelerationTest, Groups);

TYPED_TEST(WhiteNoiseAccelerationTest, vanishes_along_one_twist) {
  using G = TypeParam;
  for (const double dt : {0.01, 1.0, 5.0}) {
    Vector<2 * G::dof> r;
    WhiteNoiseAcceleration<G>{dt}(this->t0, this->w0, this->t0 * G::Exp(dt * this->w0.vector()), this->w0, r);
    EXPECT_LE(r.norm(), 4e-14) << dt;
  }
}

TYPED_TEST(WhiteNoiseAccelerationTest, is_what_the_step_and_the_twist_lack) {
  using G = TypeParam;
  constexpr int n = G::dof;
  for (const auto& d : residual_sizes<G>()) {
    Vector<2 * n> r, expected;
    WhiteNoiseAcceleration<G>{0.8}(this->t0, this->w0, this->t0 * G::Exp(d), this->w1, r);
    expected << d - 0.8 * this->w0.vector(), G::Jr_inverse(d) * this->w1.vector() - this->w0.vector();
    EXPECT_LE(difference(expected, r), 1e-13);
  }
}

TYPED_TEST(WhiteNoiseAccelerationTest, compares_the_rates_of_the_logarithm) {
  // d/dt Log(T0⁻¹ T(t)) = Jr⁻¹ ϖ, where ϖ is the twist of T(t): here by differences, along T1 Exp(h ϖ1).
  using G = TypeParam;
  constexpr int n = G::dof;
  const G t1 = this->t0 * G::Exp(tangent<G>(1.9, 3.0));
  const auto log_at = [&](double h) {
    return typename G::Tangent((this->t0.inverse() * t1 * G::Exp(h * this->w1.vector())).Log());
  };
  const auto [rate, uncertainty] = detail::differentiate<n>(log_at, 10.0);
  Vector<2 * n> r;
  WhiteNoiseAcceleration<G>{0.8}(this->t0, this->w0, t1, this->w1, r);
  EXPECT_LE((r.template tail<n>() + this->w0.vector() - rate).norm(), 1e-10 + uncertainty);
}

TYPED_TEST(WhiteNoiseAccelerationTest, has_the_right_jacobians) {
  using G = TypeParam;
  const WhiteNoiseAcceleration<G> prior{0.8};
  for (const auto& d : residual_sizes<G>())
    expect_right_jacobians(prior, this->t0, this->w0, G(this->t0 * G::Exp(d)), this->w1);
}

TYPED_TEST(WhiteNoiseAccelerationTest, has_the_right_jacobians_at_random) {
  expect_right_jacobians_at_random(WhiteNoiseAcceleration<TypeParam>{0.8}, 1);
}

using PlanarAndHeave = Bundle<SE2, Rn<1>>;
TEST(WhiteNoiseAcceleration, of_a_bundle_has_the_right_jacobians) {
  expect_right_jacobians_at_random(WhiteNoiseAcceleration<PlanarAndHeave>{0.8}, 2, 12);
}

TEST(WhiteNoiseAcceleration, is_constant_velocity_for_points) {
  Vector<6> r, expected;
  expected << Vector<3>(1.0, 0.0, 0.0), Vector<3>(0.5, 0.0, -1.0);
  WhiteNoiseAcceleration<R3>{2.0}(R3(Vector<3>(1.0, 2.0, 3.0)), R3(Vector<3>(0.5, 1.0, 2.0)),
                                  R3(Vector<3>(3.0, 4.0, 7.0)), R3(Vector<3>(1.0, 1.0, 1.0)), r);
  EXPECT_EQ(r, expected);
}

TEST(WhiteNoiseAcceleration, has_the_covariance_of_integrated_white_noise) {
  using Planar = WhiteNoiseAcceleration<SE2>;
  const Vector<3> q(0.3, 0.02, 0.5);
  const Matrix<6, 6> whole = Planar::covariance(q, 2.0), half = Planar::covariance(q, 1.0);
  EXPECT_DOUBLE_EQ(whole(1, 1), 0.02 * 8.0 / 3.0);
  EXPECT_DOUBLE_EQ(whole(1, 4), 0.02 * 2.0);
  EXPECT_DOUBLE_EQ(whole(4, 4), 0.02 * 2.0);
  EXPECT_EQ(whole, whole.transpose());
  // Two steps of half the time are one: Σ(2) = Φ Σ(1) Φᵀ + Σ(1), Φ = [I, dt I; 0, I].
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

TEST(WhiteNoiseAcceleration, has_no_covariance_without_noise_or_time) {
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

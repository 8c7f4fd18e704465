// Residuals of the chaser's own sensors: depth, GPS, heading, Doppler velocity log, coasting, bias random walk.

#include <gtest/gtest.h>

#include <tandem/residuals/coasting.hpp>
#include <tandem/residuals/depth.hpp>
#include <tandem/residuals/dvl_preintegrator.hpp>
#include <tandem/residuals/dvl_velocity.hpp>
#include <tandem/residuals/gaussian.hpp>
#include <tandem/residuals/gps.hpp>
#include <tandem/residuals/heading.hpp>
#include <tandem/residuals/preintegrated_dvl.hpp>
#include <tandem/residuals/relative_pose.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

using std::numbers::pi;

const Vector<3> lever(0.7, -1.3, 0.4);
const SE3 pose(SO3::Exp({0.3, -1.1, 2.0}), Vector<3>(12.0, -7.0, -30.0));

TEST(EgoSensors, HaveCorrectJacobians) {
  expect_correct_jacobians_at_random_states(Depth{-3.0, lever}, 1);
  expect_correct_jacobians_at_random_states(Gps{Vector<3>(1.0, 2.0, 3.0), lever}, 2);
  expect_correct_jacobians_at_random_states(Heading{SO3::Exp({0.1, 0.2, 1.3}), SO3::Exp({-0.6, 0.2, 0.8})}, 3);
  expect_correct_jacobians_at_random_states(DvlVelocity{Vector<3>(1.0, 0.2, -0.1)}, 4);
  expect_correct_jacobians_at_random_states(ScaledDvlVelocity{Vector<3>(1.0, 0.2, -0.1)}, 5);
  expect_correct_jacobians_at_random_states(PreintegratedDvl{Vector<3>(1.0, 0.2, -0.1)}, 6);
  expect_correct_jacobians_at_random_states(Coasting{0.8}, 7);
}

TEST(EgoSensors, HaveCorrectJacobiansUpToPi) {
  const R3 v(Vector<3>(1.0, -2.0, 0.5)), w(Vector<3>(0.5, -1.0, 2.0));
  for (const auto& d : residual_sizes<SE3>()) {
    const SE3 x = pose * SE3::Exp(d);
    expect_correct_jacobians(Heading{pose.rotation()}, x);
    expect_correct_jacobians(Coasting{0.8}, pose, v, x, w);
  }
}

TEST(Depth, IsSensorHeightError) {
  Vector<1> r;
  Depth{-31.0, lever}(pose, r);
  EXPECT_NEAR(r[0], -30.0 + pose.rotation().matrix().row(2).dot(lever) + 31.0, 1e-14);
  Depth{-31.0}(pose, r);
  EXPECT_DOUBLE_EQ(r[0], 1.0);
}

TEST(Gps, IsAntennaPositionError) {
  Vector<3> r;
  Gps{Vector<3>(10.0, -7.0, -31.0)}(pose, r);
  EXPECT_LE((r - Vector<3>(2.0, 0.0, 1.0)).norm(), 1e-15);
  Gps{pose.act(lever), lever}(pose, r);
  EXPECT_LE(r.norm(), 1e-14);
  // A mast of 2 m on a body that heads north (x forward is y in the world) and rolls 90° to the right (y left is up).
  const SE3 leaning(SO3(Matrix<3, 3>{{0.0, 0.0, 1.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}}), Vector<3>(5.0, 5.0, 5.0));
  Gps{Vector<3>::Zero(), Vector<3>(0.0, 0.0, 2.0)}(leaning, r);
  EXPECT_LE((r - Vector<3>(7.0, 5.0, 5.0)).norm(), 1e-14);
}

TEST(Heading, IsRotationFromMeasuredToEstimatedBody) {
  const SO3 mount = SO3::Exp({-0.6, 0.2, 0.8});
  Vector<3> r;
  for (const Vector<3>& error : {Vector<3>(0.0, 0.0, 0.0), Vector<3>(0.1, -0.2, 0.4), Vector<3>(0.0, 3.0, 0.0)}) {
    // The sensor measures the orientation of a body without `error`, which is along the body axes.
    Heading{pose.rotation() * SO3::Exp(error).inverse() * mount, mount}(pose, r);
    EXPECT_LE((r - error).norm(), 1e-14);
  }
}

TEST(DvlVelocity, IsAlongBodyAxes) {
  const SE3 north(SO3::Exp({0.0, 0.0, pi / 2}), Vector<3>(1.0, 2.0, 3.0));
  const R3 v(Vector<3>(0.0, 1.5, 0.2));  // north and up
  Vector<3> r;
  DvlVelocity{Vector<3>(1.0, 0.0, 0.0)}(north, v, r);
  EXPECT_LE((r - Vector<3>(0.5, 0.0, 0.2)).norm(), 1e-15);
  ScaledDvlVelocity{Vector<3>(1.65, 0.0, 0.22)}(north, v, Rn<1>(Vector<1>(0.1)), r);
  EXPECT_LE(r.norm(), 1e-15);
}

TEST(PreintegratedDvl, IsExactOnACircle) {
  // 3 m/s forward while turning left at 0.4 rad/s, in unequal steps.
  const double rate = 0.4, speed = 3.0, radius = speed / rate;
  const auto at = [&](double t) {
    return SE3(SO3::Exp({0.0, 0.0, rate * t}),
               Vector<3>(radius * std::sin(rate * t), radius * (1.0 - std::cos(rate * t)), 0.0));
  };
  DvlPreintegrator sum(DvlReading{Vector<3>(speed, 0.0, 0.0)});
  for (const double dt : {0.1, 0.7, 0.0, 0.03, 2.0}) sum.advance({0.0, 0.0, rate}, dt);
  EXPECT_DOUBLE_EQ(sum.dt(), 2.83);
  Vector<3> r;
  PreintegratedDvl{sum.displacement()}(pose * at(1.0), pose * at(3.83), r);
  EXPECT_LE(r.norm(), 1e-13);
  EXPECT_LE((sum.rotation().inverse() * at(2.83).rotation()).Log().norm(), 1e-15);
}

TEST(PreintegratedDvl, HoldsVelocityUntilTheNextReading) {
  const Vector<3> first(1.0, 0.5, 0.0), second(2.0, 0.0, -0.1), turn(0.0, 0.0, pi / 2);
  DvlPreintegrator sum(DvlReading{first});
  sum.advance(Vector<3>::Zero(), 0.5);
  sum.advance(turn, 1.0);
  sum.measure(DvlReading{second});
  sum.advance(Vector<3>::Zero(), 0.25);
  // A quarter turn to the left at constant body velocity (u, w) moves by 2/π (u − w, u + w). Afterwards x points along
  // the former y.
  const Vector<3> expected = 0.5 * first + 2.0 / pi * Vector<3>(0.5, 1.5, 0.0) + 0.25 * Vector<3>(0.0, 2.0, -0.1);
  EXPECT_LE((sum.displacement() - expected).norm(), 1e-15);
  EXPECT_THROW(sum.advance(turn, -0.1), Error);
  EXPECT_THROW(sum.advance(turn, std::nan("")), Error);
}

TEST(Coasting, PositionRowVanishesAtConstantAcceleration) {
  // The mean velocity is exact for constant acceleration; the velocity row penalises the acceleration.
  const Vector<3> v(1.0, -2.0, 0.5), a(0.3, 0.1, -0.2);
  const double dt = 1.7;
  const SE3 later(pose.rotation(), pose.translation() + dt * v + 0.5 * dt * dt * a);
  Vector<9> r, expected;
  Coasting{dt}(pose, R3(v), later, R3(v + dt * a), r);
  expected << Vector<3>::Zero(), pose.rotation().inverse().act(dt * a), Vector<3>::Zero();
  EXPECT_LE((r - expected).norm(), 1e-13);
  Coasting{dt}(pose, R3(v), later * SE3::Exp((Vector<6>() << 0, 0, 0, 0.1, 0.2, 0.3).finished()), R3(v + dt * a), r);
  EXPECT_LE((r.tail<3>() - Vector<3>(0.1, 0.2, 0.3)).norm(), 1e-14);
}

TEST(Coasting, CovarianceIsThatOfRandomWalkVelocity) {
  const Matrix<9, 9> whole = Coasting::covariance(0.3, 0.02, 2.0), half = Coasting::covariance(0.3, 0.02, 1.0);
  EXPECT_DOUBLE_EQ(whole(1, 1), 0.3 * 8.0 / 12.0);
  EXPECT_DOUBLE_EQ(whole(4, 4), 0.3 * 2.0);
  EXPECT_DOUBLE_EQ(whole(8, 8), 0.02 * 2.0);
  // Two half steps must equal one step. From an exact start, Σ of [p − dt v_j/2; v_j] gives that of [p; v]:
  const auto on_states = [](const Matrix<9, 9>& sigma, double dt) {
    Matrix<6, 6> by_noise = Matrix<6, 6>::Identity();
    by_noise.topRightCorner<3, 3>() = dt / 2.0 * Matrix<3, 3>::Identity();
    return Matrix<6, 6>(by_noise * sigma.topLeftCorner<6, 6>() * by_noise.transpose());
  };
  Matrix<6, 6> transition = Matrix<6, 6>::Identity();
  transition.topRightCorner<3, 3>().setIdentity();
  EXPECT_LE(difference(on_states(whole, 2.0),
                       Matrix<6, 6>(transition * on_states(half, 1.0) * transition.transpose() + on_states(half, 1.0))),
            1e-15);
  EXPECT_EQ(Gaussian::covariance(whole).dim(), 9);
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::infinity(), std::nan("")}) {
    EXPECT_THROW(Coasting::covariance(0.3, 0.02, bad), Error) << bad;
    EXPECT_THROW(Coasting::covariance(bad, 0.02, 1.0), Error) << bad;
    EXPECT_THROW(Coasting::covariance(0.3, bad, 1.0), Error) << bad;
  }
}

TEST(BiasWalk, IsRelativePoseOfBiases) {
  const Rn<6> before(Vector<6>::LinSpaced(1.0, 2.0)), after(Vector<6>::LinSpaced(0.5, 3.0));
  Vector<6> r;
  RelativePose<Rn<6>>{}(before, after, r);
  EXPECT_LE((r - (after.vector() - before.vector())).norm(), 1e-15);
  expect_correct_jacobians(RelativePose<Rn<6>>{}, before, after);
}

}  // namespace
}  // namespace tandem::testing

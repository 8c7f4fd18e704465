#include <gtest/gtest.h>

#include <tandem/residuals/depth.hpp>
#include <tandem/residuals/dvl_velocity.hpp>
#include <tandem/residuals/gps.hpp>
#include <tandem/residuals/heading.hpp>
#include <tandem/residuals/propagated.hpp>
#include <tandem/residuals/usbl_position.hpp>

#include "residuals/autodiff.hpp"
#include "residuals/imu_cases.hpp"

namespace tandem::testing {
namespace {

const Vector<3> some(0.7, -1.3, 0.4);
const Earth turning_earth{{0.1, -0.2, -9.8}, {0.02, -0.03, 0.05}};

static_assert(std::is_same_v<Propagated<Depth>::States, std::tuple<SE3, R3, Rn<6>>>);
static_assert(std::is_same_v<Propagated<DvlVelocity>::States, std::tuple<SE3, R3, Rn<6>>>);
static_assert(std::is_same_v<Propagated<ScaledDvlVelocity>::States, std::tuple<SE3, R3, Rn<6>, Rn<1>>>);
// A point state is not taken for the velocity, although it has the same type.
static_assert(std::is_same_v<Propagated<UsblPosition<SE3, R3>>::States, std::tuple<SE3, R3, Rn<6>, R3>>);

TEST(Propagated, EqualsTheResidualAtThePredictedState) {
  const ImuDelta delta = some_delta(0.005, 30);
  const SE3 x(SO3::Exp({0.4, -0.9, 1.3}), Vector<3>(5.0, -3.0, -20.0)),
      target(SO3::Exp(some), Vector<3>(1.0, 2.0, 3.0));
  const R3 v(Vector<3>(2.0, -1.0, 0.5)), point(Vector<3>(3.0, 2.0, 1.0));
  const Rn<6> b(some_bias() + 0.1 * Vector<6>::Ones());
  const Rn<1> scale(Vector<1>(0.03));
  const ImuPrediction<> at = predict(x, v, b, delta, turning_earth);
  Vector<1> depth, depth_there;
  Propagated{Depth{-3.0, some}, delta, turning_earth}(x, v, b, depth);
  Depth{-3.0, some}(at.pose, depth_there);
  EXPECT_EQ(depth, depth_there);
  Vector<3> r, there;
  Propagated{DvlVelocity{some}, delta, turning_earth}(x, v, b, r);
  DvlVelocity{some}(at.pose, at.velocity, there);
  EXPECT_EQ(r, there);
  Propagated{ScaledDvlVelocity{some}, delta, turning_earth}(x, v, b, scale, r);
  ScaledDvlVelocity{some}(at.pose, at.velocity, scale, there);
  EXPECT_EQ(r, there);
  Propagated{UsblPosition<SE3, SE3>{some}, delta, turning_earth}(x, v, b, target, r);
  UsblPosition<SE3, SE3>{some}(at.pose, target, there);
  EXPECT_EQ(r, there);
  Propagated{UsblPosition<SE3, R3>{some}, delta, turning_earth}(x, v, b, point, r);
  UsblPosition<SE3, R3>{some}(at.pose, point, there);
  EXPECT_EQ(r, there);
}

TEST(Propagated, HasCorrectJacobians) {
  const ImuDelta delta = some_delta(0.005, 30);
  expect_correct_jacobians_at_random_states(Propagated{Depth{-3.0, some}, delta, turning_earth}, 1, 20);
  expect_correct_jacobians_at_random_states(Propagated{Gps{some, some}, delta, turning_earth}, 2, 20);
  expect_correct_jacobians_at_random_states(Propagated{Heading{SO3::Exp(some)}, delta, turning_earth}, 3, 20);
  expect_correct_jacobians_at_random_states(Propagated{DvlVelocity{some}, delta, turning_earth}, 4, 20);
  expect_correct_jacobians_at_random_states(Propagated{ScaledDvlVelocity{some}, delta, turning_earth}, 5, 20);
  expect_correct_jacobians_at_random_states(Propagated{UsblPosition<SE3, SE3>{some}, delta, turning_earth}, 6, 20);
  expect_correct_jacobians_at_random_states(Propagated{UsblPosition<SE3, R3>{some}, delta, turning_earth}, 7, 20);
}

}  // namespace
}  // namespace tandem::testing

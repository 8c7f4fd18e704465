#include <gtest/gtest.h>

#include <tandem/residuals/preintegrated_imu.hpp>

#include "residuals/autodiff.hpp"
#include "residuals/imu_cases.hpp"

namespace tandem::testing {
namespace {

const SE3 start(SO3::Exp({0.4, -0.9, 1.3}), Vector<3>(5.0, -3.0, -20.0));
const R3 velocity(Vector<3>(2.0, -1.0, 0.5));

/// An Earth whose rotation is fast enough to affect the Jacobians visibly.
Earth fast_earth() { return {{0.1, -0.2, -9.8}, {0.02, -0.03, 0.05}}; }

TEST(PreintegratedImu, VanishesAtThePredictedState) {
  const ImuDelta delta = some_delta();
  const Rn<6> bias(some_bias());
  const ImuPrediction<> at = predict(start, velocity, bias, delta, fast_earth());
  Vector<15> r;
  PreintegratedImu{delta, fast_earth()}(start, velocity, bias, at.pose, at.velocity, bias, r);
  EXPECT_LE(r.norm(), 1e-14);
}

TEST(PreintegratedImu, RowsAreAlongTheAxesAtTheSecondState) {
  const ImuDelta delta = some_delta();
  const Rn<6> bias(some_bias());
  const ImuPrediction<> at = predict(start, velocity, bias, delta, fast_earth());
  Vector<6> d, db;
  d << 0.3, -0.1, 0.2, 0.05, -0.4, 0.1;
  db << 0.01, 0.02, 0.03, -0.01, -0.02, -0.03;
  const Vector<3> dv(0.2, 0.5, -0.4);
  const SE3 x(at.pose.rotation() * SO3::Exp(d.tail<3>()), at.pose.translation() + at.pose.rotation().act(d.head<3>()));
  const SO3 to_j = SO3::Exp(-d.tail<3>());
  Vector<15> r, expected;
  PreintegratedImu{delta, fast_earth()}(start, velocity, bias, x, R3(at.velocity.vector() + at.pose.rotation().act(dv)),
                                        bias * Rn<6>(db), r);
  expected << to_j.act(d.head<3>()), to_j.act(dv), d.tail<3>(), db;
  EXPECT_LE((r - expected).norm(), 1e-14);
}

TEST(PreintegratedImu, HasCorrectJacobians) {
  const PreintegratedImu imu{some_delta(), fast_earth()};
  const Rn<6> bi(some_bias() + 0.1 * Vector<6>::Ones()), bj(some_bias());
  const ImuPrediction<> at = predict(start, velocity, bi, imu.delta, imu.earth);
  for (const auto& d : residual_sizes<SE3>())
    expect_correct_jacobians(imu, start, velocity, bi, SE3(at.pose * SE3::Exp(d)), velocity, bj);
}

TEST(PreintegratedImu, HasCorrectJacobiansAtRandomStates) {
  expect_correct_jacobians_at_random_states(PreintegratedImu{some_delta(), fast_earth()}, 1, 20);
}

}  // namespace
}  // namespace tandem::testing

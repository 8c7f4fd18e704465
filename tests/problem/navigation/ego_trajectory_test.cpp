#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/ego_trajectory.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

#include "problem/tracking/level_turn.hpp"

namespace tandem {
namespace {

using ::testing::HasSubstr;
using testing::LevelTurn;
using ::testing::ThrowsMessage;

constexpr double kDuration = 8;  // s

/// Returns noisy measurements of GPS, DVL and heading at whole seconds, where both problems have keyframes.
NavigationData data_at_seconds(bool imu) {
  LevelTurn turn;
  turn.duration = kDuration;
  NavigationData data = turn.data();
  if (!imu) data.imu.reset();
  std::erase_if(data.sensors, [](const EgoSensor& s) { return s.type == EgoSensorType::depth; });
  for (EgoSensor& sensor : data.sensors) {
    sensor.mount = {};
    sensor.measurements.clear();
    for (int t = 0; t <= int(kDuration); ++t) {
      EgoMeasurement m = turn.measure(sensor, t);
      if (sensor.type != EgoSensorType::heading)
        m.value += sensor.sigma[0] * Vector<3>(std::sin(3.0 * t), std::cos(5.0 * t), std::sin(2.0 + t));
      sensor.measurements.push_back(m);
    }
  }
  return data;
}

class EgoTrajectoryOf : public ::testing::TestWithParam<bool> {};

/// The trajectory is the posterior of a problem that has a keyframe at each of the instants.
TEST_P(EgoTrajectoryOf, EqualsAKeyframeWithoutMeasurement) {
  const bool with_imu = GetParam();
  LevelTurn turn;
  turn.duration = kDuration;
  const NavigationData data = data_at_seconds(with_imu);
  NavigationProblem sparse = make_navigation_problem(data, turn.guess(1.0), turn.start());
  NavigationProblem dense = make_navigation_problem(data, turn.guess(0.5), turn.start());
  ASSERT_EQ(dense.keyframes.size(), 2 * sparse.keyframes.size() - 1);
  for (NavigationProblem* built : {&sparse, &dense})
    ASSERT_TRUE(solve(built->problem, GaussNewtonOptions{}).converged());
  std::optional<ImuRecord> imu;
  if (with_imu) {
    imu.emplace(*data.imu);
    for (const ImuSample& sample : data.imu->samples) imu->add(sample);
  }
  const Marginals of_sparse(sparse.problem), of_dense(dense.problem);
  const auto propagate = [&](const Eigen::MatrixXd& J, const std::vector<int>& ids, const std::vector<int>& dofs) {
    return of_sparse.propagated(J, ids, dofs);
  };
  const EgoTrajectory trajectory(sparse.problem, sparse.keyframes, imu ? &*imu : nullptr, data.earth, {});
  for (std::size_t k = 0; k < dense.keyframes.size(); ++k) {
    SCOPED_TRACE(dense.keyframes[k].t);
    const EgoState expected = dense.state(k);
    const MotionInstant found = trajectory.at(dense.keyframes[k].t, propagate);
    EXPECT_LE((found.position - expected.pose.translation()).norm(), 1e-4);
    EXPECT_LE((found.rotation->inverse() * expected.pose.rotation()).Log().norm(), 1e-4);
    EXPECT_LE((found.twist.head<3>() - expected.pose.rotation().inverse().act(expected.velocity)).norm(), 1e-3);
    EXPECT_NEAR(found.twist[5], LevelTurn::rate, 0.01);
    const Matrix<6, 6> covariance = of_dense.covariance(dense.keyframes[k].pose);
    EXPECT_LE((found.covariance.topLeftCorner<6, 6>() - covariance).norm(), 0.02 * covariance.norm());
  }
  EXPECT_TRUE(trajectory.at(1.3).covariance.size() == 0);
  EXPECT_THAT([&] { trajectory.at(kDuration + 1); }, ThrowsMessage<BadInputError>(HasSubstr("is outside")));
}

INSTANTIATE_TEST_SUITE_P(All, EgoTrajectoryOf, ::testing::Bool());

}  // namespace
}  // namespace tandem

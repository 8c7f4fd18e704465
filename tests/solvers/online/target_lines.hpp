#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

#include "online_cases.hpp"

/// Feeds a recording of a target to an estimator line by line, and solves the batch problem of it.
namespace tandem::testing {

/// Crops odometry to the time from the first to the last measurement, as the window of an estimator.
inline TrackingData cropped(TrackingData d) {
  double first = HUGE_VAL, last = -HUGE_VAL;
  for (const TargetSensor& sensor : d.sensors)
    for (const Measurement& m : sensor.measurements) {
      first = std::min(first, sensor.valid_at(m));
      last = std::max(last, m.t);
    }
  std::vector<Stamped<SE3>> odometry = {{first, *pose_at(d.odometry, first)}};
  for (const Stamped<SE3>& x : d.odometry)
    if (x.t > first + kSameInstant && x.t < last - kSameInstant) odometry.push_back(x);
  odometry.push_back({last, *pose_at(d.odometry, last)});
  d.odometry = odometry;
  return d;
}

struct Line {
  double t;
  int sensor;  ///< -1: odometry
  std::size_t index;
};

/// Returns all lines in the order of their stamps; at equal stamps, odometry first or last.
inline std::vector<Line> lines(const TrackingData& d, bool odometry_first = true) {
  std::vector<Line> result;
  for (std::size_t i = 0; i < d.odometry.size(); ++i) result.push_back({d.odometry[i].t, -1, i});
  for (std::size_t s = 0; s < d.sensors.size(); ++s)
    for (std::size_t i = 0; i < d.sensors[s].measurements.size(); ++i)
      result.push_back({d.sensors[s].measurements[i].t, int(s), i});
  std::stable_sort(result.begin(), result.end(), [&](const Line& a, const Line& b) {
    if (a.t != b.t) return a.t < b.t;
    return odometry_first ? a.sensor < b.sensor : a.sensor > b.sensor;
  });
  return result;
}

inline std::optional<Rejection> give(const TrackingData& d, const Line& line, OnlineEstimator& estimator) {
  if (line.sensor < 0) return estimator.add_odometry(d.odometry[line.index]);
  const auto s = std::size_t(line.sensor);
  return estimator.add_target(s, d.sensors[s].measurements[line.index]);
}

inline OnlineOptions exactly_tracking(const TrackingOptions& tracking, double window = 1e3) {
  OnlineOptions options = exactly(window);
  options.tracking = tracking;
  return options;
}

inline void run(const TrackingData& d, OnlineEstimator& estimator, bool odometry_first = true) {
  for (const Line& line : lines(d, odometry_first)) {
    const auto rejection = give(d, line, estimator);
    EXPECT_FALSE(rejection) << rejection->text;
  }
  estimator.finish();
}

inline TrackingProblem batch(const TrackingData& d, const TrackingOptions& options) {
  TrackingProblem problem = make_tracking_problem(d, options);
  const Summary summary = solve(problem.problem, GaussNewtonOptions{});
  EXPECT_TRUE(summary.converged()) << summary.message;
  return problem;
}

inline void expect_same(const OnlineEstimator& estimator, const TrackingProblem& all, double tolerance = 1e-4) {
  const std::size_t last = all.keyframes.size() - 1;
  ASSERT_NEAR(estimator.newest(), all.keyframes[last].t, 1e-9);
  EXPECT_EQ(estimator.keyframes(), all.keyframes.size());
  EXPECT_LE((estimator.chaser().pose.inverse() * all.chaser_pose(last)).Log().norm(), tolerance);
  const TargetState a = estimator.target().value(), b = all.target_state(last);
  EXPECT_LE((a.position - b.position).norm(), tolerance);
  ASSERT_EQ(a.rotation.has_value(), b.rotation.has_value());
  if (a.rotation) {
    EXPECT_LE((a.rotation->inverse() * *b.rotation).Log().norm(), tolerance);
  }
}

}  // namespace tandem::testing

#pragma once

#include <tandem/studies/estimation/estimate.hpp>

namespace tandem {

/// Returns an estimate with two keyframes, the first with a measured position, and without covariances.
inline Estimate made_up() {
  Estimate estimate;
  estimate.scenario = "made up";
  estimate.summary.solver = "gauss-newton";
  estimate.summary.status = Status::converged;
  estimate.summary.message = "the cost no longer decreases";
  estimate.summary.initial_cost = 20.0;
  estimate.summary.cost = 1.25;
  estimate.summary.iterations = 3;
  estimate.summary.evaluations = 4;
  estimate.summary.seconds = 0.5;
  estimate.residual_blocks = 7;
  estimate.keyframes = {{0.1, KeyframeType::position, Vector<3>(1, 2, 3), {}}, {1.0 / 3.0, KeyframeType::none, {}, {}}};
  estimate.chaser = {SE3(), SE3(SO3::Exp({0, 0, 1}), Vector<3>(1.0 / 3.0, 0, 0))};
  estimate.target = {SE3(), SE3(SO3(), Vector<3>(2, 0, 0))};
  estimate.errors = {{0.1, KeyframeType::position, 0.5, 10.0, 2.5, {}},
                     {1.0 / 3.0, KeyframeType::none, 1.5, 20.0, {}, {}}};
  estimate.measurements = {{.sensor = 0, .index = 0, .t = 0.1, .parts = {{"all", 1.0}}}};
  estimate.sensors = {{.name = "usbl", .type = SensorType::position, .used = 1},
                      {.name = "optical", .type = SensorType::pose}};
  return estimate;
}

}  // namespace tandem

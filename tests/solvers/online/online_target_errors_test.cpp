#include <algorithm>

#include <gtest/gtest.h>

#include "problem/tracking/simulated_run.hpp"
#include "target_lines.hpp"

/// Systematic errors of target sensors in online estimation.
namespace tandem::testing {
namespace {

TrackingData noisy_run() {
  Simulation simulation;
  simulation.noise = 1.0;
  TrackingData d = cropped(simulation.data());
  d.noise.constant_velocity.setConstant(0.1);
  return d;
}

TEST(OnlineTarget, SystematicErrorsAgreeWithTheBatchEstimate) {
  TrackingData d = noisy_run();
  for (TargetSensor& sensor : d.sensors) {
    const bool pose = sensor.type->has(measured::rotation);
    SystematicError& error = sensor.error.emplace();
    error.bias_sigma = Eigen::VectorXd::Constant(sensor.sigma.size(), pose ? 0.05 : 1.0);
    error.correlation_time = pose ? 5.0 : HUGE_VAL;
    error.misalignment_sigma = pose ? 0.0 : 0.05;
    error.scale_sigma = pose ? 0.02 : 0.0;
  }
  for (const Mode mode : {Mode::A, Mode::B}) {
    OnlineEstimator estimator(d, {}, exactly_tracking({.mode = mode}));
    run(d, estimator);
    TrackingProblem whole = batch(d, {.mode = mode});
    expect_same(estimator, whole);
    const auto errors = estimator.sensor_errors();
    for (const SensorConstant& c : whole.constants) {
      const auto same = std::find_if(errors.begin(), errors.end(), [&](const auto& e) { return e.name == c.name; });
      ASSERT_NE(same, errors.end()) << c.name;
      const Eigen::VectorXd value =
          std::visit([&](const auto& x) { return Eigen::VectorXd(whole.problem.value(x).Log()); }, c.state);
      const bool metres = c.name.ends_with(".bias");  // same tolerance as positions in expect_same()
      EXPECT_LE((same->value - value).norm(), metres ? 1e-4 : 1e-6) << c.name;
      EXPECT_EQ(same->prior_sigma, c.sigma);
      ASSERT_EQ(same->sigma.size(), value.size());
      EXPECT_TRUE((same->sigma.array() > 0).all() && (same->sigma.array() <= same->prior_sigma.array()).all());
    }
    for (const TargetSensor& sensor : d.sensors)
      EXPECT_TRUE(
          std::any_of(errors.begin(), errors.end(), [&](const auto& e) { return e.name == sensor.name + ".bias"; }));
  }
}

OnlineEstimator::SensorError found(const OnlineEstimator& estimator, const std::string& name) {
  for (const OnlineEstimator::SensorError& error : estimator.sensor_errors())
    if (error.name == name) return error;
  ADD_FAILURE() << "there is no " << name;
  return {};
}

TEST(OnlineTarget, ADelayAgreesWithTheBatchEstimate) {
  TrackingData d = noisy_run();
  for (TargetSensor& sensor : d.sensors) {
    sensor.error.emplace().delay_sigma = 0.3;
    if (sensor.type->has(measured::rotation)) {
      sensor.error->bias_sigma = Eigen::VectorXd::Constant(6, 0.05);
      sensor.error->correlation_time = 5;
    }
  }
  for (const Mode mode : {Mode::A, Mode::B}) {
    OnlineOptions options = exactly_tracking({.mode = mode});
    options.reset.gate = HUGE_VAL;
    OnlineEstimator estimator(d, {}, options);
    run(d, estimator);
    EXPECT_TRUE(estimator.solve_to_convergence().converged());
    TrackingProblem whole = batch(d, {.mode = mode});
    expect_same(estimator, whole);
    ASSERT_EQ(whole.constants.size(), 2u);
    for (const SensorConstant& c : whole.constants) {
      const double value = whole.problem.value(std::get<Variable<Rn<1>>>(c.state)).vector()[0];
      const OnlineEstimator::SensorError online = found(estimator, c.name);
      EXPECT_NEAR(online.value[0], value, 1e-5) << c.name;
      EXPECT_EQ(online.prior_sigma, c.sigma);
      EXPECT_TRUE(online.sigma[0] > 0 && online.sigma[0] < 0.3) << c.name;
    }
  }
}

/// Occasional poses, and positions with stamps 0.4 s late, in windows of 8 s.
TEST(OnlineTarget, EstimatesADelayAndAnUnbiasedPosition) {
  SimulatedRun simulation;
  simulation.duration = 120;
  TrackingData data = simulation.data(
      {{.name = "camera", .type = SensorType::pose}, {.name = "usbl", .type = SensorType::position, .delay = 0.4}},
      every(1.0, 1.0, 120.0));
  std::erase_if(data.sensors[0].measurements,
                [](const Measurement& m) { return std::fmod(m.t, 20.0) > 2.0 || m.t > 110; });
  data.sensors[1].delay = 0;
  data = cropped(data);
  const auto error_at_the_end = [&](const OnlineEstimator& estimator) {
    return (estimator.target()->position - simulation.target(estimator.newest()).translation()).norm();
  };
  OnlineOptions options;
  options.lag.window = 8;
  const double gate = options.reset.gate;
  options.reset.gate = HUGE_VAL;
  OnlineEstimator without_delay(data, {}, options);
  run(data, without_delay);
  EXPECT_GE(error_at_the_end(without_delay), 0.4);
  for (const double given : {0.5, 0.2})  // 0.8 and 2 prior standard deviations
    for (const bool by_keyframes : {false, true}) {
      options.reset.gate = gate;
      options.lag.window = by_keyframes ? HUGE_VAL : 8;
      options.lag.max_keyframes = by_keyframes ? 9 : 0;
      data.sensors[1].error.emplace().delay_sigma = given;
      OnlineEstimator estimator(data, {}, options);
      std::size_t most = 0;
      estimator.on_update = [&](const OnlineUpdate& u) {
        EXPECT_TRUE(u.summary.converged()) << u.summary.message;
        most = std::max(most, estimator.keyframes());
      };
      run(data, estimator);
      EXPECT_LE(most, 10u);
      for (const SensorHealth& sensor : estimator.health().sensors) EXPECT_EQ(sensor.rejected, 0u) << given;
      const OnlineEstimator::SensorError delay = found(estimator, "usbl.delay");
      EXPECT_NEAR(delay.value[0], 0.4, 0.03) << given;
      EXPECT_LE(delay.sigma[0], 0.1);
      EXPECT_LE(error_at_the_end(estimator), 0.1);
    }
}

/// Measurements arrive when keyframes exist before and after their time.
TEST(OnlineTarget, UsesLateMeasurementsOfSensorsWithSystematicErrors) {
  SimulatedRun simulation;
  simulation.duration = 60;
  TrackingData data = cropped(
      simulation.data({{.name = "camera", .type = SensorType::pose}, {.name = "usbl", .type = SensorType::position}},
                      every(1.0, 1.0, 60.0)));
  std::erase_if(data.sensors[0].measurements, [](const Measurement& m) { return std::fmod(m.t, 20.0) > 2.0; });
  for (Measurement& m : data.sensors[1].measurements) m = simulation.measure(data.sensors[1], m.t - 0.4);
  for (Measurement& m : data.sensors[1].measurements) m.position = 1.1 * m.position + Vector<3>(0, 0, 2);
  const SystematicError kinds[] = {{.scale_sigma = 0.2},
                                   {Vector<3>::Constant(3), HUGE_VAL, 0.2},
                                   {Vector<3>::Constant(3), 60, 0.2},
                                   {Vector<3>::Constant(3), HUGE_VAL, 0.2, 0, 0.3}};
  for (const SystematicError& kind : kinds) {
    data.sensors[1].error = kind;
    OnlineOptions options;
    options.lag.window = 20;
    options.reset.gate = HUGE_VAL;
    OnlineEstimator estimator(data, {}, options);
    std::vector<Line> all = lines(data);
    for (Line& line : all)
      if (line.sensor == 1) line.t += 1.3;  // time of arrival; the stamp stays
    std::stable_sort(all.begin(), all.end(), [](const Line& a, const Line& b) { return a.t < b.t; });
    for (const Line& line : all)
      if (const auto rejection = give(data, line, estimator)) {
        EXPECT_LT(line.t, 3) << rejection->text;
      }
    estimator.finish();
    EXPECT_NEAR(found(estimator, "usbl.scale").value[0], 0.1, kind.has_bias() ? 0.02 : 0.1);
    const SE3 truth = simulation.target(estimator.newest());
    EXPECT_LE((estimator.target()->position - truth.translation()).norm(), kind.has_bias() ? 0.5 : 2.5);
  }
}

/// In mode B, late poses fall between points, or between a pose and a point for the one in five that is in time.
TEST(OnlineTarget, UsesLatePosesWithSystematicErrorsBetweenPoints) {
  SimulatedRun simulation;
  simulation.duration = 60;
  TrackingData data = cropped(
      simulation.data({{.name = "camera", .type = SensorType::pose}, {.name = "usbl", .type = SensorType::position}},
                      every(1.0, 1.0, 60.0)));
  data.sensors[1].sigma.setConstant(0.5);
  TargetSensor& camera = data.sensors[0];
  camera.measurements.clear();
  for (const double t : every(0.2, 0.6, 59.8))
    if (std::fmod(t, 1.0) > 0.5) camera.measurements.push_back(simulation.measure(camera, t));
  for (Measurement& m : camera.measurements) m.position *= 1.1;
  const SystematicError kinds[] = {{.scale_sigma = 0.2},
                                   {.scale_sigma = 0.2, .misalignment_sigma = 0.05, .delay_sigma = 0.2}};
  for (const Junction junction : {Junction::boundary, Junction::direct})
    for (const SystematicError& kind : kinds) {
      camera.error = kind;
      OnlineOptions options;
      options.tracking.mode = Mode::B;
      options.tracking.junction = junction;
      options.lag.window = 20;
      options.reset.gate = HUGE_VAL;
      OnlineEstimator estimator(data, {}, options);
      std::vector<Line> all = lines(data);
      for (Line& line : all)
        if (line.sensor == 0 && std::abs(std::fmod(line.t, 5.0) - 2.6) > 0.1) line.t += 1.3;
      std::stable_sort(all.begin(), all.end(), [](const Line& a, const Line& b) { return a.t < b.t; });
      int rejected = 0;
      for (const Line& line : all) rejected += give(data, line, estimator).has_value();
      estimator.finish();
      if (junction == Junction::boundary) {
        EXPECT_LE(rejected, 2);  // before the target is initialised
      } else {
        EXPECT_NEAR(rejected, 12, 2);  // next to poses
      }
      EXPECT_NEAR(found(estimator, "camera.scale").value[0], 0.1, 0.03);
      const double t = estimator.newest();
      EXPECT_LE((estimator.chaser().pose.inverse().act(estimator.target()->position) -
                 simulation.chaser(t).inverse().act(simulation.target(t).translation()))
                    .norm(),
                0.3);
    }
}

/// Windows shorter than the time over which the delay needs the motion: measurements leave without information on the
/// delay.
TEST(OnlineTarget, ConvergesWithADelayInAShortWindow) {
  SimulatedRun simulation;
  simulation.duration = 60;
  TrackingData data = cropped(simulation.data({{.name = "camera", .type = SensorType::pose}}, every(0.5, 0.5, 60.0)));
  data.sensors[0].error.emplace().delay_sigma = 2;
  for (const double window : {1.0, 2.0, 5.0}) {
    OnlineOptions options;
    options.lag.window = window;
    OnlineEstimator estimator(data, {}, options);
    int failed = 0;
    estimator.on_update = [&](const OnlineUpdate& u) { failed += !u.summary.converged(); };
    run(data, estimator);
    EXPECT_EQ(failed, 0) << window;
    const SE3 truth = simulation.target(estimator.newest());
    EXPECT_LE((estimator.target()->position - truth.translation()).norm(), 0.5) << window;
  }
}

/// Positions with an error of 2 m, and correct poses in short intervals until 110 s. The final window of 8 s has no
/// pose.
struct OffPositions {
  TrackingData data;
  SimulatedRun simulation;

  explicit OffPositions(double time) {
    simulation.duration = 120;
    data =
        simulation.data({{.name = "camera", .type = SensorType::pose}, {.name = "usbl", .type = SensorType::position}},
                        every(1.0, 0.0, 120.0));
    std::erase_if(data.sensors[0].measurements,
                  [](const Measurement& m) { return std::fmod(m.t, 20.0) > 2.0 || m.t > 110; });
    for (Measurement& m : data.sensors[1].measurements) m.position += Vector<3>(2, 0, 0);
    data.sensors[1].sigma.setConstant(0.3);
    SystematicError& error = data.sensors[1].error.emplace();
    error.bias_sigma = Eigen::VectorXd::Constant(3, 3.0);
    error.correlation_time = time;
    data = cropped(data);
  }
  double error_at_the_end() const {
    OnlineOptions options;
    options.lag.window = 8;
    options.reset.gate = HUGE_VAL;
    OnlineEstimator estimator(data, {}, options);
    std::size_t most = 0;
    estimator.on_update = [&](const OnlineUpdate& u) {
      EXPECT_NE(u.summary.status, Status::failed);
      most = std::max(most, estimator.keyframes());
    };
    run(data, estimator);
    EXPECT_LE(most, 10u);
    return (estimator.target()->position - simulation.target(estimator.newest()).translation()).norm();
  }
};

TEST(OnlineTarget, RemembersABiasBeyondTheWindow) {
  OffPositions constant(HUGE_VAL), slow(600);
  EXPECT_LE(constant.error_at_the_end(), 0.3);
  EXPECT_LE(slow.error_at_the_end(), 0.6);
  constant.data.sensors[1].error.reset();
  EXPECT_GE(constant.error_at_the_end(), 1.0);
}

}  // namespace
}  // namespace tandem::testing

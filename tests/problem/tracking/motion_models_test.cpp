#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/solvers/gauss_newton.hpp>

#include "simulated_run.hpp"

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

struct ModelCase {
  MotionModel model;
  bool planar, turning;  ///< whether the model can follow a turn
};

class MotionModels : public ::testing::TestWithParam<ModelCase> {
 protected:
  SimulatedRun run{.planar = GetParam().planar, .target_twist = twist(0.9, GetParam().turning ? 0.06 : 0.0)};
  TrackingOptions options{.model = GetParam().model};
  TrackingData data = run.data({{.name = "sonar", .type = SensorType::position}}, every(0.8, 0.0, run.duration));

  /// Adds two pose measurements: positions alone do not determine the heading of a target with a constant twist.
  MotionModels() {
    data.sensors.push_back(run.data({{.name = "camera", .type = SensorType::pose}}, {3.2, 8.8}).sensors[0]);
    data.noise.twist_time.setConstant(1e13);  // no damping: the target has a constant twist
    data.noise.velocity_time.setConstant(1e13);
  }
};

TEST_P(MotionModels, CostIsZeroAtTruth) {
  TrackingProblem tracking = make_tracking_problem(data, options);
  if (GetParam().turning) {  // the initial guess of a straight line is exact
    EXPECT_GT(cost(tracking), 1e-3);
  }
  run.set_truth(tracking);
  EXPECT_LE(cost(tracking), 1e-18);
  EXPECT_LE(run.largest_error(tracking), 1e-12);
  EXPECT_LE(run.largest_angle(tracking), 1e-12);
}

TEST_P(MotionModels, ConvergesToTruthFromInitialGuess) {
  TrackingProblem tracking = make_tracking_problem(data, options);
  const Summary summary = solve(tracking.problem, GaussNewtonOptions{});
  EXPECT_TRUE(summary.converged()) << summary.message;
  EXPECT_LE(summary.cost, 1e-8);
  EXPECT_LE(run.largest_error(tracking), 1e-4);
  EXPECT_LE(run.largest_angle(tracking), 1e-3);
}

TEST_P(MotionModels, SupportsFewKeyframes) {
  for (const std::size_t count : {1u, 2u, 3u}) {
    options.max_keyframes = count;
    TrackingProblem tracking = make_tracking_problem(data, options);
    EXPECT_EQ(tracking.keyframes.size(), count);
    EXPECT_TRUE(std::isfinite(cost(tracking)));
    EXPECT_TRUE(tracking.target_state(0).position.allFinite());
  }
}

INSTANTIATE_TEST_SUITE_P(All, MotionModels,
                         ::testing::Values(ModelCase{MotionModel::constant_twist, false, true},
                                           ModelCase{MotionModel::constant_twist, true, true},
                                           ModelCase{MotionModel::constant_velocity, false, false},
                                           ModelCase{MotionModel::constant_velocity, true, false},
                                           ModelCase{MotionModel::damped_twist, false, true},
                                           ModelCase{MotionModel::damped_twist, true, true},
                                           ModelCase{MotionModel::damped_velocity, false, false},
                                           ModelCase{MotionModel::damped_velocity, true, false},
                                           ModelCase{MotionModel::white_noise_acceleration, false, true},
                                           ModelCase{MotionModel::white_noise_acceleration, true, true},
                                           ModelCase{MotionModel::steady_course, false, false},
                                           ModelCase{MotionModel::steady_course, true, false}),
                         [](const auto& info) {
                           std::string name(tandem::name(info.param.model));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name + (info.param.planar ? "_SE2" : "_SE3");
                         });

TrackingData positions(const SimulatedRun& run, const std::vector<double>& times) {
  return run.data({{.name = "sonar", .type = SensorType::position}}, times);
}

TEST(ConstantVelocity, HasOnlyPoints) {
  const TrackingProblem tracking =
      make_tracking_problem(patterned({}, "pPP.p"), {.model = MotionModel::constant_velocity});
  EXPECT_EQ(tracking.problem.size().unknowns, 5 * (6 + 3));
  for (std::size_t k = 0; k < 5; ++k) EXPECT_FALSE(tracking.target_state(k).rotation.has_value());
}

TEST(ConstantVelocity, DoesNotNeedNoiseOfPoses) {
  const SimulatedRun run{.target_twist = twist(0.9, 0.0)};
  TrackingData data = positions(run, {0.0, 3.0, 9.0, 12.0});
  data.noise.constant_twist.setZero();
  TrackingProblem tracking = make_tracking_problem(data, {.model = MotionModel::constant_velocity});
  EXPECT_LE(run.largest_error(tracking), 0.5) << "initial guess";
  EXPECT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
  EXPECT_LE(run.largest_error(tracking), 1e-4);
}

/// The initial guess of a turning target must not be a straight line if only the noise of constant velocity is given.
TEST(ConstantVelocity, InitialGuessFollowsTurnWithoutNoiseOfPoses) {
  const SimulatedRun run{.duration = 40.0, .target_twist = twist(0.9, 0.1)};
  TrackingData data = positions(run, every(1.0, 0.0, 40.0));
  data.noise.constant_twist.setZero();
  const TrackingProblem tracking = make_tracking_problem(data, {.model = MotionModel::constant_velocity});
  EXPECT_LE(run.largest_error(tracking), 0.2);
}

TEST(WhiteNoiseAcceleration, UsesNoiseOfAccelerationOrConstantTwist) {
  const SimulatedRun run{.target_twist = twist(0.9, 0.0)};
  TrackingData data = positions(run, {0.0, 6.0, 12.0});
  const auto disturbed = [&] {  // cost of one pose that is 2 m off the line
    TrackingProblem tracking = make_tracking_problem(data, {.model = MotionModel::white_noise_acceleration});
    run.set_truth(tracking);
    const auto x = std::get<Variable<SE3>>(tracking.target[3]);
    tracking.problem.set_value(x, tracking.problem.value(x) * SE3(SO3(), Vector<3>(0, 2, 0)));
    return cost(tracking);
  };
  const double by_twist = disturbed();
  data.noise.acceleration = data.noise.constant_twist;
  EXPECT_NEAR(disturbed(), by_twist, 1e-9 * by_twist);
  data.noise.acceleration *= 2.0;
  EXPECT_NEAR(disturbed(), by_twist / 4, 1e-9 * by_twist);
  data.noise.acceleration.setZero();
  data.noise.constant_twist.setZero();
  EXPECT_THAT([&] { disturbed(); }, ThrowsMessage<Error>(HasSubstr("acceleration")));
}

TEST(SteadyCourse, HasOnePoseAndOneSpeed) {
  const TrackingProblem tracking = make_tracking_problem(patterned({}, "pPP.p"), {.model = MotionModel::steady_course});
  EXPECT_EQ(tracking.problem.size().unknowns, 5 * 6 + 6 + 1);
  EXPECT_EQ(tracking.problem.num_soft_blocks(), 1 + 4 + 4 + 1);  // prior, odometry, measurements, roll-pitch
  EXPECT_EQ(make_tracking_problem(patterned({.planar = true}, "pPP.p"), {.model = MotionModel::steady_course})
                .problem.size()
                .unknowns,
            5 * 3 + 3 + 1);
}

TEST(Horizons, HaveExpectedNumberOfTriples) {
  const TrackingData data = patterned({}, "Pppppppp");  // eight keyframes
  const auto blocks = [&](const TrackingOptions& options) {
    return make_tracking_problem(data, options).problem.num_soft_blocks();
  };
  const int without_triples = blocks({}) - 6;
  for (const MotionModel model : {MotionModel::constant_twist, MotionModel::constant_velocity}) {
    // Points have no roll-pitch blocks.
    const int others = model == MotionModel::constant_twist ? without_triples : without_triples - 8;
    EXPECT_EQ(blocks({.model = model, .horizons = {{1, 1}, {2, 2}}}), others + 6 + 4);
    EXPECT_EQ(blocks({.model = model, .horizons = {{5, 2}}}), others + 1);
    EXPECT_EQ(blocks({.model = model, .horizons = {{5, 3}}}), others);
    EXPECT_EQ(blocks({.model = model, .horizons = {{1, 3}, {3, 1}, {6, 1}}}), others + 4 + 4 + 1);
  }
  EXPECT_EQ(blocks({.mode = Mode::B, .horizons = {{1, 1}, {2, 1}}}), blocks({.mode = Mode::B}) + 5);
}

TEST(Horizons, CostIsZeroAtTruth) {
  SimulatedRun run;
  TrackingProblem tracking = make_tracking_problem(positions(run, every(0.7, 0.1, run.duration)),
                                                   {.horizons = {{1, 1}, {1, 4}, {4, 1}, {3, 2}}});
  run.set_truth(tracking);
  EXPECT_LE(cost(tracking), 1e-18);
}

/// Compares the variance of a triple (m, n), computed from the cost of an error, with the sum of independent
/// disturbances of the velocity at each keyframe between its ends. Keyframes are 1 s apart.
TEST(Horizons, VarianceMatchesIndependentDisturbances) {
  const SimulatedRun still{.target_twist = twist(0.0, 0.0)};
  for (const auto& [m, n] : std::vector<std::pair<int, int>>{{1, 1}, {1, 2}, {2, 1}, {2, 2}, {1, 5}, {5, 1}, {4, 3}}) {
    SCOPED_TRACE(std::to_string(m) + ", " + std::to_string(n));
    SimulatedRun run = still;
    run.duration = m + n;
    const TrackingData data = positions(run, {0.0});
    const double sigma = data.noise.constant_velocity[0];
    for (const std::size_t copies : {1u, 2u}) {
      TrackingProblem tracking = make_tracking_problem(
          data, {.model = MotionModel::constant_velocity, .horizons = std::vector<Horizon>(copies, Horizon{m, n})});
      run.set_truth(tracking);
      const double distance = 0.3;
      const auto last = std::get<Variable<R3>>(tracking.target.back());
      tracking.problem.set_value(last, R3(tracking.problem.value(last).vector() + Vector<3>(distance, 0, 0)));
      const double variance = double(copies) * distance * distance / (2 * cost(tracking));  // cost = ½ Σ d²/variance

      double expected = 0;
      for (int at = 1; at < m + n; ++at) {  // the velocity changes by one σ at this keyframe
        const auto position = [&](int k) { return k > at ? double(k - at) : 0.0; };
        const double e = position(m + n) - position(m) - double(n) / m * (position(m) - position(0));
        expected += sigma * sigma * e * e;
      }
      EXPECT_NEAR(variance, double(copies) * expected, 1e-9 * expected);
    }
  }
}

/// Compares the damped models with the undamped ones by the cost of one state that is off the line.
class Damped : public ::testing::TestWithParam<bool> {
 protected:
  const bool planar = GetParam();
  const SimulatedRun run{.planar = planar, .duration = 6.0, .target_twist = twist(0.9, 0.0)};
  TrackingData data = positions(run, {0.0});

  double cost_off_the_line(MotionModel model, Mode mode, std::vector<Horizon> horizons = {{1, 1}}) {
    TrackingProblem tracking =
        make_tracking_problem(data, {.model = model, .mode = mode, .horizons = std::move(horizons)});
    run.set_truth(tracking);
    std::visit(
        [&]<class X>(const X& x) {
          if constexpr (!requires { x.first; }) {
            auto value = tracking.problem.value(x);
            typename decltype(value)::Tangent step = decltype(value)::Tangent::Zero();
            step[0] = 0.3;
            tracking.problem.set_value(x, value * decltype(value)::Exp(step));
          }
        },
        tracking.target[3]);
    return cost(tracking);
  }
};

TEST_P(Damped, EqualConstantModelsForLongTimeConstants) {
  data.noise.twist_time.setConstant(1e12);
  data.noise.velocity_time.setConstant(1e12);
  const double twist = cost_off_the_line(MotionModel::constant_twist, Mode::A);
  EXPECT_GT(twist, 1);
  EXPECT_NEAR(cost_off_the_line(MotionModel::damped_twist, Mode::A), twist, 1e-8 * twist);
  const double velocity = cost_off_the_line(MotionModel::constant_velocity, Mode::A);
  EXPECT_NEAR(cost_off_the_line(MotionModel::damped_velocity, Mode::A), velocity, 1e-8 * velocity);
  const double mixed = cost_off_the_line(MotionModel::constant_twist, Mode::B);
  EXPECT_NEAR(cost_off_the_line(MotionModel::damped_twist, Mode::B), mixed, 1e-8 * mixed);
  EXPECT_NEAR(cost_off_the_line(MotionModel::damped_velocity, Mode::A, {{1, 1}, {1, 1}}), velocity, 1e-8 * velocity)
      << "repeated horizons count once";
}

TEST_P(Damped, UseTimeConstantsAndNoiseOfAcceleration) {
  const double before = cost_off_the_line(MotionModel::damped_twist, Mode::A);
  data.noise.twist_time[0] = 2.0;
  EXPECT_GT(std::abs(cost_off_the_line(MotionModel::damped_twist, Mode::A) - before), 1e-3 * before);
  data.noise.twist_time[0] = TrackingNoise::kDefaultTimeConstant;
  data.noise.acceleration = 0.5 * data.noise.constant_twist;
  const double sharper = cost_off_the_line(MotionModel::damped_twist, Mode::A);
  EXPECT_GT(sharper, 2 * before);
  const double points = cost_off_the_line(MotionModel::damped_velocity, Mode::A);
  data.noise.velocity_time.setConstant(2.0);
  EXPECT_GT(std::abs(cost_off_the_line(MotionModel::damped_velocity, Mode::A) - points), 1e-3 * points);
  data.noise.twist_time[0] = 0;
  EXPECT_THAT([&] { cost_off_the_line(MotionModel::damped_twist, Mode::A); },
              ThrowsMessage<Error>(HasSubstr("twist_time")));
}

INSTANTIATE_TEST_SUITE_P(Groups, Damped, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "SE2" : "SE3"; });

class InvalidTrackingOptions : public ::testing::Test {
 protected:
  TrackingData data = patterned({}, "pPPp");

  void expect_rejected(const TrackingOptions& options, const std::string& reason) {
    EXPECT_THAT([&] { make_tracking_problem(data, options); }, ThrowsMessage<Error>(HasSubstr(reason)));
  }
};

TEST_F(InvalidTrackingOptions, TwistConstraintsWithoutTwist) {
  for (const Role role : {Role::soft, Role::hard}) {
    expect_rejected({.model = MotionModel::constant_velocity, .non_holonomic = role}, "constant-velocity");
    expect_rejected({.model = MotionModel::damped_velocity, .non_holonomic = role}, "damped-velocity");
    expect_rejected({.model = MotionModel::steady_course, .non_holonomic = role}, "steady-course");
  }
  for (const MotionModel model : {MotionModel::constant_velocity, MotionModel::steady_course}) {
    expect_rejected({.model = model, .surge = at_least(0.0)}, std::string(name(model)));
    expect_rejected({.model = model, .max_yaw_rate = 0.1}, std::string(name(model)));
  }
}

TEST_F(InvalidTrackingOptions, Horizons) {
  for (const MotionModel model : {MotionModel::white_noise_acceleration, MotionModel::steady_course})
    expect_rejected({.model = model, .horizons = {{1, 2}}}, "does not use horizons");
  expect_rejected({.horizons = {}}, "horizons: at least one");
  expect_rejected({.horizons = {{0, 1}}}, "must be at least 1, not 0 and 1");
  expect_rejected({.horizons = {{1, -1}}}, "must be at least 1, not 1 and -1");
}

TEST_F(InvalidTrackingOptions, LimitsAndShares) {
  for (const Role role : {Role::soft, Role::hard}) {
    expect_rejected({.surge = between(2.0, 1.0), .limits = role}, "above its upper bound");
    expect_rejected({.surge = between(std::nan(""), 1.0), .limits = role}, "surge");
    expect_rejected({.max_yaw_rate = -0.1, .limits = role}, "yaw rate");
    expect_rejected({.max_yaw_rate = std::nan(""), .limits = role}, "yaw rate");
  }
  expect_rejected({.position_share = 1.0}, "position_share");
  expect_rejected({.position_share = -0.1}, "position_share");
}

}  // namespace
}  // namespace tandem::testing

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/operations.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/parabolic_motion.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// Simulation of chaser and target on winding paths for 3 min. The camera has no systematic errors; the sonar has a
/// scale factor error, a misalignment and a delay. The noise matches the given standard deviations.
struct Recording {
  double scale = 0.03, delay = 0.25;
  Vector<3> turn{0.05, -0.04, 0.08};
  SE3 mount{SO3::Exp({0.2, 0.0, -0.4}), {0.5, 0.1, -0.2}};
  /// Delayed poses come from the motion model of the residual (true), or from the simulated motion (false).
  bool as_modelled = true;

  TrackingData data(unsigned seed) const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const auto draw = [&](auto sigma) {
      for (double& s : sigma) s *= normal(random);
      return sigma;
    };
    TrackingData d;
    d.keyframe_interval = 1;
    d.noise.prior = Vector<6>::Constant(1e-3);
    d.noise.odometry = Vector<6>::Constant(2e-3);
    d.noise.constant_twist = (Vector<6>() << 0.03, 0.03, 0.03, 0.01, 0.01, 0.01).finished();
    d.noise.roll_pitch = Vector<2>::Constant(1.0);
    constexpr int n = 180;
    const Vector<6> odometry = d.noise.odometry, motion = d.noise.constant_twist;
    // Steps of 0.05 s change the twists between keyframes. The target's twist is a random walk that matches the prior
    // for keyframes 1 s apart.
    constexpr int steps = 20;
    constexpr double dt = 1. / steps;
    std::vector<SE3> chaser = {SE3()}, target = {SE3(SO3::Exp({0, 0, 0.5}), {8, 3, 1})};
    Vector<6> twist = (Vector<6>() << 0.8, 0.1, 0, 0, 0, 0.05).finished();
    SE3 dead_reckoned;
    for (int i = 0; i <= n * steps; ++i) {
      const double t = i * dt;
      if (i % steps == 0) {
        if (i > 0) dead_reckoned = dead_reckoned * chaser[i - steps].inverse() * chaser[i] * SE3::Exp(draw(odometry));
        d.odometry.push_back({t, dead_reckoned});
      }
      const Vector<6> way =
          (Vector<6>() << 1.0, 0, 0.1 * std::cos(0.2 * t), 0, 0.05 * std::sin(0.3 * t), 0.3 * std::cos(0.1 * t))
              .finished();
      chaser.push_back(chaser.back() * SE3::Exp(dt * way));
      target.push_back(target.back() * SE3::Exp(dt * twist));
      twist += std::sqrt(1.5 * dt) * draw(motion);
    }
    TargetSensor camera{.name = "camera", .type = SensorType::pose, .sigma = Vector<6>::Constant(0.02)};
    TargetSensor sonar{.name = "sonar", .sigma = Vector<3>::Constant(0.1), .mount = mount};
    sonar.error = SystematicError{.scale_sigma = 0.05, .misalignment_sigma = 0.1, .delay_sigma = 0.3};
    const SE3 sensor = mount * SE3(SO3::Exp(turn), Vector<3>::Zero());
    for (std::size_t k = 1; k <= n; ++k) {
      const std::size_t now = k * steps;
      const std::size_t back = std::min<std::size_t>(k, 2), ahead = std::min<std::size_t>(n - k, 2);
      const auto delayed = [&](const std::vector<SE3>& way) {
        return as_modelled
                   ? detail::ParabolicMotion<SE3>({double(back), double(ahead)}, way[now], way[now - back * steps],
                                                  way[now + ahead * steps], -delay, false)
                         .at
                   : way[now - std::lround(delay / dt)];
      };
      const SE3 z = chaser[now].inverse() * target[now] * SE3::Exp(draw(Vector<6>(camera.sigma)));
      camera.measurements.push_back({.t = double(k), .position = z.translation(), .rotation = z.rotation()});
      const Vector<3> p = (1 + scale) * (delayed(chaser) * sensor).inverse().act(delayed(target).translation()) +
                          draw(Vector<3>(sonar.sigma));
      sonar.measurements.push_back({.t = double(k), .position = p});
    }
    d.sensors = {camera, sonar};
    return d;
  }
};

/// Errors of the estimated constants over 20 seeds: scale factor, misalignment and delay.
struct Recovery {
  Vector<5> truth, mean = Vector<5>::Zero();
  double worst = 0;  ///< largest relative error
  int inside = 0;    ///< number of the 100 estimates within two standard deviations of the truth
};
Recovery recover(const Recording& recording) {
  Recovery all{.truth = (Vector<5>() << recording.scale, recording.turn, recording.delay).finished()};
  constexpr int seeds = 20;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    TrackingProblem tracking = make_tracking_problem(recording.data(seed));
    EXPECT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
    EXPECT_EQ(tracking.constants.size(), 3u);
    const Marginals marginals(tracking.problem);
    Vector<5> error, sigma;
    int row = 0;
    for (const SensorConstant& c : tracking.constants)
      std::visit(
          [&]<LieGroup G>(const Variable<G>& x) {
            error.segment<G::dof>(row) = tracking.problem.value(x).Log() - all.truth.segment<G::dof>(row);
            sigma.segment<G::dof>(row) = marginals.covariance(x).diagonal().cwiseSqrt();
            row += G::dof;
          },
          c.state);
    all.worst = std::max(all.worst, (error.array() / all.truth.array()).abs().maxCoeff());
    all.inside += int((error.array().abs() < 2 * sigma.array()).count());
    all.mean += error / seeds;
  }
  return all;
}

TEST(StatisticalSensorConstants, EstimatesMatchTheirStandardDeviations) {
  const Recovery of = recover({});
  EXPECT_LT(of.worst, 0.15);
  EXPECT_LT((of.mean.array() / of.truth.array()).abs().maxCoeff(), 0.05) << of.mean.transpose();
  RecordProperty("inside_two_standard_errors", of.inside);
  EXPECT_GE(of.inside, 90) << "95 of 100 are expected";
}

/// The motion between keyframes is not modelled. It causes larger errors than the posterior standard deviations, which
/// are 1 ms for the delay, so only the relative errors are checked.
TEST(StatisticalSensorConstants, AreAccurateIfMotionChangesBetweenKeyframes) {
  const Recovery of = recover({.as_modelled = false});
  EXPECT_LT(of.worst, 0.15);
  EXPECT_LT((of.mean.array() / of.truth.array()).abs().maxCoeff(), 0.05) << of.mean.transpose();
}

/// The camera has no delay and is the only sensor. Noise must not bias the estimated delay.
TEST(StatisticalSensorConstants, DelayIsUnbiased) {
  double mean = 0, variance = 0;
  constexpr int seeds = 20;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    TrackingData data = Recording{.delay = 0}.data(seed);
    data.sensors.pop_back();
    data.sensors[0].error = SystematicError{.delay_sigma = 0.3};
    TrackingProblem tracking = make_tracking_problem(data);
    ASSERT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
    const auto delay = std::get<Variable<Rn<1>>>(tracking.constants.at(0).state);
    mean += tracking.problem.value(delay).vector()[0] / seeds;
    variance += Marginals(tracking.problem).covariance(delay)(0, 0) / seeds;
  }
  EXPECT_LT(std::abs(mean), std::sqrt(variance));
}

/// The motion at a delayed measurement comes from keyframes at least six standard deviations of the delay before and
/// after it, and at most a third farther away. Close keyframes share them, so that few states are coupled.
TEST(SensorConstants, DelayedMeasurementsShareFewNeighbours) {
  TrackingData data = Recording{.delay = 0}.data(1);
  data.sensors.pop_back();
  data.sensors[0].error = SystematicError{.delay_sigma = 3};
  const TrackingProblem tracking = make_tracking_problem(data);
  const double last = tracking.keyframes.back().t;
  std::map<int, double> times;
  for (std::size_t k = 0; k < tracking.target.size(); ++k)
    times[tracking.problem.id(std::get<Variable<SE3>>(tracking.target[k]))] = tracking.keyframes[k].t;
  std::set<double> neighbours;
  for (const PlacedMeasurement& m : tracking.measurements) {
    const double t = tracking.keyframes[m.keyframe].t;
    for (const int id : tracking.problem.linearization(m.block.value()).variable_ids) {
      const auto at = times.find(id);
      if (at == times.end() || at->second == t) continue;
      neighbours.insert(at->second);
      const double away = std::abs(at->second - t);
      EXPECT_LE(away, 24 + 1) << t;
      if (at->second > 0 && at->second < last) EXPECT_GE(away, 18) << t;
    }
  }
  EXPECT_LE(neighbours.size(), 31u) << "one in each 6 s of 180 s, and the last keyframe";
  EXPECT_GE(neighbours.size(), 30u);
}

TEST(SensorConstants, UnobservableOnesKeepPriorSigma) {
  TrackingData data = Recording{}.data(1);
  data.sensors.erase(data.sensors.begin());  // with only the sonar, the scale factor is not observable
  TrackingProblem tracking = make_tracking_problem(data);
  ASSERT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
  EXPECT_EQ(tracking.constants[0].name, "sonar.scale");
  const Marginals marginals(tracking.problem);
  const double after = std::sqrt(marginals.covariance(std::get<Variable<Rn<1>>>(tracking.constants[0].state))(0, 0));
  EXPECT_GT(after, 0.2 * tracking.constants[0].sigma[0]);
}

TEST(SensorConstants, CombineWithTimeVaryingBias) {
  TrackingData data = Recording{}.data(1);
  data.sensors[1].error->bias_sigma = Vector<3>::Constant(0.2);
  data.sensors[1].error->correlation_time = 20;
  TrackingProblem tracking = make_tracking_problem(data);
  EXPECT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
  EXPECT_EQ(tracking.constants.size(), 3u) << "a bias with a finite correlation time is not a constant";
}

TEST(SensorConstants, IncludeConstantBias) {
  for (const bool planar : {false, true}) {
    TrackingData data = Recording{.scale = 0, .delay = 0, .turn = Vector<3>::Zero()}.data(1);
    data.planar = planar;
    TargetSensor& sonar = data.sensors[1];
    const Vector<3> bias(0.7, -0.5, 0.3);
    for (Measurement& m : sonar.measurements) m.position += bias;
    const int rows = planar ? 2 : 3;
    if (planar) {
      data.noise.prior.setConstant(3, 1e-3);
      data.noise.odometry.setConstant(3, 2e-3);
      data.noise.constant_twist = Vector<3>(0.03, 0.03, 0.01);
      for (TargetSensor& sensor : data.sensors) sensor.mount = SE3();
      data.sensors[0].sigma.setConstant(3, 0.02);
      sonar.sigma.setConstant(rows, 0.1);
    }
    sonar.error = SystematicError{Eigen::VectorXd::Constant(rows, 1.0)};
    TrackingProblem tracking = make_tracking_problem(data);
    ASSERT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
    ASSERT_EQ(tracking.constants.size(), 1u);
    const SensorConstant& found = tracking.constants[0];
    EXPECT_EQ(found.name, "sonar.bias");
    EXPECT_EQ(found.sigma, sonar.error->bias_sigma);
    const Eigen::VectorXd value =
        std::visit([&](const auto& x) { return Eigen::VectorXd(tracking.problem.value(x).Log()); }, found.state);
    ASSERT_EQ(value.size(), rows);
    if (!planar) {  // the simulated chaser rolls and pitches, so a planar estimate is inexact
      EXPECT_LT((value - bias).norm(), 0.05) << value.transpose();
    }
  }
}

TEST(SensorConstants, RejectUnsupportedErrors) {
  TrackingData data = Recording{}.data(1);
  TargetSensor bearing{.name = "ears", .type = SensorType::bearing, .sigma = Vector<2>::Constant(0.1)};
  bearing.measurements = {{.t = 3}};
  bearing.error = SystematicError{.scale_sigma = 0.1};
  data.sensors.push_back(bearing);
  EXPECT_THAT([&] { make_tracking_problem(data); },
              ThrowsMessage<Error>(HasSubstr("ears.error: a bearing has no scale factor")));
  data.sensors.back().type = SensorType::range;
  data.sensors.back().sigma = Vector<1>(0.1);
  data.sensors.back().error = SystematicError{.misalignment_sigma = 0.1};
  EXPECT_THAT([&] { make_tracking_problem(data); },
              ThrowsMessage<Error>(HasSubstr("does not depend on the sensor's orientation")));
}

}  // namespace
}  // namespace tandem::testing

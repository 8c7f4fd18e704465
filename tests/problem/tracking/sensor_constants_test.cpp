#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/operations.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// Chaser and target on winding ways, 3 min; a camera that is right, and a sonar whose positions are turned, too long and late,
/// all with the noise that they are said to have.
struct Recording {
  double scale = 0.03, delay = 0.25;
  Vector<3> turn{0.05, -0.04, 0.08};
  SE3 mount{SO3::Exp({0.2, 0.0, -0.4}), {0.5, 0.1, -0.2}};

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
    std::vector<SE3> chaser = {SE3()}, target = {SE3(SO3::Exp({0, 0, 0.5}), {8, 3, 1})};
    Vector<6> step = (Vector<6>() << 0.8, 0.1, 0, 0, 0, 0.05).finished();
    SE3 dead_reckoned;
    for (int k = 0; k <= n; ++k) {
      d.odometry.push_back({double(k), dead_reckoned});
      const SE3 way = SE3::Exp(
          (Vector<6>() << 1.0, 0, 0.1 * std::cos(0.2 * k), 0, 0.05 * std::sin(0.3 * k), 0.3 * std::cos(0.1 * k))
              .finished());
      chaser.push_back(chaser.back() * way);
      dead_reckoned = dead_reckoned * way * SE3::Exp(draw(odometry));
      target.push_back(target.back() * SE3::Exp(step));
      const Vector<6> change = draw(motion);
      target.back() = target.back() * SE3::Exp(change);
      step = minus(target.back(), target[target.size() - 2]);
    }
    TargetSensor camera{.name = "camera", .type = SensorType::pose, .sigma = Vector<6>::Constant(0.02)};
    TargetSensor sonar{.name = "sonar", .sigma = Vector<3>::Constant(0.1), .mount = mount};
    sonar.error = StayingError{.scale = 0.05, .misalignment = 0.1, .delay = 0.3};
    const SE3 sensor = mount * SE3(SO3::Exp(turn), Vector<3>::Zero());
    for (std::size_t k = 1; k <= n; ++k) {
      const SE3 z = chaser[k].inverse() * target[k] * SE3::Exp(draw(Vector<6>(camera.sigma)));
      camera.measurements.push_back({.t = double(k), .position = z.translation(), .rotation = z.rotation()});
      const SE3 c = interpolate(chaser[k - 1], chaser[k], 1 - delay),
                t = interpolate(target[k - 1], target[k], 1 - delay);
      const Vector<3> p = (1 + scale) * (c * sensor).inverse().act(t.translation()) + draw(Vector<3>(sonar.sigma));
      sonar.measurements.push_back({.t = double(k), .position = p});
    }
    d.sensors = {camera, sonar};
    return d;
  }
};

TEST(SensorConstants, TrueOnesAreFoundWithinTheirStandardErrors) {
  const Recording recording;
  const Vector<5> truth = (Vector<5>() << recording.scale, recording.turn, recording.delay).finished();
  Vector<5> mean = Vector<5>::Zero();
  int inside = 0;
  constexpr int seeds = 20;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    TrackingProblem tracking = make_tracking_problem(recording.data(seed));
    ASSERT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
    ASSERT_EQ(tracking.constants.size(), 3u);
    const Marginals marginals(tracking.problem);
    Vector<5> found, deviation;
    int row = 0;
    for (const SensorConstant& c : tracking.constants)
      std::visit(
          [&]<LieGroup G>(const Variable<G>& x) {
            found.segment<G::dof>(row) = tracking.problem.value(x).Log();
            deviation.segment<G::dof>(row) = marginals.covariance(x).diagonal().cwiseSqrt();
            row += G::dof;
          },
          c.state);
    EXPECT_LT(((found - truth).array() / truth.array()).abs().maxCoeff(), 0.15) << "seed " << seed;
    inside += int(((found - truth).array().abs() < 2 * deviation.array()).count());
    mean += found / seeds;
  }
  EXPECT_LT(((mean - truth).array() / truth.array()).abs().maxCoeff(), 0.05) << mean.transpose();
  RecordProperty("inside_two_standard_errors", inside);
  EXPECT_GE(inside, 90) << "of 100, 95 on average";
}

TEST(SensorConstants, ThoseThatNothingTellsKeepTheirSpread) {
  TrackingData data = Recording{}.data(1);
  data.sensors.erase(data.sensors.begin());  // the sonar alone: how it is turned, the target's way may be, too
  TrackingProblem tracking = make_tracking_problem(data);
  ASSERT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
  EXPECT_EQ(tracking.constants[0].name, "sonar.scale");
  const Marginals marginals(tracking.problem);
  const double after = std::sqrt(marginals.covariance(std::get<Variable<Rn<1>>>(tracking.constants[0].state))(0, 0));
  EXPECT_GT(after, 0.2 * tracking.constants[0].sigma[0]);
}

TEST(SensorConstants, BiasesStandBesideThem) {
  TrackingData data = Recording{}.data(1);
  data.sensors[1].error->sigma = Vector<3>::Constant(0.2);
  data.sensors[1].error->time = 20;
  TrackingProblem tracking = make_tracking_problem(data);
  EXPECT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
  EXPECT_EQ(tracking.constants.size(), 3u) << "a bias that is forgotten is none of them";
}

/// One that nothing is said of forgetting is a constant like the others, in space and in the plane.
TEST(SensorConstants, ABiasOfTheWholeRecordingIsOneOfThem) {
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
    sonar.error = StayingError{Eigen::VectorXd::Constant(rows, 1.0)};
    TrackingProblem tracking = make_tracking_problem(data);
    ASSERT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
    ASSERT_EQ(tracking.constants.size(), 1u);
    const SensorConstant& found = tracking.constants[0];
    EXPECT_EQ(found.name, "sonar.bias");
    EXPECT_EQ(found.sigma, sonar.error->sigma);
    const Eigen::VectorXd value =
        std::visit([&](const auto& x) { return Eigen::VectorXd(tracking.problem.value(x).Log()); }, found.state);
    ASSERT_EQ(value.size(), rows);
    if (!planar) {  // the recording rolls and pitches, which the plane has not
      EXPECT_LT((value - bias).norm(), 0.05) << value.transpose();
    }
  }
}

TEST(SensorConstants, RefusesThoseThatASensorHasNot) {
  TrackingData data = Recording{}.data(1);
  TargetSensor bearing{.name = "ears", .type = SensorType::bearing, .sigma = Vector<2>::Constant(0.1)};
  bearing.measurements = {{.t = 3}};
  bearing.error = StayingError{.scale = 0.1};
  data.sensors.push_back(bearing);
  EXPECT_THAT([&] { make_tracking_problem(data); },
              ThrowsMessage<Error>(HasSubstr("ears.error: a bearing has no scale")));
  data.sensors.back().type = SensorType::range;
  data.sensors.back().sigma = Vector<1>(0.1);
  data.sensors.back().error = StayingError{.misalignment = 0.1};
  EXPECT_THAT([&] { make_tracking_problem(data); }, ThrowsMessage<Error>(HasSubstr("does not tell how it is turned")));
}

}  // namespace
}  // namespace tandem::testing

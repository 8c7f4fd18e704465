#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/solvers/gauss_newton.hpp>

#include "simulated_run.hpp"

/// All types of target sensors, in space and in the plane, with extrinsics on both vehicles.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

struct SensorCase {
  SensorType type;
  bool planar;
};

std::vector<SensorCase> cases() {
  std::vector<SensorCase> all;
  for (const SensorType type : {SensorType::position, SensorType::pose, SensorType::range_bearing, SensorType::bearing,
                                SensorType::range, SensorType::usbl_spherical})
    for (const bool planar : {false, true})
      if (rows(type, planar) > 0) all.push_back({type, planar});
  return all;
}

class TargetSensors : public ::testing::TestWithParam<SensorCase> {
 protected:
  SimulatedRun run{.planar = GetParam().planar};

  /// Returns a sensor with extrinsics on the chaser and, if `on_target`, on the target.
  TargetSensor sensor(bool on_target = true) const {
    TargetSensor s{.name = "sonar", .type = GetParam().type};
    s.mount = run.flat(SE3::Exp((Vector<6>() << 0.5, -0.2, 0.3, 0.4, 0.1, -0.9).finished()));
    if (on_target) s.marker = run.flat(SE3::Exp((Vector<6>() << -0.8, 0.3, 0.2, 0.1, -0.2, 2.5).finished()));
    return s;
  }
  TrackingProblem at_truth(const TrackingData& data, const TrackingOptions& options = {}) const {
    TrackingProblem tracking = without_assumed_range(make_tracking_problem(data, options));
    run.set_truth(tracking);
    return tracking;
  }
  /// Removes the assumed range of bearings, whose cost is not zero at the truth.
  static TrackingProblem without_assumed_range(TrackingProblem tracking) {
    for (const Block& block : tracking.problem.blocks())
      if (tracking.problem.describe(block).starts_with("logarithmic range")) tracking.problem.remove(block);
    return tracking;
  }
};

TEST_P(TargetSensors, CostIsZeroAtTruth) {
  const TrackingData data = run.data({sensor()}, every(0.9, 0.0, 11.7));
  TrackingProblem tracking = at_truth(data);
  EXPECT_LE(cost(tracking), 1e-18);
  EXPECT_EQ(tracking.measurements.size(), data.sensors[0].measurements.size());
}

TEST_P(TargetSensors, CostIsZeroAtTruthForAllModels) {
  run.target_twist = twist(0.9, 0.0);
  const TrackingData data = run.data({sensor(false)}, every(0.9, 0.0, 11.7));
  for (const MotionModel model : {MotionModel::constant_twist, MotionModel::constant_velocity,
                                  MotionModel::white_noise_acceleration, MotionModel::steady_course}) {
    TrackingProblem tracking = at_truth(data, {.model = model});
    EXPECT_LE(cost(tracking), 1e-18) << name(model);
  }
}

TEST_P(TargetSensors, CostOfErrorMatchesSigma) {
  TrackingData data = run.data({sensor()}, {3.0, 5.0});
  Measurement& m = data.sensors[0].measurements[1];
  double sigma = 0.1, off = 0.2;
  if (GetParam().type == SensorType::bearing) {
    off = sigma = 0.02;
    if (run.planar) {
      m.azimuth += off;
    } else {
      m.elevation += off;
    }
  } else if (GetParam().type == SensorType::pose) {
    m.position += m.rotation.act(Vector<3>(off, 0, 0));
  } else if (GetParam().type == SensorType::position) {
    m.position.x() += off;
  } else {
    m.range += off;
  }
  TrackingProblem tracking = at_truth(data);
  EXPECT_NEAR(cost(tracking), 0.5 * (off / sigma) * (off / sigma), 2e-3 * (off / sigma));
}

TEST_P(TargetSensors, ComputesMeasuredPosition) {
  const TargetSensor both = run.data({sensor()}, {4.0}).sensors[0],
                     chaser = run.data({sensor(false)}, {4.0}).sensors[0];
  const auto seen = both.position(both.measurements[0]);
  const auto in_chaser = chaser.position_in_chaser(chaser.measurements[0]);
  if (GetParam().type == SensorType::bearing || GetParam().type == SensorType::range) {
    EXPECT_FALSE(seen || in_chaser);
    return;
  }
  const Vector<3> marker = run.target(4.0).act(both.marker.translation());
  EXPECT_LE((*seen - (run.chaser(4.0) * both.mount).inverse().act(marker)).norm(), 1e-12);
  const Vector<3> target = run.chaser(4.0).inverse().act(run.target(4.0).translation());
  EXPECT_LE((*in_chaser - target).norm(), 1e-12);
  if (GetParam().type == SensorType::pose) {  // a pose determines the direction of the lever arm
    EXPECT_LE((*both.position_in_chaser(both.measurements[0]) - target).norm(), 1e-12);
  }
}

TEST_P(TargetSensors, DelayedMeasurementIsAtTimeOfValidity) {
  TargetSensor late = sensor();
  late.delay = 0.37;
  const TrackingData data = run.data({late}, every(1.3, 0.5, 12.0));
  TrackingProblem tracking = at_truth(data);
  EXPECT_LE(cost(tracking), 1e-18);
  ASSERT_EQ(tracking.measurements.size(), data.sensors[0].measurements.size());
  for (const PlacedMeasurement& placed : tracking.measurements)
    EXPECT_NEAR(tracking.keyframes[placed.keyframe].t, data.sensors[0].measurements[placed.index].t - 0.37, 1e-12);
  EXPECT_EQ(tracking.num_discarded, std::vector<std::size_t>{0});
}

TEST_P(TargetSensors, DiscardsMeasurementsBeforeOdometry) {
  TargetSensor late = sensor();
  late.delay = 1.0;
  TrackingData data = run.data({late}, {2.0, 4.0});
  for (const double t : {0.1, 0.9, 0.9995, 1.5}) data.sensors[0].measurements.push_back(run.measure(late, t));
  const TrackingProblem tracking = make_tracking_problem(data);
  EXPECT_EQ(tracking.num_discarded, std::vector<std::size_t>{2})
      << "0.5 ms before the first keyframe is within the tolerance";
  EXPECT_EQ(tracking.measurements.size(), 4u);
  EXPECT_EQ(tracking.keyframes.front().t, 0.0);
}

TEST_P(TargetSensors, SetsTypeOfKeyframe) {
  const TrackingData data = run.data({sensor()}, {3.0, 5.0});
  const std::vector<Keyframe> keyframes = make_keyframes(data);
  const bool position = sensor().position_in_chaser(data.sensors[0].measurements[0]).has_value();
  const KeyframeType expected = GetParam().type == SensorType::pose ? KeyframeType::pose
                                : position                          ? KeyframeType::position
                                                                    : KeyframeType::partial;
  for (const Keyframe& keyframe : keyframes) {
    const bool measured = keyframe.t == 3.0 || keyframe.t == 5.0;
    EXPECT_EQ(keyframe.type, measured ? expected : KeyframeType::none) << keyframe.t;
    EXPECT_EQ(keyframe.measured_position.has_value(), measured && position) << keyframe.t;
  }
}

TEST_P(TargetSensors, HeldOutMeasurementHasKeyframeButNoResidual) {
  const std::vector<double> times = every(1.3, 0.5, 11.0);
  TrackingData data = run.data({sensor()}, times);
  const int all = without_assumed_range(make_tracking_problem(data)).problem.num_soft_blocks();
  data.sensors[0].measurements[2].held_out = data.sensors[0].measurements[5].held_out = true;
  const TrackingProblem tracking = at_truth(data);
  EXPECT_EQ(tracking.problem.num_soft_blocks(), all - 2);
  ASSERT_EQ(tracking.measurements.size(), times.size());
  for (const PlacedMeasurement& placed : tracking.measurements) {
    const bool held_out = placed.index == 2 || placed.index == 5;
    EXPECT_NE(placed.block.has_value(), held_out);
    EXPECT_EQ(bool(placed.innovation), held_out);
    if (!held_out) continue;
    EXPECT_EQ(tracking.keyframes[placed.keyframe].type, KeyframeType::none) << "held-out measurements do not count";
    const Problem::Linearization innovation = placed.innovation(tracking.problem);
    EXPECT_EQ(innovation.residual.size(), rows(GetParam().type, run.planar));
    EXPECT_LE(innovation.residual.norm(), 1e-12);
  }
}

/// Returns the Jacobian of the innovation from central differences with respect to the variables.
template <class Variables>
Eigen::MatrixXd differences(TrackingProblem& tracking, const PlacedMeasurement& placed, const Variables& variables) {
  constexpr double h = 1e-6;
  std::vector<Eigen::VectorXd> columns;
  const auto differentiate = [&]<LieGroup G>(const Variable<G>& x) {
    const G at = tracking.problem.value(x);
    for (int i = 0; i < G::dof; ++i) {
      const auto moved = [&](double by) {
        tracking.problem.set_value(x, plus(at, typename G::Tangent(by * G::Tangent::Unit(i))));
        return placed.innovation(tracking.problem).residual;
      };
      const Eigen::VectorXd ahead = moved(h), behind = moved(-h);
      columns.push_back((ahead - behind) / (2 * h));
    }
    tracking.problem.set_value(x, at);
  };
  std::apply([&](const auto&... x) { (differentiate(x), ...); }, variables);
  Eigen::MatrixXd J(columns.front().size(), Eigen::Index(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) J.col(Eigen::Index(i)) = columns[i];
  return J;
}

TEST_P(TargetSensors, InnovationJacobianMatchesDifferences) {
  run.target_twist = twist(0.9, 0.0);
  TrackingData data = run.data({sensor(false)}, {2.0, 5.0, 8.0});
  data.sensors[0].measurements[1].held_out = true;
  for (const MotionModel model :
       {MotionModel::constant_twist, MotionModel::constant_velocity, MotionModel::steady_course}) {
    TrackingProblem tracking =
        make_tracking_problem(data, {.model = model});  // at the initial guess, where the residual is not zero
    const PlacedMeasurement& placed = tracking.measurements[1];
    const Eigen::MatrixXd J = placed.innovation(tracking.problem).jacobian;
    const Eigen::MatrixXd expected = std::visit(
        [&](const auto& chaser, const auto& target) {
          if constexpr (requires { target.first; }) {
            return differences(tracking, placed, std::tuple(chaser, target.first, target.speed));
          } else {
            return differences(tracking, placed, std::tuple(chaser, target));
          }
        },
        tracking.chaser[placed.keyframe], tracking.target[placed.keyframe]);
    ASSERT_EQ(J.cols(), expected.cols()) << name(model);
    EXPECT_LE((J - expected).norm(), 1e-7 * (1 + expected.norm())) << name(model);
  }
}

TEST_P(TargetSensors, LeverArmOnTargetNeedsOrientation) {
  const TrackingData data = run.data({sensor()}, {2.0, 5.0});
  const TrackingOptions points{.model = MotionModel::constant_velocity};
  if (GetParam().type == SensorType::pose) {  // measures the orientation
    TrackingProblem tracking = at_truth(run.data({sensor()}, {2.0}), points);
    EXPECT_LE(cost(tracking), 10.0) << "the turn of the target causes a small cost";
    return;
  }
  EXPECT_THAT([&] { make_tracking_problem(data, points); },
              ThrowsMessage<Error>(::testing::AllOf(HasSubstr("sonar"), HasSubstr("target_position"))));
  EXPECT_THAT([&] { make_tracking_problem(data, {.mode = Mode::B}); },
              ThrowsMessage<Error>(HasSubstr("target_position")));
}

TEST_P(TargetSensors, SensorLossReplacesProblemLoss) {
  TrackingData data = run.data({sensor()}, {3.0, 5.0});
  Measurement& m = data.sensors[0].measurements[1];
  m.position.x() += 1.0;
  m.range += 1.0;
  m.azimuth += 0.2;
  const auto with = [&](std::optional<Loss> own, const Loss& all) {
    data.sensors[0].loss = own;
    TrackingProblem tracking = at_truth(data, {.loss = all});
    return cost(tracking);
  };
  const double quadratic = with({}, {}), cauchy = with({}, Cauchy(1.0));
  EXPECT_LT(cauchy, 0.5 * quadratic);
  EXPECT_EQ(with(Cauchy(1.0), {}), cauchy);
  EXPECT_EQ(with(Loss{}, Cauchy(1.0)), quadratic);
}

INSTANTIATE_TEST_SUITE_P(All, TargetSensors, ::testing::ValuesIn(cases()), [](const auto& info) {
  return std::string(name(info.param.type)) + (info.param.planar ? "_SE2" : "_SE3");
});

class PoseSensor : public ::testing::TestWithParam<bool> {  // planar
 protected:
  SimulatedRun run{.planar = GetParam()};
  TrackingData data = run.data({{.name = "camera", .type = SensorType::pose}}, every(1.0, 0.0, 12.0));
  int n = int(data.sensors[0].measurements.size());
  int plain = make_tracking_problem(data).problem.num_soft_blocks();
};

TEST_P(PoseSensor, PositionShareKeepsTotalInformation) {
  TrackingProblem whole = make_tracking_problem(data), shared = make_tracking_problem(data, {.position_share = 0.25});
  EXPECT_EQ(shared.problem.num_soft_blocks(), plain + n);
  for (const PlacedMeasurement& placed : shared.measurements) {
    EXPECT_TRUE(placed.block && placed.position);
    EXPECT_FALSE(placed.orientation);
  }
  run.set_truth(whole);
  run.set_truth(shared);
  EXPECT_LE(cost(shared), 1e-18);
  const auto displace = [&](TrackingProblem& tracking) {  // moves one chaser pose
    std::visit(
        [&]<LieGroup G>(const Variable<G>& x) {
          tracking.problem.set_value(x, tracking.problem.value(x) * in_group<G>(SE3(SO3(), Vector<3>(0.1, -0.2, 0))));
        },
        tracking.chaser[4]);
    return cost(tracking);
  };
  const double expected = displace(whole);
  EXPECT_NEAR(displace(shared), expected, 1e-9 * expected);
}

TEST_P(PoseSensor, OrientationLossSplitsPose) {
  data.sensors[0].measurements[3].rotation = data.sensors[0].measurements[3].rotation * SO3::Exp({0, 0, M_PI});
  TrackingProblem all = make_tracking_problem(data, {.orientation_loss = Cauchy(1.0)});
  data.sensors[0].orientation_loss = Cauchy(1.0);
  TrackingProblem own = make_tracking_problem(data);
  for (TrackingProblem* tracking : {&all, &own}) {
    EXPECT_EQ(tracking->problem.num_soft_blocks(), plain + n);
    run.set_truth(*tracking);
    for (const PlacedMeasurement& placed : tracking->measurements) {
      ASSERT_TRUE(placed.block && placed.orientation);
      EXPECT_FALSE(placed.position);
      EXPECT_EQ(tracking->problem.weight(*placed.block), 1.0) << "the position keeps its weight";
      if (placed.index == 3) {
        EXPECT_LT(tracking->problem.weight(*placed.orientation), 1e-3);
      } else {
        EXPECT_NEAR(tracking->problem.weight(*placed.orientation), 1.0, 1e-12);
      }
    }
  }
  EXPECT_EQ(cost(all), cost(own));
}

INSTANTIATE_TEST_SUITE_P(Groups, PoseSensor, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "SE2" : "SE3"; });

TEST(PlanarTracking, RejectsSphericalUsbl) {
  const SimulatedRun run{.planar = true};
  TrackingData data = run.data({{.name = "sonar", .type = SensorType::position}}, {1.0, 2.0});
  data.sensors[0].type = SensorType::usbl_spherical;
  data.sensors[0].sigma = Vector<3>::Ones();
  EXPECT_THAT([&] { make_tracking_problem(data); }, ThrowsMessage<Error>(HasSubstr("usbl_spherical")));
}

}  // namespace
}  // namespace tandem::testing

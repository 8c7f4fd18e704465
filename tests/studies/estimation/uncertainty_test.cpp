#include <cmath>

#include <gtest/gtest.h>

#include <tandem/lie/operations.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/studies/estimation/uncertainty.hpp>

#include "problem/tracking/simulated_tracking.hpp"
#include "solvers/marginals_cases.hpp"

/// Compares uncertainties with the dense inverse of the Hessian, propagated by finite differences.
namespace tandem {
namespace {

using testing::DenseMarginals;
using testing::Simulation;

/// Returns the joint covariance of several variables, in the order of the arguments.
template <LieGroup... Xs>
Eigen::MatrixXd dense_joint(const DenseMarginals& dense, const Problem& problem, const Variable<Xs>&... x) {
  Eigen::MatrixXd S((Xs::dof + ...), (Xs::dof + ...));
  Eigen::Index row = 0;
  const auto rows = [&]<LieGroup A>(const Variable<A>& a) {
    Eigen::Index column = 0;
    ((S.block(row, column, A::dof, Xs::dof) = dense.block(problem, a, x), column += Xs::dof), ...);
    row += A::dof;
  };
  (rows(x), ...);
  return S;
}

/// Returns J S Jᵀ, where J has the central differences of f with respect to these variables.
template <class F, LieGroup... Xs>
Eigen::MatrixXd propagated(const Eigen::MatrixXd& S, Problem& problem, F f, const Variable<Xs>&... x) {
  constexpr double h = 1e-5;
  Eigen::MatrixXd J(f().size(), S.cols());
  Eigen::Index column = 0;
  const auto differences = [&]<LieGroup X>(const Variable<X>& v) {
    const X value = problem.value(v);
    for (int i = 0; i < X::dof; ++i) {
      const typename X::Tangent step = h * X::Tangent::Unit(i);
      problem.set_value(v, value * X::Exp(step));
      const Eigen::VectorXd ahead = f();
      problem.set_value(v, value * X::Exp(-step));
      J.col(column++) = (ahead - f()) / (2 * h);
    }
    problem.set_value(v, value);
  };
  (differences(x), ...);
  return J * S * J.transpose();
}

Uncertainty uncertainty_of(TrackingProblem& tracking, const TrackingData& data) {
  return uncertainty(tracking, data, Marginals(tracking.problem, pairs_at_keyframes(tracking)));
}

struct Checked {
  TrackingProblem tracking;
  Uncertainty found;
  int poses = 0, points = 0, held_out = 0;

  Checked(const TrackingData& data, const TrackingOptions& options) : tracking(make_tracking_problem(data, options)) {
    const Summary summary = solve(tracking.problem, GaussNewtonOptions{});
    EXPECT_TRUE(summary.converged()) << summary.message;
    found = uncertainty_of(tracking, data);
    const DenseMarginals dense(tracking.problem);
    for (std::size_t k = 0; k < tracking.keyframes.size(); ++k)
      std::visit(
          [&]<LieGroup C, class T>(const Variable<C>& c, const T& t) {
            if constexpr (requires { t.first; }) {
              check(data, k, dense, c, t.first, t.speed);
            } else {
              check(data, k, dense, c, t);
            }
          },
          tracking.chaser[k], tracking.target[k]);
  }

  template <LieGroup... Xs>
  void check(const TrackingData& data, std::size_t k, const DenseMarginals& dense, const Variable<Xs>&... x) {
    SCOPED_TRACE("keyframe " + std::to_string(k));
    Problem& problem = tracking.problem;
    const Eigen::MatrixXd S = dense_joint(dense, problem, x...);
    const auto expect = [&](const Eigen::MatrixXd& given, auto f, const char* what) {
      const Eigen::MatrixXd expected = propagated(S, problem, f, x...);
      ASSERT_EQ(given.rows(), expected.rows()) << what;
      EXPECT_LE((given - expected).norm(), 1e-6 * expected.norm()) << what << "\n" << given << "\n\n" << expected;
    };
    const SE3 c = tracking.chaser_pose(k);
    const TargetState t = tracking.target_state(k);
    const KeyframeUncertainty& u = found.keyframes[k];
    expect(
        u.chaser, [&]() -> Eigen::VectorXd { return minus(tracking.chaser_pose(k), c); }, "chaser");
    expect(
        u.relative_position,
        [&]() -> Eigen::VectorXd { return tracking.chaser_pose(k).inverse().act(tracking.target_state(k).position); },
        "relative position");
    ASSERT_EQ(u.relative_rotation.has_value(), t.rotation.has_value());
    if (t.rotation) {
      ++poses;
      const auto pose = [&] {
        const TargetState now = tracking.target_state(k);
        return SE3(*now.rotation, now.position);
      };
      const SE3 before = pose(), relative = c.inverse() * before;
      expect(
          u.target, [&]() -> Eigen::VectorXd { return minus(pose(), before); }, "target");
      expect(
          *u.relative_rotation,
          [&]() -> Eigen::VectorXd {
            return (relative.inverse() * tracking.chaser_pose(k).inverse() * pose()).Log().template tail<3>();
          },
          "relative rotation");
    } else {
      ++points;
      expect(
          u.target, [&]() -> Eigen::VectorXd { return tracking.target_state(k).position; }, "target point");
    }
    std::size_t next = 0;
    for (const PlacedMeasurement& m : tracking.measurements) {
      if (!m.innovation) continue;
      const HeldOut& h = found.held_out.at(next++);
      if (m.keyframe != k) continue;
      ++held_out;
      Eigen::MatrixXd of_prediction = h.covariance;
      of_prediction.diagonal() -= data.sensors[h.sensor].sigma.head(h.r.size()).cwiseAbs2();
      expect(
          of_prediction, [&] { return m.innovation(problem).residual; }, "held out");
      EXPECT_EQ(h.index, m.index);
    }
  }
};

TrackingData data() {
  Simulation simulation;
  simulation.duration = 6.0;
  simulation.noise = 0.5;
  TrackingData d = simulation.data();
  d.noise.constant_velocity = Vector<3>(0.3, 0.3, 0.1);
  return d;
}

void hold_out_every_second(TrackingData& d) {
  for (TargetSensor& sensor : d.sensors)
    for (std::size_t i = 1; i < sensor.measurements.size(); i += 2) sensor.measurements[i].held_out = true;
}

/// Returns a planar scenario with range and bearing measurements and two poses.
TrackingData planar_data() {
  TrackingData d;
  d.planar = true;
  d.noise = TrackingNoise(true);
  d.noise.prior = Vector<3>(1e-2, 1e-2, 1e-3);
  d.noise.odometry = Vector<3>(0.05, 0.05, 0.005);
  d.noise.constant_twist = Vector<3>(0.05, 0.02, 0.03);
  TargetSensor radar{.name = "radar", .type = SensorType::range_bearing, .sigma = Vector<2>(0.5, 0.03)};
  TargetSensor camera{.name = "camera", .type = SensorType::pose, .sigma = Vector<3>(0.1, 0.1, 0.05)};
  for (double t = 0; t <= 6; t += 0.5) {
    const SE3 chaser = Simulation::pose(t, 0.1 * t, 0, 0.05 * t), target = Simulation::pose(10 + 0.8 * t, 4, 0, 0.02);
    d.odometry.push_back({t, chaser});
    const SE3 z = chaser.inverse() * target;
    const Vector<3> p = z.translation();
    radar.measurements.push_back({.t = t, .range = p.head<2>().norm() + 0.1, .azimuth = std::atan2(p.y(), p.x())});
    if (t == 2.0 || t == 4.0) camera.measurements.push_back({.t = t, .position = p, .rotation = z.rotation()});
  }
  d.sensors = {radar, camera};
  return d;
}

TEST(Uncertainty, OfPosesMatchesDenseInverse) {
  TrackingData d = data();
  hold_out_every_second(d);
  const Checked checked(d, {});
  EXPECT_GT(checked.poses, 5);
  EXPECT_EQ(checked.held_out, 2);
}

TEST(Uncertainty, OfPointsMatchesDenseInverse) {
  TrackingData d = data();
  hold_out_every_second(d);
  TrackingOptions options;
  options.mode = Mode::B;
  const Checked checked(d, options);
  EXPECT_EQ(checked.poses, 2);
  EXPECT_GT(checked.points, 2);
}

TEST(Uncertainty, OfSteadyCourseMatchesDenseInverse) {
  TrackingOptions options;
  options.model = MotionModel::steady_course;
  TrackingData d = data();
  hold_out_every_second(d);
  const Checked checked(d, options);
  EXPECT_GT(checked.poses, 5);
  EXPECT_EQ(checked.held_out, 2);
}

TEST(Uncertainty, OfPlanarProblemIsZeroOutOfPlane) {
  for (const MotionModel model : {MotionModel::constant_twist, MotionModel::steady_course}) {
    TrackingOptions options;
    options.model = model;
    const Checked checked(planar_data(), options);
    EXPECT_GT(checked.poses, 5);
    for (const KeyframeUncertainty& u : checked.found.keyframes) {
      EXPECT_EQ(u.target.middleRows(2, 3).cwiseAbs().maxCoeff(), 0);
      EXPECT_GT(u.target(5, 5), 0);
      EXPECT_EQ(u.position_sigma().z(), 0);
      EXPECT_GT(u.rotation_sigma()->z(), 0);
    }
  }
}

/// A target that is constrained to be level has no uncertainty of roll and pitch.
TEST(Uncertainty, IsZeroAlongHardConstraints) {
  TrackingOptions options;
  options.roll_pitch = Role::hard;
  TrackingProblem tracking = make_tracking_problem(data(), options);
  ASSERT_TRUE(solve(tracking.problem, AugmentedLagrangianOptions{}).converged());
  const Uncertainty found = uncertainty_of(tracking, data());
  for (const KeyframeUncertainty& u : found.keyframes) EXPECT_LE((u.target.block<2, 2>(3, 3).norm()), 1e-12);
}

/// Predictions of held-out measurements must include the sensor's estimated scale error and bias, and their
/// uncertainty, which is larger for a time-correlated bias.
TEST(HeldOut, PredictsWithSystematicErrors) {
  Simulation simulation;
  simulation.duration = 60.0;
  simulation.noise = 1.0;
  TrackingData d = simulation.data();
  TargetSensor& usbl = d.sensors[0];
  ASSERT_FALSE(usbl.type->has(measured::rotation));
  for (std::size_t i = 0; i < usbl.measurements.size(); ++i) {
    usbl.measurements[i].position = 1.3 * usbl.measurements[i].position + Vector<3>(0, 0, 3);
    usbl.measurements[i].held_out = i % 4 == 2;
  }
  const auto mean_of = [&](const Uncertainty& u, auto f) {
    double sum = 0;
    for (const HeldOut& h : u.held_out) sum += f(h) / double(u.held_out.size());
    return sum;
  };
  const auto distance = [](const HeldOut& h) { return h.squared_distance() / 3; };
  const auto variance = [](const HeldOut& h) { return h.covariance.trace(); };
  const auto found_with = [&](const std::optional<SystematicError>& error) {
    usbl.error = error;
    TrackingProblem tracking = make_tracking_problem(d);
    EXPECT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
    return uncertainty_of(tracking, d);
  };
  const Uncertainty without = found_with({}),
                    constant = found_with(SystematicError{Vector<3>::Constant(5), HUGE_VAL, 0.5}),
                    correlated = found_with(SystematicError{Vector<3>::Constant(5), 20, 0.5, 0, 0.1});
  for (const Uncertainty* u : {&without, &constant, &correlated}) EXPECT_GE(u->held_out.size(), 5u);
  EXPECT_GT(mean_of(without, distance), 3);
  EXPECT_LT(mean_of(constant, distance), 2);
  EXPECT_LT(mean_of(correlated, distance), 2);
  EXPECT_GT(mean_of(correlated, variance), 1.02 * mean_of(constant, variance));
}

TEST(HeldOut, DistinguishesRowsFromJointRegion) {
  const auto held_out = [](const Eigen::VectorXd& r) {
    return HeldOut{0, 0, r, Vector<2>(4.0, 1.0).asDiagonal().toDenseMatrix()};
  };
  const HeldOut near = held_out(Vector<2>(3.8, 1.9));  // 1.9 σ each; squared distance 7.22, above the χ² quantile 5.99
  EXPECT_EQ(near.rows_inside(), 2);
  EXPECT_NEAR(near.squared_distance(), 7.22, 1e-12);
  EXPECT_FALSE(near.inside());
  const HeldOut one_sided = held_out(Vector<2>(4.8, 0.0));  // 2.4 σ; squared distance 5.76
  EXPECT_EQ(one_sided.rows_inside(), 1);
  EXPECT_FALSE(one_sided.row_inside(0));
  EXPECT_TRUE(one_sided.inside());
}

}  // namespace
}  // namespace tandem

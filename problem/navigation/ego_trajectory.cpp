#include <cmath>

#include <Eigen/Cholesky>

#include <tandem/lie/error.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/problem/navigation/ego_trajectory.hpp>
#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem {
namespace {

constexpr int kMaxIterations = 5;
constexpr double kConverged = 1e-9;   // m, m/s, rad: largest last step
constexpr double kHalfOfRate = 0.05;  // s: the turn rate is the mean over twice this time

/// Returns the Hessian as a dense matrix.
Eigen::MatrixXd dense(const SymmetricPattern& pattern, const Eigen::VectorXd& values) {
  const std::vector<int> start = pattern.column_starts(), row = pattern.rows();
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(pattern.size(), pattern.size());
  for (int column = 0; column < pattern.size(); ++column)
    for (int i = start[std::size_t(column)]; i < start[std::size_t(column) + 1]; ++i)
      H(row[std::size_t(i)], column) = H(column, row[std::size_t(i)]) = values[i];
  return H;
}

/// A normal distribution given the states at both keyframes: mean = … + gain [δa; δb].
struct Conditional {
  Eigen::MatrixXd gain, covariance;
};

/// Moves the middle one of three states, of n unknowns each, to its conditional mean.
Conditional condition_middle(Problem& problem, Eigen::Index n) {
  NlpEvaluator nlp(problem);
  Eigen::VectorXd gradient(nlp.num_unknowns()), values(nlp.hessian_pattern().nonzeros());
  Eigen::VectorXd step = Eigen::VectorXd::Zero(nlp.num_unknowns());
  Conditional result;
  for (int i = 0; i < kMaxIterations; ++i) {
    nlp.linearize(gradient, values);
    const Eigen::MatrixXd H = dense(nlp.hessian_pattern(), values);
    const Eigen::LLT<Eigen::MatrixXd> factor(H.block(n, n, n, n));
    Eigen::MatrixXd of_others(n, 2 * n);
    of_others << H.block(n, 0, n, n), H.block(n, 2 * n, n, n);
    result.gain = -factor.solve(of_others);
    result.covariance = factor.solve(Eigen::MatrixXd::Identity(n, n));
    step.segment(n, n) = -factor.solve(gradient.segment(n, n));
    nlp.move_to(step);
    nlp.recenter();
    if (step.lpNorm<Eigen::Infinity>() < kConverged) break;
  }
  return result;
}

/// Returns the sensor with the samples that connect two keyframes; with none if the keyframes are connected by
/// Coasting.
ImuSensor samples_between(const ImuRecord& imu, double from, double to) {
  ImuSensor sensor{.mount = imu.mount(), .noise = imu.noise(), .max_gap = HUGE_VAL};
  if (!imu.covers(from, to)) return sensor;
  imu.each_interval(from, to, [&](const ImuSample& sample, const ImuSample& next) {
    if (sensor.samples.empty()) sensor.samples.push_back(sample);
    sensor.samples.push_back(next);
  });
  return sensor;
}

/// Variables that a motion depends on.
struct Dependence {
  std::vector<int> ids, dofs;

  void add(const Problem& problem, const EgoKeyframe& k) {
    ids.insert(ids.end(), {problem.id(k.pose), problem.id(k.velocity)});
    dofs.insert(dofs.end(), {6, 3});
    if (!k.bias) return;
    ids.push_back(problem.id(*k.bias));
    dofs.push_back(6);
  }
};

}  // namespace

void throw_outside(double t, double first, double last, std::size_t count) {
  if (count < 2) throw BadInputError("a trajectory needs two keyframes or more");
  throw BadInputError("the time " + std::to_string(t) + " s is outside the trajectory, " + std::to_string(first) +
                      " to " + std::to_string(last) + " s");
}

EgoTrajectory::EgoTrajectory(const Problem& problem, std::span<const EgoKeyframe> keyframes, const ImuRecord* imu,
                             const Earth& earth, const EgoOptions& options)
    : problem_(problem), keyframes_(keyframes), imu_(imu), earth_(earth), options_(options) {
  options_.dvl_scale = options_.preintegrated_dvl = false;  // not part of the motion
}

MotionInstant EgoTrajectory::at(double t, const PropagateCovariance& propagate) const {
  const std::size_t k = interval_at(keyframes_, t);
  const EgoKeyframe &a = keyframes_[k], &b = keyframes_[k + 1];
  const EgoState before = state_at(problem_, a), after = state_at(problem_, b);
  const Eigen::Index n = imu_ ? 15 : 9;
  EgoState state;
  Dependence on;
  Eigen::MatrixXd gain;  // Jacobian of the state at t with respect to the variables of `on`
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);  // covariance of the state at t, given these variables
  on.add(problem_, a);
  on.add(problem_, b);
  if (t - a.t <= kSameInstant || b.t - t <= kSameInstant) {
    const bool first = t - a.t <= kSameInstant;
    state = first ? before : after;
    gain = Eigen::MatrixXd::Zero(n, 2 * n);
    gain.middleCols(first ? 0 : n, n).setIdentity();
  } else {
    NavigationData data{.earth = earth_};
    if (imu_) data.imu = samples_between(*imu_, a.t, b.t);
    Problem local;
    EgoChain chain(local, data, options_);
    if (data.imu)
      for (const ImuSample& sample : data.imu->samples) chain.add(sample);
    chain.start(a.t, before, {});
    chain.extend(t);
    chain.extend(b.t, after);
    Conditional given = condition_middle(local, n);
    state = chain.state(chain.keyframes()[1]);
    gain = std::move(given.gain);
    covariance = std::move(given.covariance);
  }

  const Matrix<3, 3> to_body = state.pose.rotation().inverse().matrix();
  Eigen::MatrixXd by_state = Eigen::MatrixXd::Zero(12, n);  // Jacobian of [pose; twist] with respect to the state at t
  Eigen::MatrixXd by_keyframes = Eigen::MatrixXd::Zero(12, 2 * n);
  Vector<6> twist;
  by_state.topLeftCorner<6, 6>().setIdentity();
  twist.head<3>() = to_body * state.velocity;
  by_state.block<3, 3>(6, 3) = skew(Vector<3>(twist.head<3>()));
  by_state.block<3, 3>(6, 6) = to_body;
  Vector<3> rate_variance = Vector<3>::Zero();
  if (const auto mean = imu_ ? imu_->mean(t - kHalfOfRate, t + kHalfOfRate) : std::nullopt) {
    const Matrix<3, 3> mount = imu_->mount().rotation().matrix();
    twist.tail<3>() = mean->angular_rate - mount * state.bias.tail<3>();
    by_state.bottomRightCorner<3, 3>() = -mount;
    rate_variance.setConstant(imu_->noise().gyroscope * imu_->noise().gyroscope / (2 * kHalfOfRate));
  } else {
    const Vector<3> turn = minus(after.pose.rotation(), before.pose.rotation());
    const InverseJacobians<SO3> at_turn(turn);
    twist.tail<3>() = turn / (b.t - a.t);
    by_keyframes.block<3, 3>(9, 3) = -at_turn.left / (b.t - a.t);
    by_keyframes.block<3, 3>(9, n + 3) = at_turn.right / (b.t - a.t);
  }
  MotionInstant instant{state.pose.translation(), state.pose.rotation(), twist, {}};
  if (!propagate) return instant;
  by_keyframes += by_state * gain;
  instant.covariance = propagate(by_keyframes, on.ids, on.dofs) + by_state * covariance * by_state.transpose();
  instant.covariance.diagonal().tail<3>() += rate_variance;
  return instant;
}

}  // namespace tandem

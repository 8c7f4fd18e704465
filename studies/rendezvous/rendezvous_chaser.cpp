#include <algorithm>
#include <chrono>
#include <numbers>

#include <fmt/format.h>

#include <tandem/solvers/relative_covariance.hpp>
#include <tandem/studies/rendezvous/rendezvous_chaser.hpp>
#include <tandem/studies/support/resources.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

constexpr double kPlannedViewHalfAngle = 40.0 / kDegrees;
constexpr double kCorridorHalfAngle = 35.0 / kDegrees;  // Half angle of the docking cone behind the target.
constexpr double kSearchTime =
    10.0;  // Time until planning starts [s]; earlier, the target's velocity is too uncertain.
constexpr double kStandoffTolerance = 1.0;  // Distance from the standoff point at which docking begins [m].
constexpr double kOpticalTimeout = 8.0;     // Time without an optical pose until docking is aborted [s].
constexpr double kCurrentGain = 0.1;        // Gain of the low-pass filter of current measurements.
constexpr double kEstimatorWindow = 40.0;   // s
constexpr double kCoupledWindow = 20.0;     // Duration of the measurements in a coupled plan [s].
constexpr double kSpeedTimeConstant = 1e4;  // Time constant [s] of a practically constant linear velocity.
constexpr std::size_t kOdometryLog = 30;    // Ticks, more than the delay of the estimator.

}  // namespace

template <int N>
RendezvousChaser<N>::RendezvousChaser(const Vehicle& vehicle, const VehicleModel<N>& model,
                                      const RendezvousOptions& options, const RendezvousReadings& first)
    : vehicle_(vehicle), model_(model), options_(options), data_(chaser_sensors()), course_(first.odometry.rotation()) {
  OnlineOptions online;
  online.tracking.non_holonomic = Role::soft;
  double& sway = data_.noise.non_holonomic[0];
  sway = std::hypot(sway, options.current);  // the current moves the target sideways
  if (const auto time = twist_time_constants()) {
    online.tracking.model = MotionModel::damped_twist;
    data_.noise.twist_time = *time;
  }
  online.lag.window = kEstimatorWindow;
  estimator_ = std::make_unique<OnlineEstimator>(data_, std::nullopt, online);
  if (options.method == RendezvousMethod::coupled) window_.emplace(data_, online.tracking, kCoupledWindow);
  if (options.method != RendezvousMethod::pursuit) {
    approach_ = std::make_unique<Planner<N>>(model, plan_options(RendezvousPhase::approach), options.planner);
    docking_ = std::make_unique<Planner<N>>(model, plan_options(RendezvousPhase::docking), options.planner);
    retreat_ = std::make_unique<Planner<N>>(model, plan_options(RendezvousPhase::retreat), options.planner);
  }
  add_readings(first);
}

/// Returns the time constants of the target's twist [s]; nullopt for a constant twist.
template <int N>
std::optional<Vector<6>> RendezvousChaser<N>::twist_time_constants() const {
  if (!std::isfinite(options_.turn_time)) return {};
  return (Vector<6>() << Vector<3>::Constant(kSpeedTimeConstant), Vector<3>::Constant(options_.turn_time)).finished();
}

template <int N>
PlanOptions RendezvousChaser<N>::plan_options(RendezvousPhase phase) const {
  const bool docking = phase == RendezvousPhase::docking;
  PlanOptions o;
  o.steps = int(std::lround(options_.horizon));
  o.goal = pose_behind(docking ? options_.dock : options_.standoff);
  o.twist = Bounds<6>{-vehicle_.most_twist, vehicle_.most_twist};
  o.max_roll_pitch = 0.7;
  o.chance = options_.chance;
  if (options_.method == RendezvousMethod::information) {
    o.information = options_.information;
    o.sight.range = kOpticalRange;
    o.sight.half_angle = kCameraHalfAngle;
    o.fix = data_.sensors[1].sigma;
  }
  o.running_position = docking ? 0.5 : 4.0;  // docking: close to DockingTolerance
  o.running_orientation = docking ? 0.15 : 1.0;
  o.terminal_position = docking ? 0.2 : 1.0;
  o.terminal_orientation = docking ? 0.05 : 0.3;
  o.running_speed = docking ? 0.3 : 1.0;
  if (docking) {
    o.approach = Cone{kCorridorHalfAngle, SE3(SO3::Exp({0.0, 0.0, std::numbers::pi}), Vector<3>(Vector<3>::Zero()))};
    o.view = Cone{kPlannedViewHalfAngle};
  } else if (phase != RendezvousPhase::retreat) {
    o.keep_out = options_.keep_out + options_.margin;
  }
  return o;
}

template <int N>
void RendezvousChaser<N>::advance(const Vector<N>& command, const RendezvousReadings& readings) {
  const ActuatorLag<N> lag(model_.lag, kTick);
  actuators_ = lag.decay.cwiseProduct(actuators_) + (Vector<N>::Ones() - lag.decay).cwiseProduct(command);
  add_readings(readings);
}

template <int N>
void RendezvousChaser<N>::add_readings(const RendezvousReadings& readings) {
  now_ = readings.t;
  odometry_ = readings.odometry;
  estimator_->add_odometry({now_, odometry_});
  odometry_log_.push_back({now_, odometry_});
  if (window_) window_->add_odometry({now_, odometry_});
  if (readings.usbl) add_measurement(0, *readings.usbl);
  if (readings.optical) {
    add_measurement(1, *readings.optical);
    last_optical_ = now_;
  }
}

template <int N>
void RendezvousChaser<N>::add_measurement(std::size_t sensor, const Measurement& m) {
  estimator_->add_target(sensor, m);
  if (window_) window_->add(sensor, m);
}

template <int N>
std::optional<Vector<N>> RendezvousChaser<N>::decide(const Vector<6>& twist, const Vector<3>& current,
                                                     RendezvousStep& step, RendezvousRun& run) {
  current_ += kCurrentGain * (current - current_);
  const VehicleState<N> state = own_state(twist);
  if (!estimator_->has_target() || now_ < kSearchTime) return {};
  const OnlineEstimator::Covariance covariance = estimator_->covariance();
  const Matrix<12, 12> joint = covariance.joint;
  const TargetBelief target = target_belief(joint, state.pose);
  step.estimated = state.pose.inverse() * target.now;
  step.three_sigma =
      3.0 *
      Vector<3>(
          relative_position_covariance<SE3, SE3>(state.pose, target.now, joint).diagonal().cwiseMax(0.0).cwiseSqrt());
  update_phase(target.now, state.pose);
  step.phase = phase_;
  const Vector<N> command = plan_command(state, target, step, run);
  const Vector<3> bow = odometry_.rotation().act({1.0, 0.0, 0.0});
  course_ = SO3::Exp({0.0, 0.0, std::atan2(bow.y(), bow.x())});
  return command;
}

template <int N>
Vector<N> RendezvousChaser<N>::hold_course(const Vector<6>& twist) const {
  return keep_course(model_, {odometry_, twist, actuators_}, current_, course_, options_.target_speed,
                     options_.planner.pursuit);
}

/// Returns the chaser's state: the estimate, propagated by odometry to the current time.
template <int N>
VehicleState<N> RendezvousChaser<N>::own_state(const Vector<6>& twist) {
  VehicleState<N> s;
  const double since = estimator_->newest();
  const auto at = std::find_if(odometry_log_.begin(), odometry_log_.end(),
                               [&](const Stamped<SE3>& o) { return o.t >= since - 0.5 * kTick; });
  s.pose = estimator_->chaser().pose * at->value.inverse() * odometry_;
  s.twist = twist;
  s.actuators = actuators_;
  while (odometry_log_.size() > kOdometryLog) odometry_log_.erase(odometry_log_.begin());
  return s;
}

template <int N>
TargetBelief RendezvousChaser<N>::target_belief(const Matrix<12, 12>& joint, const SE3& chaser) const {
  const double ahead = now_ - estimator_->newest();
  const auto pose = [&](double h) {
    const TargetState x = *estimator_->predicted_target(h);
    return SE3(x.rotation.value_or(SO3()), x.position);
  };
  TargetBelief b;
  b.now = pose(ahead);
  b.before = b.now * (b.now.inverse() * pose(ahead + 1.0)).inverse();
  // Covariance relative to the chaser, δT − Ad(T⁻¹ C) δC. The covariance of the pose one second before also includes
  // the process noise.
  Matrix<6, 12> J;
  J << -(b.now.inverse() * chaser).Ad(), Matrix<6, 6>::Identity();
  const Matrix<6, 6> S = J * joint * J.transpose();
  b.covariance << S, S, S, S;
  b.covariance.diagonal().template head<6>() += data_.noise.constant_twist.cwiseAbs2();
  return b;
}

template <int N>
Planner<N>& RendezvousChaser<N>::planner() {
  if (phase_ == RendezvousPhase::docking) return *docking_;
  return phase_ == RendezvousPhase::retreat ? *retreat_ : *approach_;
}

template <int N>
void RendezvousChaser<N>::update_phase(const SE3& target, const SE3& chaser) {
  const bool seen = now_ - last_optical_ < kOpticalTimeout;
  const double from_standoff = (chaser.translation() - target.act(pose_behind(options_.standoff).translation())).norm();
  const RendezvousPhase before = phase_;
  if (phase_ == RendezvousPhase::searching) phase_ = RendezvousPhase::approach;
  if (phase_ == RendezvousPhase::approach && seen && now_ - last_optical_ < 2.0 && from_standoff < kStandoffTolerance)
    phase_ = RendezvousPhase::docking;
  if (phase_ == RendezvousPhase::docking && !seen) phase_ = RendezvousPhase::retreat;
  const double distance = (chaser.translation() - target.translation()).norm();
  if (phase_ == RendezvousPhase::retreat && distance > options_.keep_out + 2.0 * options_.margin)
    phase_ = RendezvousPhase::approach;
  if (phase_ != before && options_.method != RendezvousMethod::pursuit) planner().reset();
}

template <int N>
Vector<N> RendezvousChaser<N>::plan_command(const VehicleState<N>& state, const TargetBelief& target,
                                            RendezvousStep& step, RendezvousRun& run) {
  const SE3 goal = pose_behind(phase_ == RendezvousPhase::docking ? options_.dock : options_.standoff);
  const Vector<6> target_twist = (target.before.inverse() * target.now).Log();
  if (options_.method == RendezvousMethod::pursuit)
    return pursue(model_, state, current_, SE3(target.now * goal), Vector<6>(goal.inverse().Ad() * target_twist),
                  options_.planner.pursuit);
  step.first = !planner().has_plan();
  const double processor = thread_seconds();
  const auto start = std::chrono::steady_clock::now();
  const PlanResult<N> result = plan(state, target);
  step.solve_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  step.processor_seconds = thread_seconds() - processor;
  step.origin =
      fmt::format("{} by {}{}", name(result.origin), result.summary.solver, result.coupled ? ", coupled" : "");
  step.violation = result.max_violation;
  ++run.plans;
  run.not_accepted += !result.accepted();
  run.shifted += result.origin == PlanOrigin::shifted;
  if (result.accepted()) run.worst_violation = std::max(run.worst_violation, result.max_violation);
  return result.plan.commands.front().cwiseMax(model_.lower).cwiseMin(model_.upper);
}

/// Predicts the target over the horizon. With a chance margin, the prediction includes the fixes that are expected
/// along the planner's initial guess.
template <int N>
TargetPrediction RendezvousChaser<N>::predict(const VehicleState<N>& state, const TargetBelief& belief) {
  const auto predicted = [&](const std::vector<Matrix<6, 6>>& fixes) {
    return predict_target(belief, data_.noise.constant_twist, 1.0, int(std::lround(options_.horizon)),
                          twist_time_constants(), fixes);
  };
  const TargetPrediction prediction = predicted({});
  if (!(options_.chance > 0)) return prediction;
  const Plan<N> along = planner().guess(state, current_, prediction);
  return predicted(expected_fixes(expected_sensors(data_), 1.0, along.states, prediction.pose));
}

template <int N>
PlanResult<N> RendezvousChaser<N>::plan(const VehicleState<N>& state, const TargetBelief& target) {
  std::optional<CoupledEstimate> joint = window_ ? window_->estimate() : std::nullopt;
  if (!joint) return planner().replan(state, current_, predict(state, target));
  VehicleState<N> start = state;  // in the window's frame
  start.pose = joint->problem.value(joint->chaser);
  TargetBelief belief = target;
  belief.before = joint->problem.value(joint->before);
  belief.now = joint->problem.value(joint->now);
  belief.dt = joint->dt;
  const TargetPrediction prediction = predict(start, belief);
  joint->time_constants = twist_time_constants();
  joint->cost_weight = coupled_cost_weight(planner().problem().options(), prediction.covariance.back());
  return planner().replan(start, current_, prediction, *joint);
}

template class RendezvousChaser<3>;
template class RendezvousChaser<8>;

}  // namespace tandem

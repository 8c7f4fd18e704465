#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/lanes.hpp>
#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/solvers/relative_covariance.hpp>
#include <tandem/studies/planning/chaser_sensors.hpp>
#include <tandem/studies/planning/coupled_window.hpp>
#include <tandem/studies/planning/rendezvous.hpp>
#include <tandem/studies/planning/swinging_target.hpp>
#include <tandem/studies/simulation/normal_noise.hpp>
#include <tandem/studies/simulation/pose_sigmas.hpp>
#include <tandem/studies/support/resources.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

constexpr int kTicks = 10;  // to a control period of 1 s
constexpr double kPlannedView = 40.0 / kDegrees;
constexpr double kCorridor = 35.0 / kDegrees;               // half angle behind the target that docking keeps to
constexpr double kSearching = 10.0;                         // s: only then does the estimate tell where the target goes
constexpr double kNearStandoff = 1.0;                       // m: docking begins
constexpr double kLost = 8.0;                               // s without an optical pose: back to the standoff
constexpr double kCollision = 0.6;                          // m between the origins
constexpr double kCurrentSigma = 0.03, kCurrentGain = 0.1;  // of what the Doppler log tells of the current [m/s]
constexpr double kEstimatorWindow = 40.0;                   // s
constexpr double kCoupledWindow = 20.0;                     // s of measurements that a coupled plan joins
constexpr double kSpeedTime = 1e4;                          // s, in which the target's speed is forgotten: it is kept
constexpr double kSpeedSigma = 5e-3, kRateSigma = 1e-3;     // of the measured twist [m/s, rad/s]

template <int N>
class Simulation {
 public:
  Simulation(const Vehicle& vehicle, const VehicleModel<N>& model, const RendezvousOptions& options)
      : vehicle_(vehicle),
        model_(model),
        options_(options),
        tick_(model, kTick),
        motion_(options.seed, options.target_speed),
        data_(sensors_of_chaser()),
        odometry_noise_(options.seed, 1),
        usbl_noise_(options.seed, 2),
        optical_noise_(options.seed, 3),
        twist_noise_(options.seed, 4),
        current_noise_(options.seed, 5) {
    OnlineOptions online;
    online.tracking.non_holonomic = Role::soft;
    double& sway = data_.noise.non_holonomic[0];
    sway = std::hypot(sway, options.current);  // the water carries the target sideways
    if (const auto time = motion_time()) {
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
    begin();
  }

  RendezvousRun run() {
    RendezvousRun run{options_.seed, RendezvousOutcome::timed_out, "time", 0, 0, HUGE_VAL, 0, 0, {}, 0, 0, 0, 0, {}};
    const Vector<N> half = 0.5 * (model_.upper - model_.lower);
    const ThreadLimit one(1);  // so that this thread's processor time is all that a plan takes
    for (int second = 0; second < int(options_.time_limit); ++second) {
      if (options_.stop && *options_.stop) return ended(run, RendezvousOutcome::interrupted, "stopped");
      Vector<N> command = decide(run);
      for (int i = 0; i < kTicks; ++i) {
        if (i > 0 && !planning_) command = hold_way();
        advance(command);
        run.least_miss = std::min(run.least_miss, miss(options_.dock));
        if (phase_ == RendezvousPhase::searching || phase_ == RendezvousPhase::approach)
          run.keep_out_violation = std::max(run.keep_out_violation, options_.keep_out - distance());
        if (is_docked()) return ended(run, RendezvousOutcome::docked, "");
        if (distance() < kCollision) return ended(run, RendezvousOutcome::failed, "collision");
      }
      run.effort += command.cwiseQuotient(half).squaredNorm();
    }
    return ended(run, RendezvousOutcome::timed_out, "time");
  }

 private:
  double now() const { return kTick * double(ticks_); }
  double distance() const { return (truth_.pose.translation() - target_.translation()).norm(); }
  /// Against the world, of which the water that carries it is a part.
  Vector<6> target_twist() const {
    Vector<6> twist = motion_.twist(now());
    twist.head<3>() += target_.rotation().inverse().act(current_);
    return twist;
  }
  /// In which the target's twist is forgotten [s]; none: it is constant.
  std::optional<Vector<6>> motion_time() const {
    if (!std::isfinite(options_.turn_time)) return {};
    return (Vector<6>() << Vector<3>::Constant(kSpeedTime), Vector<3>::Constant(options_.turn_time)).finished();
  }
  SE3 goal(double behind) const { return SE3(SO3(), {-behind, 0.0, 0.0}); }
  double miss(double behind) const {
    return (truth_.pose.translation() - target_.act(goal(behind).translation())).norm();
  }

  PlanOptions plan_options(RendezvousPhase phase) const {
    const bool docking = phase == RendezvousPhase::docking;
    PlanOptions o;
    o.steps = int(std::lround(options_.horizon));
    o.goal = goal(docking ? options_.dock : options_.standoff);
    o.twist = Bounds<6>{-vehicle_.most_twist, vehicle_.most_twist};
    o.most_roll_pitch = 0.7;
    o.chance = options_.chance;
    if (options_.method == RendezvousMethod::information) {
      o.information = options_.information;
      o.sight.range = kOpticalRange;
      o.sight.half_angle = kView;
      o.fix = data_.sensors[1].sigma;
    }
    o.running_position = docking ? 0.5 : 4.0;  // docking: not far above what docked is
    o.running_orientation = docking ? 0.15 : 1.0;
    o.terminal_position = docking ? 0.2 : 1.0;
    o.terminal_orientation = docking ? 0.05 : 0.3;
    o.running_speed = docking ? 0.3 : 1.0;
    if (docking) {
      o.approach = Cone{kCorridor, SE3(SO3::Exp({0.0, 0.0, std::numbers::pi}), Vector<3>(Vector<3>::Zero()))};
      o.view = Cone{kPlannedView};
    } else if (phase != RendezvousPhase::retreat) {
      o.keep_out = options_.keep_out + options_.margin;
    }
    return o;
  }

  void begin() {
    NormalNoise draw(options_.seed, 10);
    const double bearing = 0.7 * draw(), course = 2.0 * std::numbers::pi * draw();
    target_ = SE3(SO3::Exp({0.0, 0.0, course}), {0.0, 0.0, -10.0});
    const Vector<3> behind(-options_.start_distance * std::cos(bearing), options_.start_distance * std::sin(bearing),
                           2.0 * draw());
    const Vector<3> position = target_.act(behind), ahead = target_.translation() - position;
    truth_.pose = SE3(SO3::Exp({0.0, 0.0, std::atan2(ahead.y(), ahead.x()) + 0.3 * draw()}), position);
    course_ = truth_.pose.rotation();
    truth_.twist[0] = options_.target_speed;
    current_ = options_.current * Vector<3>(draw(), draw(), 0.0);
    actuators_.setZero();
    sense(true);
  }

  /// What sensors tell at the instant that is now.
  void sense(bool first = false) {
    if (first)
      odometry_ = truth_.pose;
    else
      odometry_ = odometry_ * last_pose_.inverse() * truth_.pose *
                  SE3::Exp(odometry_noise_.vector<6>(Vector<6>(std::sqrt(kTick) * Vector<6>(data_.noise.odometry))));
    last_pose_ = truth_.pose;
    const double t = now();
    estimator_->add_odometry({t, odometry_});
    odometry_log_.push_back({t, odometry_});
    if (window_) window_->add_odometry({t, odometry_});
    const SE3 seen = truth_.pose.inverse() * target_;
    const Vector<3> p = seen.translation();
    const bool in_view = std::atan2(std::hypot(p.y(), p.z()), p.x()) < kView;
    Measurement m;
    m.t = t;
    if (ticks_ % kUsblEvery == 0) {
      m.position = p + usbl_noise_.vector<3>(Vector<3>(data_.sensors[0].sigma));
      tell(0, m);
    }
    if (ticks_ % kOpticalEvery == 0 && p.norm() < kOpticalRange && in_view) {
      const Vector<6> error = optical_noise_.vector<6>(Vector<6>(data_.sensors[1].sigma));
      m.position = p + error.head<3>();
      m.rotation = seen.rotation() * SO3::Exp(error.tail<3>());
      tell(1, m);
      last_optical_ = t;
    }
  }

  void tell(std::size_t sensor, const Measurement& m) {
    estimator_->add_target(sensor, m);
    if (window_) window_->add(sensor, m);
  }

  void advance(const Vector<N>& command) {
    truth_ = tick_(truth_, command, current_);
    actuators_ = tick_of_lag(command);
    target_ = target_ * SE3::Exp(kTick * target_twist());
    ++ticks_;
    sense();
  }

  /// What the chaser takes its actuators to do: it knows their lag.
  Vector<N> tick_of_lag(const Vector<N>& command) const {
    const ActuatorLag<N> lag(model_.lag, kTick);
    return lag.left.cwiseProduct(actuators_) + (Vector<N>::Ones() - lag.left).cwiseProduct(command);
  }

  Vector<6> measured_twist() { return truth_.twist + twist_noise_.vector<6>(pose_sigmas(kSpeedSigma, kRateSigma)); }

  /// The chaser's state as it believes it to be.
  VehicleState<N> believed() {
    VehicleState<N> s;
    const double since = estimator_->newest();
    const auto at = std::find_if(odometry_log_.begin(), odometry_log_.end(),
                                 [&](const Stamped<SE3>& o) { return o.t >= since - 0.5 * kTick; });
    s.pose = estimator_->chaser().pose * at->value.inverse() * odometry_;
    s.twist = measured_twist();
    s.actuators = actuators_;
    return s;
  }

  TargetBelief belief(const Matrix<12, 12>& joint, const SE3& chaser) const {
    const double ahead = now() - estimator_->newest();
    const auto pose = [&](double h) {
      const TargetState x = *estimator_->predicted_target(h);
      return SE3(x.rotation.value_or(SO3()), x.position);
    };
    TargetBelief b;
    b.now = pose(ahead);
    b.before = b.now * (b.now.inverse() * pose(ahead + 1.0)).inverse();
    // Seen from the chaser: δT − Ad(T⁻¹ C) δC; a second before, the motion's own noise besides.
    Matrix<6, 12> J;
    J << -(b.now.inverse() * chaser).Ad(), Matrix<6, 6>::Identity();
    const Matrix<6, 6> S = J * joint * J.transpose();
    b.covariance << S, S, S, S;
    b.covariance.diagonal().template head<6>() += data_.noise.constant_twist.cwiseAbs2();
    return b;
  }

  Vector<N> decide(RendezvousRun& run) {
    current_estimate_ += kCurrentGain * (current_ + current_noise_.vector(kCurrentSigma) - current_estimate_);
    RendezvousStep step{now(),
                        phase_,
                        truth_.pose,
                        target_,
                        truth_.pose.inverse() * target_,
                        {},
                        Vector<3>::Zero(),
                        distance(),
                        miss(options_.standoff),
                        0.0,
                        "",
                        0.0,
                        {},
                        0.0,
                        false};
    const VehicleState<N> state = believed();
    Vector<N> command;
    planning_ = estimator_->has_target() && now() >= kSearching;
    if (planning_) {
      const OnlineEstimator::Covariance covariance = estimator_->covariance();
      const Matrix<12, 12> joint = covariance.joint;
      const TargetBelief target = belief(joint, state.pose);
      step.estimated = state.pose.inverse() * target.now;
      step.three_sigma = 3.0 * Vector<3>(relative_position_covariance<SE3, SE3>(state.pose, target.now, joint)
                                             .diagonal()
                                             .cwiseMax(0.0)
                                             .cwiseSqrt());
      choose_phase(target.now, state.pose);
      step.phase = phase_;
      step.miss = miss(phase_ == RendezvousPhase::docking ? options_.dock : options_.standoff);
      command = follow(state, target, step, run);
      const Vector<3> bow = odometry_.rotation().act({1.0, 0.0, 0.0});
      course_ = SO3::Exp({0.0, 0.0, std::atan2(bow.y(), bow.x())});
    } else {
      command = hold_way();
    }
    step.command = command.head(Eigen::Index(vehicle_.actuators.size()));
    run.steps.push_back(std::move(step));
    while (odometry_log_.size() > 3 * kTicks) odometry_log_.erase(odometry_log_.begin());
    return command;
  }

  /// While it does not plan, its autopilot keeps its course and the way that it is launched with, by dead reckoning: at
  /// rest, a torpedo's fins turn nothing.
  Vector<N> hold_way() {
    return keep_course(model_, {odometry_, measured_twist(), actuators_}, current_estimate_, course_,
                       options_.target_speed, options_.planner.pursuit);
  }

  Planner<N>& planner() {
    if (phase_ == RendezvousPhase::docking) return *docking_;
    return phase_ == RendezvousPhase::retreat ? *retreat_ : *approach_;
  }

  void choose_phase(const SE3& target, const SE3& chaser) {
    const bool seen = now() - last_optical_ < kLost;
    const double from_standoff = (chaser.translation() - target.act(goal(options_.standoff).translation())).norm();
    const RendezvousPhase before = phase_;
    if (phase_ == RendezvousPhase::searching) phase_ = RendezvousPhase::approach;
    if (phase_ == RendezvousPhase::approach && seen && now() - last_optical_ < 2.0 && from_standoff < kNearStandoff)
      phase_ = RendezvousPhase::docking;
    if (phase_ == RendezvousPhase::docking && !seen) phase_ = RendezvousPhase::retreat;
    const double distance = (chaser.translation() - target.translation()).norm();
    if (phase_ == RendezvousPhase::retreat && distance > options_.keep_out + 2.0 * options_.margin)
      phase_ = RendezvousPhase::approach;
    if (phase_ != before && options_.method != RendezvousMethod::pursuit) planner().forget();
  }

  Vector<N> follow(const VehicleState<N>& state, const TargetBelief& target, RendezvousStep& step, RendezvousRun& run) {
    const double behind = phase_ == RendezvousPhase::docking ? options_.dock : options_.standoff;
    const Vector<6> target_twist = (target.before.inverse() * target.now).Log();
    if (options_.method == RendezvousMethod::pursuit)
      return pursue(model_, state, current_estimate_, SE3(target.now * goal(behind)),
                    Vector<6>(goal(behind).inverse().Ad() * target_twist), options_.planner.pursuit);
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

  /// With --chance by the fixes, too, that are expected along the plan that this one starts from.
  TargetPrediction predict(const VehicleState<N>& state, const TargetBelief& belief) {
    const auto predicted = [&](const std::vector<Matrix<6, 6>>& fixes) {
      return predict_target(belief, data_.noise.constant_twist, 1.0, int(std::lround(options_.horizon)), motion_time(),
                            fixes);
    };
    const TargetPrediction prediction = predicted({});
    if (!(options_.chance > 0)) return prediction;
    const Plan<N> along = planner().guess(state, current_estimate_, prediction);
    return predicted(expected_fixes(expected_sensors(data_), 1.0, along.states, prediction.pose));
  }

  PlanResult<N> plan(const VehicleState<N>& state, const TargetBelief& target) {
    std::optional<CoupledEstimate> joint = window_ ? window_->estimate() : std::nullopt;
    if (!joint) return planner().replan(state, current_estimate_, predict(state, target));
    VehicleState<N> start = state;  // in the frame of the window
    start.pose = joint->problem.value(joint->chaser);
    TargetBelief belief = target;
    belief.before = joint->problem.value(joint->before);
    belief.now = joint->problem.value(joint->now);
    belief.dt = joint->dt;
    const TargetPrediction prediction = predict(start, belief);
    joint->time_constants = motion_time();
    joint->share = coupled_share(planner().problem().options(), prediction.covariance.back());
    return planner().replan(start, current_estimate_, prediction, *joint);
  }

  bool is_docked() const {
    const DockedWithin within;
    const SE3 docked = target_ * goal(options_.dock);
    const SE3 off = docked.inverse() * truth_.pose;
    const Vector<6> along = goal(options_.dock).inverse().Ad() * target_twist();
    const Vector<3> velocity = off.rotation().act(Vector<3>(truth_.twist.template head<3>())) - along.head<3>();
    const Matrix<3, 3> R = off.rotation().matrix();
    const double heading = std::abs(std::atan2(R(1, 0), R(0, 0)));
    return off.translation().norm() <= within.position && kDegrees * heading <= within.heading &&
           velocity.norm() <= within.speed;
  }

  RendezvousRun& ended(RendezvousRun& run, RendezvousOutcome outcome, const char* why) const {
    run.outcome = outcome;
    run.why = why;
    run.seconds = now();
    run.miss = miss(options_.dock);
    if (!run.steps.empty() && !run.steps.back().three_sigma.isZero(0))
      run.three_sigma = run.steps.back().three_sigma.maxCoeff();
    return run;
  }

  const Vehicle& vehicle_;
  const VehicleModel<N>& model_;
  const RendezvousOptions& options_;
  VehicleStep<N> tick_;
  SwingingTarget motion_;
  TrackingData data_;
  NormalNoise odometry_noise_, usbl_noise_, optical_noise_, twist_noise_, current_noise_;
  std::unique_ptr<OnlineEstimator> estimator_;
  std::optional<CoupledWindow> window_;
  std::unique_ptr<Planner<N>> approach_, docking_, retreat_;
  VehicleState<N> truth_;
  SE3 target_, odometry_, last_pose_;
  SO3 course_;
  bool planning_ = false;
  std::vector<Stamped<SE3>> odometry_log_;
  Vector<3> current_ = Vector<3>::Zero(), current_estimate_ = Vector<3>::Zero();
  Vector<N> actuators_;
  RendezvousPhase phase_ = RendezvousPhase::searching;
  double last_optical_ = -HUGE_VAL;
  long ticks_ = 0;
};

}  // namespace

RendezvousRun run_rendezvous(const Vehicle& vehicle, const RendezvousOptions& options) {
  if (!(options.horizon >= 2.0 && options.horizon <= 500.0))
    throw Error(fmt::format("a rendezvous plans 2 to 500 s ahead, not {:g}", options.horizon));
  if (!(options.turn_time > 0)) throw Error("the target's turn rate is forgotten in a time above zero");
  if (!(options.time_limit >= 1.0)) throw Error("a rendezvous needs a second at least");
  if (!(options.standoff > options.keep_out + options.margin))
    throw Error(fmt::format("the standoff, {:g} m, is inside the keep-out distance of {:g} m and its margin of {:g} m",
                            options.standoff, options.keep_out, options.margin));
  return std::visit(
      [&](const auto& model) {
        using Model = std::decay_t<decltype(model)>;
        return Simulation<Model::actuators>(vehicle, model, options).run();
      },
      vehicle.model);
}

}  // namespace tandem

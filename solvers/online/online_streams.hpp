#pragma once

#include <chrono>
#include <cmath>
#include <deque>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/imu_screen.hpp>
#include <tandem/problem/tracking/measurement_screen.hpp>
#include <tandem/solvers/online/event_queue.hpp>
#include <tandem/solvers/online/imu_trial.hpp>
#include <tandem/solvers/online/keyframe_policy.hpp>
#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/solvers/online/online_window.hpp>

namespace tandem {

/// The input streams of an OnlineEstimator: checks and queues measurements, and passes them to the window in time
/// order.
class OnlineEstimator::Streams {
 public:
  using MaybeRejection = std::optional<Rejection>;

  Streams(OnlineEstimator& hooks, const TrackingData& tracking, const std::optional<NavigationData>& ego,
          const OnlineOptions& options);

  /// Calls f(*this), which changes the estimate, then a reset() that hooks have requested. Throws BadInputError within
  /// a hook.
  template <class F>
  auto change(F f) {
    if (changing_)
      throw BadInputError(
          "OnlineEstimator: a hook must not add measurements, finish, restore or solve; do so after the current call");
    if (reset_requested_) reset();  // the last call threw
    struct End {
      Streams& streams;
      int exceptions = std::uncaught_exceptions();
      ~End() noexcept(false) {
        streams.changing_ = false;
        if (streams.reset_requested_ && std::uncaught_exceptions() == exceptions) streams.reset();
      }
    } const end{*this};
    changing_ = true;
    return f(*this);
  }

  MaybeRejection add_odometry(const Stamped<SE3>& pose);
  MaybeRejection add_imu(const ImuSample& sample);
  MaybeRejection add_ego(std::size_t sensor, const EgoMeasurement& m);
  MaybeRejection add_target(std::size_t sensor, const Measurement& m);
  void finish();
  void reset();  // after the current change() if within one
  Summary solve_to_convergence() { return window_->solve_to_convergence(); }
  const detail::OnlineWindow& window() const { return *window_; }
  const TrackHealth& health() const { return health_.health(); }
  void restore(const TrackHealth& health, const std::optional<MotionHypotheses::Checkpoint>& hypotheses) {
    if (hypotheses) window_->restore(*hypotheses);
    health_.restore(health);
    update_output_health();
  }
  std::optional<Alignment> handover_start() const;
  Instant at(double t) const { return window_->at(t, odometry_); }
  const std::vector<std::pair<double, double>>& imu_exclusions() const { return imu_exclusions_; }

 private:
  using Clock = std::chrono::steady_clock;

  MaybeRejection why_too_late(const std::string& name, double t) const;
  MaybeRejection enqueue(double stamp, double valid, detail::OnlineEvent event);
  MaybeRejection process_until(double stamp);
  /// Judges the value of a measurement of sensor `index` of the health monitor.
  MaybeRejection why_implausible(std::size_t index, const std::string& name, double t, const Reading& reading);
  void make_screens();
  void reject(const std::string& name, double t);
  void reject(const std::string& name, const Rejection& why);
  double motion_end() const;
  void learn_imu_lag(double t);
  double imu_wait() const;
  double keyframe_limit() const;
  detail::NextStep next() const;
  void process();
  bool start_chaser();
  bool process_event();
  bool process_ego(std::size_t sensor, const EgoMeasurement& m, double t);
  bool process_target(std::size_t sensor, const Measurement& m, double t);
  void add_keyframe(double t, std::size_t sensor = 0, const Measurement* first = nullptr);
  void update();
  void soften_constraints();
  void reset_now();
  void make_window();
  void widen_start();
  bool tries_imu() const;
  bool exclude_imu(std::optional<double> since, double t);
  void readmit_imu(double t);
  void end_imu_exclusion(double t);
  void continue_from(const detail::ImuTrial::Agreement& agreement, std::string why);
  std::vector<ImuSample> newest_samples() const;
  bool uses_imu() const { return ego_ && ego_->imu && !imu_excluded_; }
  enum class Chaser { continues, realigns };  // after a reset
  void reset_window(TrackReset::Kind kind, std::string why, const EgoStateSigmas& min_sigmas = {},
                    Chaser chaser = Chaser::continues);
  void reset_to(const std::string& sensor, double t, std::optional<EgoSensorType> own = {});
  void adopt_measured(Alignment& start) const;
  std::optional<EgoStateSigmas> state_sigmas(const EgoKeyframe& keyframe, const EgoStateSigmas& min_sigmas) const;
  std::optional<Alignment> state_before(double t) const;
  void begin_reset(TrackReset::Kind kind, std::string why);
  bool suspend_before(double t);
  void update_output_health();
  std::optional<double> chaser_aided() const;
  void drop_stale();
  std::size_t target_index(std::size_t sensor) const { return (ego_ ? ego_->sensors.size() : 0) + sensor; }
  bool apply_gate(std::size_t index, const std::string& name, double t, const detail::OnlineWindow::Outcome& outcome);

  OnlineEstimator& hooks_;
  OnlineOptions options_;
  const TrackingData settings_;
  const std::optional<NavigationData> ego_;
  NavigationData alignment_data_;   // data waiting for the alignment
  std::optional<Alignment> start_;  // OnlineOptions::start, until it is used
  const double interval_;
  std::unique_ptr<detail::OnlineWindow> window_;
  detail::EventQueue queue_;
  detail::HealthMonitor health_;
  std::vector<Stamped<SE3>> odometry_;
  OdometryScreen odometry_screen_;
  Eigen::VectorXd start_sigma_;  // of the first chaser pose of a window after a reset; only with odometry
  std::optional<ImuScreen> imu_screen_;
  std::vector<ReadingScreen> screens_;                      // by index of the health monitor
  std::vector<std::optional<EgoMeasurement>> newest_ego_;   // newest plausible measurement of each own sensor
  std::optional<detail::ImuTrial> imu_trial_;               // with an IMU; has its newest samples
  bool imu_excluded_ = false;                               // the IMU contradicts the other sensors
  double next_imu_trial_ = -HUGE_VAL, imu_trial_wait_ = 0;  // s
  std::vector<std::pair<double, double>> imu_exclusions_;   // start and end [s]
  double last_imu_ = -HUGE_VAL;
  double imu_lag_ = 0, imu_lag_at_ = -HUGE_VAL;  // s: largest recent lag of new samples behind the clock, and its clock
  double aligned_ = -HUGE_VAL;                   // time of the last alignment [s]
  MaybeRejection rejected_;                      // rejection of the current call
  bool finished_ = false;
  bool changing_ = false;         // Within change() or reset().
  bool reset_requested_ = false;  // Requested by a hook.
  // Since the last update:
  std::optional<Clock::time_point> due_;  // Time of the first change that needs an update.
  bool new_keyframe_ = false;             // A keyframe was added.
  bool pending_ = false;                  // Measurements of the chaser wait for the next update.
};

}  // namespace tandem

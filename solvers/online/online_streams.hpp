#pragma once

#include <chrono>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tandem/solvers/online/event_queue.hpp>
#include <tandem/solvers/online/keyframe_policy.hpp>
#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/solvers/online/online_window.hpp>

namespace tandem {

/// The lines that come in, and what is done with each when its turn has come.
class OnlineEstimator::Streams {
 public:
  using MaybeRefusal = std::optional<Refusal>;

  Streams(OnlineEstimator& hooks, const TrackingData& tracking, const std::optional<NavigationData>& ego,
          const OnlineOptions& options);

  MaybeRefusal add_odometry(const Stamped<SE3>& pose);
  MaybeRefusal add_imu(const ImuSample& sample);
  MaybeRefusal add_ego(std::size_t sensor, const EgoMeasurement& m);
  MaybeRefusal add_target(std::size_t sensor, const Measurement& m);
  void finish();
  void begin_anew();
  Summary settle() { return window_->settle(); }
  const detail::OnlineWindow& window() const { return *window_; }
  const TrackHealth& health() const { return health_.health(); }
  void go_on_from(const TrackHealth& health, const std::optional<MotionHypotheses::Memory>& hypotheses) {
    if (hypotheses) window_->go_on_from(*hypotheses);
    health_.go_on_from(health);
    note_outputs();
  }
  std::optional<Alignment> newest_start() const;

 private:
  using Clock = std::chrono::steady_clock;

  MaybeRefusal why_too_late(const std::string& name, double t) const;
  MaybeRefusal wait(double stamp, double valid, detail::OnlineEvent event);
  MaybeRefusal come(double stamp);
  MaybeRefusal why_implausible(const std::string& name, double t, bool plausible) const;
  void refuse(const std::string& name, double t);
  void refuse(const std::string& name, const Refusal& why);
  double reached() const;
  double last_motion() const;
  detail::NextStep next() const;
  void process();
  bool start_chaser();
  bool take_event();
  bool take_ego(std::size_t sensor, const EgoMeasurement& m, double t);
  bool take_target(std::size_t sensor, const Measurement& m, double t);
  void add_keyframe(double t, std::size_t sensor = 0, const Measurement* first = nullptr);
  void update();
  void make_window();
  enum class Chaser { goes_on, aligns };
  void restart(TrackReset::Kind kind, std::string why, const EgoSpread& doubt = {}, Chaser chaser = Chaser::goes_on);
  std::optional<EgoSpread> newest_spread(const EgoSpread& least) const;
  bool suspend_before(double t);
  void note_outputs();
  std::optional<double> chaser_aided() const;
  void forget_old();
  std::size_t watched_target(std::size_t sensor) const { return (ego_ ? ego_->sensors.size() : 0) + sensor; }
  bool judge(std::size_t watched, const std::string& name, double t, const detail::OnlineWindow::Outcome& outcome);

  OnlineEstimator& hooks_;
  const OnlineOptions options_;
  const TrackingData settings_;
  const std::optional<NavigationData> ego_;
  NavigationData waiting_;          // for the alignment
  std::optional<Alignment> start_;  // that was given, until it has been used
  const double interval_;
  std::unique_ptr<detail::OnlineWindow> window_;
  detail::EventQueue queue_;
  detail::HealthMonitor health_;
  std::vector<Stamped<SE3>> odometry_;
  std::vector<Stamped<SE3>> jumped_;      // odometry that does not follow from what came before
  std::deque<ImuSample> recent_samples_;  // since the newest keyframe, to begin anew from there
  double last_imu_ = -HUGE_VAL;
  double aligned_ = -HUGE_VAL;  // s, when the chaser's own sensors started it
  MaybeRefusal refused_;
  bool finished_ = false;
  // Since the last update: when what calls for one began; a keyframe has joined; a measurement of the chaser's own has,
  // which waits for the next.
  std::optional<Clock::time_point> due_;
  bool new_keyframe_ = false, unsolved_ = false;
};

}  // namespace tandem

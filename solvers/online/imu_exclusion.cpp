#include <algorithm>
#include <cmath>
#include <utility>

#include <tandem/solvers/online/online_streams.hpp>

// Excludes an IMU that contradicts the other sensors, and readmits it.
namespace tandem {
namespace {

using detail::ImuTrial;
using detail::seconds_text;

constexpr double kBeforeFault = 3;                   // s; a trial starts this long before the first contradiction
constexpr double kReadmissionTrial = 5;              // s; length of a trial with the IMU
constexpr double kFirstWait = 1, kLongestWait = 30;  // s; between trials that fail

}  // namespace

bool OnlineEstimator::Streams::tries_imu() const { return uses_imu() && std::isfinite(options_.reset.reset_after); }

/// Continues without the IMU if the sensors that have contradicted the estimate since `since` agree with each other
/// without it. Returns whether it does.
bool OnlineEstimator::Streams::exclude_imu(std::optional<double> since, double t) {
  if (!since || !tries_imu()) return false;
  const auto start = state_before(*since - kBeforeFault);
  const auto agreement = start && start->t < *since ? imu_trial_->run(*start, false) : std::nullopt;
  imu_trial_wait_ = std::clamp(2 * imu_trial_wait_, kFirstWait, kLongestWait);
  next_imu_trial_ = t + imu_trial_wait_;
  if (!agreement) return false;
  imu_trial_wait_ = 0;
  next_imu_trial_ = t + kReadmissionTrial;
  imu_excluded_ = true;
  imu_exclusions_.emplace_back(start->t, HUGE_VAL);
  continue_from(*agreement, ego_->imu->name + " contradicts " + health_.contradicting_sensors(t) + " since " +
                                seconds_text(*since) + ", so it is not used until it agrees with them");
  return true;
}

/// Uses an excluded IMU again if all sensors agree with each other and with it.
void OnlineEstimator::Streams::readmit_imu(double t) {
  if (t < next_imu_trial_) return;
  next_imu_trial_ = t + kReadmissionTrial;
  const auto start = state_before(t - kReadmissionTrial);
  const auto agreement = start ? imu_trial_->run(*start, true) : std::nullopt;
  if (!agreement) return;
  end_imu_exclusion(start->t);
  continue_from(*agreement, ego_->imu->name + " agrees with the other sensors again at " + seconds_text(t));
}

void OnlineEstimator::Streams::end_imu_exclusion(double t) {
  if (std::exchange(imu_excluded_, false)) imu_exclusions_.back().second = t;
}

/// Replaces the estimate of the chaser by that of a trial.
void OnlineEstimator::Streams::continue_from(const ImuTrial::Agreement& agreement, std::string why) {
  begin_reset(TrackReset::Kind::contradicted, std::move(why));
  if (hooks_.on_leave) {
    for (const Stamped<EgoState>& state : window_->states())
      if (state.t < agreement.states.front().t) hooks_.on_leave(state);
    for (const Stamped<EgoState>& state : agreement.states)
      if (state.t < agreement.newest.t) hooks_.on_leave(state);
  }
  make_window();
  window_->start_chaser(agreement.newest, newest_samples());
}

/// Returns the samples for a new window.
std::vector<ImuSample> OnlineEstimator::Streams::newest_samples() const {
  if (!uses_imu()) return {};
  return {imu_trial_->samples().begin(), imu_trial_->samples().end()};
}

}  // namespace tandem

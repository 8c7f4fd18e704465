#include <algorithm>

#include <tandem/solvers/online/online_streams.hpp>

// The odometry of an OnlineEstimator.
namespace tandem {
namespace {

using detail::seconds_text;
using Kind = Rejection::Kind;

constexpr std::size_t kMaxOdometry = 4096;  // poses

/// Returns why displaced poses from time t [s] on end the present window.
std::string why_displaced(OdometryScreen::Verdict verdict, double t, double excursion_begin) {
  const std::string at = " at " + seconds_text(t);
  if (verdict == OdometryScreen::Verdict::returned)
    return "odometry returned to its earlier origin" + at + "; its poses since " + seconds_text(excursion_begin) +
           " were wrong";
  if (verdict == OdometryScreen::Verdict::wrong_start)
    return "the poses of odometry before the one" + at + " were wrong";
  return "odometry jumped to a new origin" + at + " and continues from the pose expected there";
}

}  // namespace

std::optional<Rejection> OnlineEstimator::Streams::add_odometry(const Stamped<SE3>& pose) {
  if (ego_) return Rejection{Kind::not_in_use, "odometry: not in use, the chaser moves by its own sensors"};
  if (!odometry_.empty() && !(pose.t > odometry_.back().t))
    return Rejection{Kind::not_increasing,
                     "odometry: the pose at " + seconds_text(pose.t) + " is not later than the previous one"};
  if (auto why = queue_.why_invalid_stamp("odometry", pose.t, window_->started()))
    return Rejection{Kind::invalid_time, *why};
  const std::vector<Stamped<SE3>> displaced = odometry_screen_.displaced();
  const bool was_frozen = odometry_screen_.is_frozen();
  const OdometryScreen::Verdict verdict = odometry_screen_.judge(pose);
  switch (verdict) {
    case OdometryScreen::Verdict::missing:
      return Rejection{Kind::implausible, "odometry: the pose at " + seconds_text(pose.t) + " is implausible", pose.t};
    case OdometryScreen::Verdict::displaced:
      return Rejection{Kind::implausible,
                       "odometry: the pose at " + seconds_text(pose.t) + " is implausibly far from the previous one",
                       pose.t};
    case OdometryScreen::Verdict::frozen:
      process_until(pose.t);  // time advances although the value is rejected
      return Rejection{
          Kind::implausible,
          "odometry: rejected a pose at " + seconds_text(pose.t) + " " + std::string(text(ReadingFault::frozen)),
          pose.t};
    case OdometryScreen::Verdict::new_origin:
    case OdometryScreen::Verdict::wrong_start:
    case OdometryScreen::Verdict::returned:
      if (window_->started())
        reset_window(TrackReset::Kind::contradicted,
                     why_displaced(verdict, displaced.front().t, odometry_screen_.excursion_begin()));
      odometry_.clear();
      for (const Stamped<SE3>& other : displaced) odometry_.push_back(odometry_screen_.continued(other));
      break;
    case OdometryScreen::Verdict::use:
      if (!was_frozen) break;
      // Not even the mean motion is known for the time in which the odometry was frozen.
      if (window_->started())
        reset_window(TrackReset::Kind::suspended,
                     "odometry was frozen from " + seconds_text(odometry_.back().t) + " to " + seconds_text(pose.t));
      odometry_.clear();
      break;
  }
  if (odometry_.size() > kMaxOdometry && window_->started())
    std::erase_if(odometry_, [&](const Stamped<SE3>& x) { return x.t < window_->newest() - 2 * interval_; });
  odometry_.push_back(odometry_screen_.continued(pose));
  return process_until(pose.t);
}

}  // namespace tandem

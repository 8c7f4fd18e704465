#pragma once

#include <array>
#include <cmath>
#include <vector>

#include <tandem/problem/navigation/navigation_checks.hpp>
#include <tandem/problem/navigation/reading_screen.hpp>
#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem {

/// Returns the numbers of a target measurement that a sensor of this type measures.
Reading reading(SensorType type, const Measurement& m);
/// Returns the options for a sensor that observes the target.
ReadingScreen::Options screen_options(const TargetSensor& sensor);

/// Judges the poses of an odometry one by one, in time order.
class OdometryScreen {
 public:
  enum class Verdict {
    use,
    missing,    ///< not finite, or farther than 1e8 m from the origin
    displaced,  ///< farther from the last used pose than the vehicle can move
    frozen,     ///< repeats a coordinate, although the vehicle moved too fast to stop there
    // The fifth successive displaced pose that continues the others:
    new_origin,   ///< the odometry has a new origin
    wrong_start,  ///< the fewer poses before were wrong; discard them
    returned,     ///< back at the origin before the last jump: the poses from excursion_begin() on were wrong
  };
  /// Returns whether to use the pose. The last three verdicts make the displaced poses before it usable, too.
  Verdict judge(const Stamped<SE3>& pose);
  /// Returns a pose relative to the first origin. After a jump, the odometry continues from the pose that its motion
  /// before the jump leads to.
  Stamped<SE3> continued(const Stamped<SE3>& pose) const { return {pose.t, first_from_current_ * pose.value}; }
  /// Returns whether the last pose was frozen.
  bool is_frozen() const { return frozen_; }
  /// Returns the displaced poses since the last used one.
  const std::vector<Stamped<SE3>>& displaced() const { return displaced_; }
  /// Returns the time of the first pose after the last jump to a new origin [s].
  double excursion_begin() const { return excursion_begin_; }
  /// After Verdict::new_origin, returns the motion that was assumed across the jump [m, rad]; else zero.
  const Vector<6>& bridged() const { return bridged_; }
  void clear() { *this = {}; }

 private:
  bool can_follow(const Stamped<SE3>& before, const Stamped<SE3>& after) const;
  void learn(const Stamped<SE3>& pose);
  bool repeats_coordinate(const Stamped<SE3>& pose);
  Verdict settle();
  void restart();

  std::optional<Stamped<SE3>> last_;
  std::vector<Stamped<SE3>> displaced_;
  double speed_ = 0, turn_rate_ = 0;        // typical speed and turn rate [m/s, rad/s]
  int steps_ = 0;                           // used poses
  Vector<6> twist_ = Vector<6>::Zero();     // twist of the last step [m/s, rad/s]
  Vector<3> velocity_ = Vector<3>::Zero();  // velocity of the last step, in the frame of the odometry [m/s]
  struct Run {
    int repeats = 0;            // successive equal values
    bool stopped_hard = false;  // before the first of them, the vehicle was too fast to stop there
  };
  std::array<Run, 3> runs_{};  // by coordinate
  bool frozen_ = false;
  SE3 first_from_current_{};  // present origin of the odometry in the frame of the first one
  /// The last pose before the last jump, and the origin then.
  struct Origin {
    Stamped<SE3> last;
    SE3 first_from_it;
  };
  std::optional<Origin> before_;
  double excursion_begin_ = -HUGE_VAL;  // s
  Vector<6> bridged_ = Vector<6>::Zero();
};

/// Discards poses and measurements with implausible values. Returns the findings.
std::vector<NavigationFinding> screen(TrackingData& data);

}  // namespace tandem

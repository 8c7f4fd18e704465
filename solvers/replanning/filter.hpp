#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace tandem::detail {

/// Filter of a line search with hard constraints (Wächter & Biegler 2006, §2.3). A point is acceptable if it has less
/// violation or less cost than each stored point and than the previous iterate. If the step predicts a decrease of the
/// cost and the previous iterate is nearly feasible, the cost must decrease by a part of the prediction.
class Filter {
 public:
  struct Point {
    double cost, violation;
  };

  /// Forgets all points. `violation` is that of the initial guess: it defines which points are nearly feasible, and
  /// which violations are too large.
  void start(double violation) {
    points_.clear();
    nearly_feasible_ = kNearlyFeasible * std::max(1.0, violation);
    add({-HUGE_VAL, kMaxViolation * std::max(1.0, violation)});
  }

  /// Returns whether `to`, reached by a fraction of the step from `from`, is acceptable. `slope` is the derivative of
  /// the cost along the whole step. If the point is accepted for its violation only, `from` is stored.
  bool accept(const Point& from, const Point& to, double fraction, double slope) {
    if (!std::isfinite(to.cost) || !std::isfinite(to.violation) || !admits(to)) return false;
    const double gain = -fraction * slope, noise = kNoise * (1.0 + std::abs(from.cost));
    const double predicted =
        std::pow(gain, kCostPower) * std::pow(fraction, 1.0 - kCostPower);  // Wächter & Biegler 2006, eq. 19
    if (gain > 0 && from.violation <= nearly_feasible_ && predicted > std::pow(from.violation, kViolationPower))
      return to.cost <= from.cost - kArmijo * gain + noise;
    if (to.violation > (1.0 - kMargin) * from.violation && to.cost > from.cost - kMargin * from.violation + noise)
      return false;
    add(from);
    return true;
  }

  /// Stores a point: later points must improve on it.
  void add(const Point& point) {
    std::erase_if(points_, [&](const Point& p) { return p.cost >= point.cost && p.violation >= point.violation; });
    points_.push_back(point);
  }

  /// Returns whether a point improves on each stored point.
  bool admits(const Point& to) const {
    return std::none_of(points_.begin(), points_.end(), [&](const Point& p) {
      return to.violation > (1.0 - kMargin) * p.violation && to.cost > p.cost - kMargin * p.violation;
    });
  }

 private:
  static constexpr double kMargin = 1e-5, kArmijo = 1e-4, kNoise = 1e-12;
  static constexpr double kCostPower = 2.3, kViolationPower = 1.1;
  static constexpr double kNearlyFeasible = 1e-4, kMaxViolation = 1e4;  // relative to the initial guess, or to 1

  double nearly_feasible_ = kNearlyFeasible;
  std::vector<Point> points_;  // none dominates another
};

}  // namespace tandem::detail

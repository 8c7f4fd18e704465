#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace tandem::detail {

/// What a line search under hard constraints accepts: a point with less violation or less cost than each one that was left
/// for the sake of the violation, and than the one it comes from. Where the cost is bound to fall and the point before is
/// next to feasible, it has to fall by a part of what its slope foretells.   Wächter & Biegler 2006, §2.3
class Filter {
 public:
  struct Point {
    double cost, violation;
  };

  /// Whether `to`, a fraction of the step on from `from`, is good enough; `slope` is the cost's along the whole step. A
  /// point that got by for its violation keeps what is no better than `from` from being accepted later.
  bool accept(const Point& from, const Point& to, double fraction, double slope) {
    if (!std::isfinite(to.cost) || !std::isfinite(to.violation) || !admits(to)) return false;
    const double gain = -fraction * slope, noise = kNoise * (1.0 + std::abs(from.cost));
    const double foretold = std::pow(gain, kCostPower) * std::pow(fraction, 1.0 - kCostPower);  // their (19)
    if (gain > 0 && foretold > std::pow(from.violation, kViolationPower))
      return to.cost <= from.cost - kArmijo * gain + noise;
    if (to.violation > (1.0 - kMargin) * from.violation && to.cost > from.cost - kMargin * from.violation + noise)
      return false;
    leave(from);
    return true;
  }

  /// Nothing that is no better than this is accepted from now on.
  void leave(const Point& point) {
    std::erase_if(left_, [&](const Point& p) { return p.cost >= point.cost && p.violation >= point.violation; });
    left_.push_back(point);
  }

  bool admits(const Point& to) const {
    return std::none_of(left_.begin(), left_.end(), [&](const Point& p) {
      return to.violation > (1.0 - kMargin) * p.violation && to.cost > p.cost - kMargin * p.violation;
    });
  }

  void clear() { left_.clear(); }

 private:
  static constexpr double kMargin = 1e-5, kArmijo = 1e-4, kNoise = 1e-12;
  static constexpr double kCostPower = 2.3, kViolationPower = 1.1;

  std::vector<Point> left_;  // none dominates another
};

}  // namespace tandem::detail

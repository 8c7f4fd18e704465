#include <algorithm>
#include <cmath>
#include <map>

#include <tandem/solvers/calibration/flat_range.hpp>

namespace tandem::detail {
namespace {

constexpr double kFlatSlope = 0.05;  // slope of the log evidence by the log factor, below which it is flat
constexpr int kBisections = 3;       // between a usable point and one without evidence

/// Returns the argument at which the cubic through two points and their slopes falls to `level`.
double crossing(double inside, const ProfilePoint& a, double outside, const ProfilePoint& b, double level) {
  const double width = outside - inside;
  const auto cubic = [&](double t) {
    return (1 + 2 * t) * (1 - t) * (1 - t) * a.value + t * (1 - t) * (1 - t) * width * a.slope +
           t * t * (3 - 2 * t) * b.value + t * t * (t - 1) * width * b.slope;
  };
  double above = 0, below = 1;
  for (int k = 0; k < 40; ++k) {
    const double t = 0.5 * (above + below);
    (cubic(t) >= level ? above : below) = t;
  }
  return inside + above * width;
}

}  // namespace

FlatRange flat_range(double from, const ProfilePoint& here, double first_reach, double bound,
                     FunctionRef<ProfilePoint(double)> profile_at) {
  std::map<double, ProfilePoint> seen{{from, here}};
  // The prior may have shifted the estimate away from the maximum of the data, so the search goes both ways.
  double peak = here.value;
  for (const double direction : {-1.0, 1.0}) {
    ProfilePoint at{peak, -HUGE_VAL};
    double x = from;
    const double end = std::clamp(from + direction * kMaxHalfWidth, -bound, bound);
    for (double reach = first_reach; x != end && at.value >= peak - kEvidenceDrop && !(std::abs(at.slope) < kFlatSlope);
         reach = std::min(3 * reach, reach + 1)) {
      x = direction * std::min(direction * (from + direction * reach), direction * end);
      at = profile_at(x);
      seen.emplace(x, at);
      peak = std::max(peak, at.value);
    }
  }
  if (std::abs(from) > kMaxHalfWidth) seen.emplace(0.0, profile_at(0.0));  // does the range exclude the given value?
  const auto edge = [&](double direction, bool& bounded) {
    const auto best =
        std::max_element(seen.begin(), seen.end(), [](auto& a, auto& b) { return a.second.value < b.second.value; });
    double inside = best->first, outside = direction * HUGE_VAL;
    for (const auto& [x, at] : seen) {
      if ((x - best->first) * direction <= 0) continue;
      if (at.value >= peak - kEvidenceDrop) {
        if ((x - inside) * direction > 0) inside = x;
      } else if ((outside - x) * direction > 0) {
        outside = x;
      }
    }
    bounded = false;
    if (!std::isfinite(outside)) return outside;
    for (int k = 0; k < kBisections && !std::isfinite(seen.at(outside).value); ++k) {
      const double middle = 0.5 * (inside + outside);
      const ProfilePoint at = profile_at(middle);
      seen.emplace(middle, at);
      (at.value >= peak - kEvidenceDrop ? inside : outside) = middle;
    }
    // If the problem cannot be solved outside, the data do not bound the range there.
    bounded = std::isfinite(seen.at(outside).value);
    return bounded ? crossing(inside, seen.at(inside), outside, seen.at(outside), peak - kEvidenceDrop) : inside;
  };
  FlatRange range;
  range.from = edge(-1, range.bounded_below);
  range.to = edge(1, range.bounded_above);
  return range;
}

}  // namespace tandem::detail

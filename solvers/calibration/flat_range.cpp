#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Eigenvalues>

#include <tandem/solvers/calibration/flat_range.hpp>

namespace tandem::detail {
namespace {

constexpr double kLevel = 0.05;  // of the log evidence, by which it changes as a factor does by e
constexpr int kMiddles = 3;      // tried towards a point where it is no number

/// Where between two points the cubic through their values and slopes falls to a level.
double crossing(double inside, const Along& a, double outside, const Along& b, double level) {
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

FlatRange flat_range(double from, const Along& here, double first_reach, double bound,
                     FunctionRef<Along(double)> elsewhere) {
  std::map<double, Along> seen{{from, here}};
  // A prior may have kept the factor from where the data have their most: both ways until they fall below that.
  double most = here.value;
  for (const double direction : {-1.0, 1.0}) {
    Along at{most, -HUGE_VAL};
    double x = from;
    const double end = std::clamp(from + direction * kWidest, -bound, bound);
    for (double reach = first_reach; x != end && at.value >= most - kFall && !(std::abs(at.slope) < kLevel);
         reach = std::min(3 * reach, reach + 1)) {
      x = direction * std::min(direction * (from + direction * reach), direction * end);
      at = elsewhere(x);
      seen.emplace(x, at);
      most = std::max(most, at.value);
    }
  }
  if (std::abs(from) > kWidest) seen.emplace(0.0, elsewhere(0.0));  // whether it excludes what was given
  const auto edge = [&](double direction, bool& told) {
    const auto best =
        std::max_element(seen.begin(), seen.end(), [](auto& a, auto& b) { return a.second.value < b.second.value; });
    double inside = best->first, outside = direction * HUGE_VAL;
    for (const auto& [x, at] : seen) {
      if ((x - best->first) * direction <= 0) continue;
      if (at.value >= most - kFall) {
        if ((x - inside) * direction > 0) inside = x;
      } else if ((outside - x) * direction > 0) {
        outside = x;
      }
    }
    told = false;
    if (!std::isfinite(outside)) return outside;
    for (int k = 0; k < kMiddles && !std::isfinite(seen.at(outside).value); ++k) {
      const double middle = 0.5 * (inside + outside);
      const Along at = elsewhere(middle);
      seen.emplace(middle, at);
      (at.value >= most - kFall ? inside : outside) = middle;
    }
    // Where evidence ends, no datum has ended the range: it is as far as there was any.
    told = std::isfinite(seen.at(outside).value);
    return told ? crossing(inside, seen.at(inside), outside, seen.at(outside), most - kFall) : inside;
  };
  FlatRange range;
  range.from = edge(-1, range.told_below);
  range.to = edge(1, range.told_above);
  return range;
}

Eigen::MatrixXd covariance_within(const Eigen::VectorXd& before, const Eigen::MatrixXd& curvature) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(before.asDiagonal() * curvature * before.asDiagonal());
  const Eigen::VectorXd spread = eigen.eigenvalues().cwiseMax(1).cwiseInverse();
  return before.asDiagonal() * eigen.eigenvectors() * spread.asDiagonal() * eigen.eigenvectors().transpose() *
         before.asDiagonal();
}

}  // namespace tandem::detail

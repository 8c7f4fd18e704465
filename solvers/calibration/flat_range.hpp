#pragma once

#include <algorithm>
#include <cmath>

#include <tandem/problem/function_ref.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>

namespace tandem::detail {

inline constexpr double kFall = 2.0;  // of the log evidence, beyond which a factor is told from another (95 %, χ²/2)
inline constexpr double kWidest = 2.31;  // of a logarithm: what is told to a factor of 10 either way at worst, is told

/// The log evidence along one factor's logarithm, and its slope there; −∞ where it is no number.
struct Along {
  double value, slope;
};

/// Between which logarithms of a factor the data speak no clearer than kFall against it.
struct FlatRange {
  double from, to;              ///< infinite where nothing ends it near enough to tell anything, or it has become level
  bool told_below, told_above;  ///< it ends there by the data; not where there is no evidence beyond

  /// Into what is told of a factor whose logarithm is `at`.
  void tell(CalibratedNoise& noise, double at) const {
    noise.flat_from = std::exp(std::max(from, at - kWidest));
    noise.flat_to = std::exp(std::min(to, at + kWidest));
    noise.determined = told_below && told_above;
    noise.bounded = !noise.determined && ((told_below && from > 0) || (told_above && to < 0));
  }
};

/// Looked for from `from` on, with `here`, in strides that begin with `first_reach`; `bound`: the largest logarithm either way.
FlatRange flat_range(double from, const Along& here, double first_reach, double bound,
                     FunctionRef<Along(double)> elsewhere);

/// Whether the data tell a logarithm at least as well as what was known before, of this standard deviation (0: nothing), by
/// their own part in its curvature. What they tell less of is for its prior to say, unless their evidence falls either way.
inline bool is_told(double data_curvature, double prior) {
  const double before = prior > 0 ? std::min(prior, kWidest) : kWidest;
  return data_curvature * before * before >= 1;
}

/// The inverse of a curvature in units of what was known `before`, standard deviations, in which data do not take away: a
/// direction along which they seem to, by what Laplace's approximation leaves out, is as wide as before.
Eigen::MatrixXd covariance_within(const Eigen::VectorXd& before, const Eigen::MatrixXd& curvature);

}  // namespace tandem::detail

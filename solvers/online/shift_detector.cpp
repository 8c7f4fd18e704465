#include <algorithm>
#include <cmath>

#include <tandem/solvers/online/shift_detector.hpp>

namespace tandem::detail {
namespace {

constexpr std::array<double, 6> kShifts = {1, -1, 2, -2, 4, -4};  // standard deviations
/// Log-likelihood ratio of a significant shift. White innovations exceed it once in e¹⁶ = 9 million measurements.
constexpr double kSignificant = 16;
constexpr double kMost = 2 * kSignificant;  // so that the end of a long shift is seen, too
constexpr double kPrior = 10;               // measurements with the stated noise that count beside the earlier ones
constexpr double kLargest = 5;              // standard deviations; larger innovations count as this

/// Mean, standard deviation and lag-1 correlation of the usual innovations.
struct Usual {
  double mean, sigma, correlation;
};

Usual usual_innovations(const ResidualMoments& m) {
  const double n = kPrior + double(m.n), mean = m.sum / n;
  const double variance = std::max((kPrior + m.squares) / n - mean * mean, 1e-3);
  return {mean, std::sqrt(std::max(1.0, variance)), std::clamp((m.products / n - mean * mean) / variance, 0.0, 0.95)};
}

}  // namespace

std::optional<InnovationShift> ShiftDetector::add(double t, const Eigen::VectorXd& standardised,
                                                  const std::vector<ResidualMoments>& usual) {
  sums_.resize(std::max(sums_.size(), std::size_t(standardised.size())));
  const bool was_shifted = shifted_;
  shifted_ = false;
  std::optional<InnovationShift> largest;
  double most = kSignificant;
  for (std::size_t c = 0; c < std::size_t(standardised.size()); ++c) {
    const Usual u = usual_innovations(c < usual.size() ? usual[c] : ResidualMoments());
    const double e = (std::clamp(standardised[Eigen::Index(c)], -kLargest, kLargest) - u.mean) / u.sigma;
    const double share = (1 - u.correlation) / (1 + u.correlation);  // of independent measurements
    for (std::size_t i = 0; i < kShifts.size(); ++i) {
      Sum& sum = sums_[c][i];
      if (sum.evidence == 0) sum = {.since = t};
      sum.evidence += share * kShifts[i] * (e - kShifts[i] / 2);
      sum.evidence = std::clamp(sum.evidence, 0.0, kMost);
      sum.total += e;
      ++sum.n;
      if (!(sum.evidence > most)) continue;
      most = sum.evidence;
      largest = InnovationShift{c, sum.since, sum.total / double(sum.n)};
    }
  }
  shifted_ = largest.has_value();
  return was_shifted ? std::nullopt : largest;
}

}  // namespace tandem::detail

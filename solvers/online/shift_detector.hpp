#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <tandem/lie/types.hpp>
#include <tandem/solvers/residual_series.hpp>

namespace tandem {

/// A change of the mean innovation of one component of a sensor, which the gate does not reject.
struct InnovationShift {
  std::size_t component;
  double since;  ///< first measurement of the shift [s]
  double mean;   ///< mean innovation since then, minus the sensor's usual mean [standard deviations]
};

namespace detail {

/// Detects shifts of standardised innovations: a two-sided CUSUM test (Page 1954) for each component and for shifts of
/// 1, 2 and 4 standard deviations. The test compares with the sensor's own mean, standard deviation and lag-1
/// correlation up to then, so that systematic errors do not trigger it.
class ShiftDetector {
 public:
  /// Processes the standardised innovation of a measurement at time t [s]. `usual`: moments of the earlier ones, by
  /// component. Returns a shift once, when it becomes significant.
  std::optional<InnovationShift> add(double t, const Eigen::VectorXd& standardised,
                                     const std::vector<ResidualMoments>& usual);
  /// Returns whether a significant shift lasts.
  bool is_shifted() const { return shifted_; }
  /// Forgets all innovations. Called when the estimate or the reference changes.
  void clear() { *this = {}; }

 private:
  /// A cumulated sum for one signed shift.
  struct Sum {
    double evidence = 0;  ///< log-likelihood ratio of the shift
    double since = 0;     ///< s
    double total = 0;     ///< of the innovations since then
    std::size_t n = 0;
  };
  std::vector<std::array<Sum, 6>> sums_;  // by component
  bool shifted_ = false;
};

}  // namespace detail
}  // namespace tandem

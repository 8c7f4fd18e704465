#pragma once

#include <cstddef>
#include <vector>

namespace tandem {

/// Standardised residuals of one component of a sensor: each is divided by its expected standard deviation at the
/// solution. A correct model gives independent values with mean 0 and standard deviation 1.
struct ResidualSeries {
  static constexpr double kMaxCorrelation = 0.3;  ///< largest lag-1 correlation that counts as white

  std::vector<double> t, value;  ///< times [s] and values, in time order after sort()

  void add(double time, double standardised) {
    t.push_back(time);
    value.push_back(standardised);
  }
  void sort();  ///< by time

  double mean() const;
  double standard_deviation() const;  ///< About the mean.
  double rms() const;                 ///< Root mean square.
  double correlation() const;         ///< Autocorrelation at lag 1.
  double spacing() const;             ///< Median time between successive values [s].
  /// Returns the correlation time τ [s] from correlation() = exp(−spacing / τ), or 0 if the correlation is at most
  /// kMaxCorrelation or three standard errors.
  double correlation_time() const;
  bool has_significant_mean() const;  ///< more than three standard errors, given the correlation
};

/// Moments of standardised residuals that are not stored, in the order in which they are added.
struct ResidualMoments {
  std::size_t n = 0;
  double sum = 0, squares = 0, products = 0;  ///< sums of the values, their squares, and products of successive values
  double first = 0, last = 0;                 ///< first and last value

  void add(double standardised);
  // As those of ResidualSeries.
  double mean() const;
  double standard_deviation() const;
  double rms() const;
  double correlation() const;
};

/// A measurement and its largest standardised residual.
struct WorstMeasurement {
  double t;               ///< s
  std::size_t component;  ///< component of the sensor
  double residual;        ///< residual in expected standard deviations
};

}  // namespace tandem

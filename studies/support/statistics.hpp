#pragma once

#include <optional>
#include <vector>

namespace tandem {

/// A number with its 95 % confidence interval.
struct Interval {
  double value = 0, low = 0, high = 0;
  std::size_t n = 0;  ///< samples
};

/// Return the p-quantile, 0 < p < 1, of the standard normal distribution, of Student's t and of χ², the last two with
/// `degrees` > 0 degrees of freedom. Throw std::domain_error for other arguments.
double normal_quantile(double p);
double student_t_quantile(double degrees, double p);
double chi_squared_quantile(double degrees, double p);

/// Returns the interval of the mean of independent samples from Student's t, or nothing for fewer than 2 samples.
std::optional<Interval> mean_interval(const std::vector<double>& samples);

/// Returns the interval of the ratio mean(b)/mean(a) of paired samples, from Student's t on the residuals b − ratio·a.
/// Variation that both samples of a pair share cancels. Returns nothing for fewer than 2 pairs, for different sizes, or
/// if mean(a) is zero. Source: Cochran 1977, "Sampling Techniques", §6.4.
std::optional<Interval> ratio_interval(const std::vector<double>& a, const std::vector<double>& b);

/// Returns Wilson's score interval of the proportion k/n, or nothing for n = 0. Source: Wilson 1927.
std::optional<Interval> share_interval(std::size_t k, std::size_t n);

}  // namespace tandem

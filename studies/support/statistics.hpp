#pragma once

#include <optional>
#include <vector>

namespace tandem {

/// A number with its 95 % confidence interval.
struct Interval {
  double value = 0, low = 0, high = 0;
  std::size_t n = 0;  ///< samples
};

/// The point that Student's t with so many degrees of freedom is below with a probability of 0.975.
/// Source: Hill 1970, "Algorithm 396: Student's t-quantiles", to 1e-4 of it.
double t_quantile_975(std::size_t degrees);

/// Of the mean of independent samples, two or more, by Student's t.
std::optional<Interval> mean_interval(const std::vector<double>& samples);

/// Of the ratio of the means of pairs, mean(b)/mean(a), two pairs or more: by Student's t on the residuals b −
/// ratio·a, which is what pairing gains. Nothing where a's mean is zero. Source: Cochran 1977, "Sampling Techniques",
/// §6.4.
std::optional<Interval> ratio_interval(const std::vector<double>& a, const std::vector<double>& b);

/// Of a share, k of n: Wilson's score interval (Wilson 1927). Nothing for n = 0.
std::optional<Interval> share_interval(std::size_t k, std::size_t n);

}  // namespace tandem

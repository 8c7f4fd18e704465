#include <algorithm>
#include <cmath>
#include <numeric>

#include <tandem/problem/quantile.hpp>
#include <tandem/solvers/residual_series.hpp>

namespace tandem {
namespace {

constexpr double kMinMean = 0.3;  // smallest mean that matters, in standard deviations
constexpr std::size_t kMinCount = 10;

}  // namespace

void ResidualSeries::sort() {
  std::vector<std::size_t> order(t.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) { return t[a] < t[b]; });
  ResidualSeries sorted;
  for (const std::size_t i : order) sorted.add(t[i], value[i]);
  std::swap(t, sorted.t);
  std::swap(value, sorted.value);
}

double ResidualSeries::mean() const {
  return value.empty() ? 0 : std::accumulate(value.begin(), value.end(), 0.0) / double(value.size());
}

double ResidualSeries::standard_deviation() const {
  const double mean = this->mean();
  double sum = 0;
  for (const double x : value) sum += (x - mean) * (x - mean);
  return value.empty() ? 0 : std::sqrt(sum / double(value.size()));
}

double ResidualSeries::rms() const { return std::hypot(mean(), standard_deviation()); }

double ResidualSeries::correlation() const {
  const double mean = this->mean(), sigma = standard_deviation();
  if (value.size() < 3 || !(sigma > 0)) return 0;
  double sum = 0;
  for (std::size_t i = 1; i < value.size(); ++i) sum += (value[i] - mean) * (value[i - 1] - mean);
  return sum / double(value.size() - 1) / (sigma * sigma);
}

double ResidualSeries::spacing() const { return detail::median_step(t); }

double ResidualSeries::correlation_time() const {
  const double rho = correlation();
  if (value.size() < kMinCount || rho < std::max(kMaxCorrelation, 3 / std::sqrt(double(value.size())))) return 0;
  return -spacing() / std::log(std::min(rho, 0.999));
}

bool ResidualSeries::has_significant_mean() const {
  if (value.size() < kMinCount) return false;
  const double rho = std::clamp(correlation(), 0.0, 0.99);
  const double error = standard_deviation() * std::sqrt((1 + rho) / (1 - rho) / double(value.size()));
  return std::abs(mean()) > std::max(kMinMean, 3 * error);
}

void ResidualMoments::add(double standardised) {
  if (n > 0) products += last * standardised;
  if (n++ == 0) first = standardised;
  sum += standardised;
  squares += standardised * standardised;
  last = standardised;
}

double ResidualMoments::mean() const { return n > 0 ? sum / double(n) : 0; }

double ResidualMoments::rms() const { return n > 0 ? std::sqrt(squares / double(n)) : 0; }

double ResidualMoments::standard_deviation() const {
  return n > 0 ? std::sqrt(std::max(0.0, squares / double(n) - mean() * mean())) : 0;
}

double ResidualMoments::correlation() const {
  const double m = mean(), sigma = standard_deviation();
  if (n < 3 || !(sigma > 0)) return 0;
  const double pairs = double(n - 1);
  return (products - m * (2 * sum - first - last) + pairs * m * m) / pairs / (sigma * sigma);
}

}  // namespace tandem

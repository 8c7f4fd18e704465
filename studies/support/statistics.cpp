#include <algorithm>
#include <cmath>
#include <numbers>

#include <tandem/studies/support/statistics.hpp>

namespace tandem {
namespace {

constexpr double kNormal975 = 1.959963984540054;

double mean_of(const std::vector<double>& x) {
  double sum = 0;
  for (const double v : x) sum += v;
  return sum / double(x.size());
}

}  // namespace

double t_quantile_975(std::size_t degrees) {
  const double n = double(degrees), p = 0.05;  // both tails
  if (degrees == 1) return std::tan(0.475 * std::numbers::pi);
  if (degrees == 2) return std::sqrt(2 / (p * (2 - p)) - 2);
  const double a = 1 / (n - 0.5), b = 48 / (a * a);
  double c = ((20700 * a / b - 98) * a - 16) * a + 96.36;
  const double d = ((94.5 / (b + c) - 3) / b + 1) * std::sqrt(a * std::numbers::pi / 2) * n;
  double y = std::pow(d * p, 2 / n);
  if (y > 0.05 + a) {
    const double x = -kNormal975;
    y = x * x;
    if (degrees < 5) c += 0.3 * (n - 4.5) * (x + 0.6);
    c = (((0.05 * d * x - 5) * x - 7) * x - 2) * x + b + c;
    y = (((((0.4 * y + 6.3) * y + 36) * y + 94.5) / c - y - 3) / b + 1) * x;
    y = a * y * y;
    y = std::expm1(y);
  } else {
    y = ((1 / (((n + 6) / (n * y) - 0.089 * d - 0.822) * (n + 2) * 3) + 0.5 / (n + 4)) * y - 1) * (n + 1) / (n + 2) +
        1 / y;
  }
  return std::sqrt(n * y);
}

std::optional<Interval> mean_interval(const std::vector<double>& samples) {
  const std::size_t n = samples.size();
  if (n < 2) return {};
  const double mean = mean_of(samples);
  double squares = 0;
  for (const double x : samples) squares += (x - mean) * (x - mean);
  const double half = t_quantile_975(n - 1) * std::sqrt(squares / double(n - 1) / double(n));
  return Interval{mean, mean - half, mean + half, n};
}

std::optional<Interval> ratio_interval(const std::vector<double>& a, const std::vector<double>& b) {
  const std::size_t n = a.size();
  if (n < 2 || b.size() != n) return {};
  const double mean_a = mean_of(a);
  if (mean_a == 0) return {};
  const double ratio = mean_of(b) / mean_a;
  double squares = 0;
  for (std::size_t i = 0; i < n; ++i) squares += (b[i] - ratio * a[i]) * (b[i] - ratio * a[i]);
  const double half = t_quantile_975(n - 1) * std::sqrt(squares / double(n - 1) / double(n)) / std::abs(mean_a);
  return Interval{ratio, ratio - half, ratio + half, n};
}

std::optional<Interval> share_interval(std::size_t k, std::size_t n) {
  if (n == 0) return {};
  const double z2 = kNormal975 * kNormal975, m = double(n), share = double(k) / m;
  const double middle = (share + z2 / (2 * m)) / (1 + z2 / m);
  const double half = kNormal975 / (1 + z2 / m) * std::sqrt(share * (1 - share) / m + z2 / (4 * m * m));
  return Interval{share, std::max(0.0, middle - half), std::min(1.0, middle + half), n};
}

}  // namespace tandem

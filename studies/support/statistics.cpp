#include <algorithm>
#include <cmath>

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

#include <tandem/studies/support/statistics.hpp>

namespace tandem {
namespace {

constexpr double kUpper = 0.975;  // upper quantile of a two-sided 95 % interval

double mean_of(const std::vector<double>& x) {
  double sum = 0;
  for (const double v : x) sum += v;
  return sum / double(x.size());
}

}  // namespace

double normal_quantile(double p) { return boost::math::quantile(boost::math::normal(), p); }

double student_t_quantile(double degrees, double p) {
  return boost::math::quantile(boost::math::students_t(degrees), p);
}

double chi_squared_quantile(double degrees, double p) {
  return boost::math::quantile(boost::math::chi_squared(degrees), p);
}

std::optional<Interval> mean_interval(const std::vector<double>& samples) {
  const std::size_t n = samples.size();
  if (n < 2) return {};
  const double mean = mean_of(samples);
  double squares = 0;
  for (const double x : samples) squares += (x - mean) * (x - mean);
  const double half = student_t_quantile(double(n - 1), kUpper) * std::sqrt(squares / double(n - 1) / double(n));
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
  const double half =
      student_t_quantile(double(n - 1), kUpper) * std::sqrt(squares / double(n - 1) / double(n)) / std::abs(mean_a);
  return Interval{ratio, ratio - half, ratio + half, n};
}

std::optional<Interval> share_interval(std::size_t k, std::size_t n) {
  if (n == 0) return {};
  const double z = normal_quantile(kUpper), z2 = z * z, m = double(n), share = double(k) / m;
  const double middle = (share + z2 / (2 * m)) / (1 + z2 / m);
  const double half = z / (1 + z2 / m) * std::sqrt(share * (1 - share) / m + z2 / (4 * m * m));
  return Interval{share, std::max(0.0, middle - half), std::min(1.0, middle + half), n};
}

}  // namespace tandem

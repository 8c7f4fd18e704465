#include <algorithm>
#include <map>
#include <utility>

#include <tandem/problem/quantile.hpp>
#include <tandem/studies/support/mahalanobis.hpp>
#include <tandem/studies/support/statistics.hpp>
#include <tandem/studies/tuning/contradicting_measurements.hpp>

namespace tandem {
namespace {

constexpr double kContradictingSigmas = 10;  // as for outliers()

}  // namespace

int count_contradicting_measurements(CalibrationProblem& built) {
  Problem& problem = built.problem();
  std::map<std::pair<std::size_t, int>, std::vector<double>> squares;  // by entry and rows
  for (const EntryBlock& b : built.blocks) {
    if (!b.measured_at || problem.loss(b.block).kind == Loss::Kind::none) continue;
    const Eigen::VectorXd residual = problem.linearization(b.block).residual;
    squares[{b.entry, static_cast<int>(residual.size())}].push_back(
        squared_distance(residual, problem.noise(b.block).covariance_matrix()));
  }
  auto count = static_cast<std::ptrdiff_t>(built.num_gross_outliers);
  for (const auto& [entry, values] : squares) {
    const double scale = std::max(1.0, detail::median(values) / chi_squared_quantile(entry.second, 0.5));
    count += std::count_if(values.begin(), values.end(),
                           [&](double square) { return square > scale * kContradictingSigmas * kContradictingSigmas; });
  }
  return static_cast<int>(count);
}

}  // namespace tandem

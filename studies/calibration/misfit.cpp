#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include <tandem/problem/quantile.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/studies/calibration/misfit.hpp>
#include <tandem/studies/support/downweighting.hpp>

namespace tandem {
namespace {

constexpr double kMinVarianceShare = 0.05;  // smallest remaining share of the noise variance: states absorb the rest
constexpr double kMinMean = 0.3;            // smallest mean that matters, in standard deviations
constexpr double kMinCorrelation = 0.3;
constexpr std::size_t kMinCount = 10;

double variance_about_mean(const Misfit& m) {
  const double mean = m.mean();
  double sum = 0;
  for (const double x : m.value) sum += (x - mean) * (x - mean);
  return m.value.empty() ? 0 : sum / double(m.value.size());
}

}  // namespace

double Misfit::mean() const {
  return value.empty() ? 0 : std::accumulate(value.begin(), value.end(), 0.0) / double(value.size());
}
double Misfit::spread() const { return std::sqrt(variance_about_mean(*this)); }
double Misfit::correlation() const {
  const double mean = this->mean(), variance = variance_about_mean(*this);
  if (value.size() < 3 || !(variance > 0)) return 0;
  double sum = 0;
  for (std::size_t i = 1; i < value.size(); ++i) sum += (value[i] - mean) * (value[i - 1] - mean);
  return sum / double(value.size() - 1) / variance;
}
double Misfit::spacing() const { return detail::median_step(t); }
double Misfit::correlation_time() const {
  const double rho = correlation();
  if (value.size() < kMinCount || rho < std::max(kMinCorrelation, 3 / std::sqrt(double(value.size())))) return 0;
  return -spacing() / std::log(std::min(rho, 0.999));
}
bool Misfit::has_significant_mean() const {
  if (value.size() < kMinCount) return false;
  const double rho = std::clamp(correlation(), 0.0, 0.99);
  const double error = spread() * std::sqrt((1 + rho) / (1 - rho) / double(value.size()));
  return std::abs(mean()) > std::max(kMinMean, 3 * error);
}

std::string Misfit::diagnosis() const {
  const bool range = component == "range";
  const double tau = correlation_time();
  std::string text;
  if (has_significant_mean())
    text = fmt::format("has a mean of {:+.2g} standard deviations; possible cause: {}", mean(),
                       range   ? "a bias or scale factor error of the range (sound speed)"
                       : angle ? "a mounting misalignment"
                               : "a bias, or a wrong position of the sensor or of the observed point");
  if (tau > 0)
    text += fmt::format(
        "{}has time-correlated errors (correlation time {:.2g} s, lag-1 correlation {:.2f}); possible "
        "cause: {}",
        text.empty() ? "" : "; it ", tau, correlation(),
        angle ? "a drifting misalignment, or a delay" : "a drifting bias, or a delay");
  return text.empty() ? text : parameter + " " + text;
}

std::vector<Autocorrelation> autocorrelations(const std::vector<Misfit>& misfits, std::size_t lags) {
  std::vector<Autocorrelation> all;
  for (const Misfit& first : misfits) {
    if (std::any_of(all.begin(), all.end(), [&](const Autocorrelation& a) { return a.parameter == first.parameter; }))
      continue;
    Autocorrelation& of = all.emplace_back(Autocorrelation{first.parameter, {}});
    for (std::size_t lag = 0; lag <= lags; ++lag) {
      std::size_t pairs = 0;
      double products = 0, squares = 0;
      for (const Misfit& m : misfits) {
        if (m.parameter != first.parameter) continue;
        const double mean = m.mean(), variance = variance_about_mean(m);
        for (std::size_t i = lag; i < m.value.size(); ++i) {
          products += (m.value[i] - mean) * (m.value[i - lag] - mean);
          squares += variance;
          ++pairs;
        }
      }
      if (pairs < kMinCount || !(squares > 0)) break;
      of.values.push_back(products / squares);
    }
  }
  return all;
}

std::vector<Misfit> misfits(CalibrationProblem& built, const Stop& stop) {
  Problem& problem = built.problem();
  const Marginals marginals(problem, {}, stop);
  std::map<std::pair<std::size_t, std::size_t>, Misfit> found;  // by entry and component
  for (const EntryBlock& b : built.blocks) {
    if (!b.measured_at || !b.primary) continue;
    stop.check("misfits");
    const CalibratedEntry& entry = built.entries[b.entry];
    const Problem::Linearization at = problem.linearization(b.block);
    const Eigen::MatrixXd noise = problem.noise(b.block).covariance_matrix();
    const Eigen::MatrixXd by_states = at.jacobian * marginals.joint(at.variable_ids, at.dofs);
    const Eigen::MatrixXd taken = by_states * at.jacobian.transpose();
    const bool counts = problem.weight(b.block) >= kDownweightThreshold;
    for (std::size_t c = 0; c < entry.components.size(); ++c) {
      const int i = entry.row[c] - b.first;
      if (i < 0 || i >= at.residual.size()) continue;
      Misfit& m = found[{b.entry, c}];
      if (m.parameter.empty()) {
        m.scenario = built.scenario;
        m.parameter = entry.parameter(c);
        m.component = entry.components[c].empty() ? entry.kind : entry.components[c];
        m.angle = entry.angle[c];
      }
      if (!counts) {
        ++m.down_weighted;
        continue;
      }
      const double variance = noise(i, i) - taken(i, i);
      if (!(variance > kMinVarianceShare * noise(i, i))) continue;
      m.t.push_back(*b.measured_at);
      m.value.push_back(at.residual[i] / std::sqrt(variance));
    }
  }
  std::vector<Misfit> all;
  for (const auto& entry : found) {
    const Misfit& m = entry.second;
    std::vector<std::size_t> order(m.t.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return m.t[a] < m.t[b]; });
    Misfit sorted = m;
    for (std::size_t i = 0; i < order.size(); ++i) {
      sorted.t[i] = m.t[order[i]];
      sorted.value[i] = m.value[order[i]];
    }
    all.push_back(std::move(sorted));
  }
  return all;
}

}  // namespace tandem

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include <tandem/problem/median.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/studies/calibration/misfit.hpp>
#include <tandem/studies/support/down_weighted.hpp>

namespace tandem {
namespace {

constexpr double kLeast = 0.05;  // share of its noise's variance, below which a residual says nothing: states follow it
constexpr double kMean = 0.3;    // sigmas, below which a mean does no harm worth a term of its own
constexpr double kCorrelation = 0.3;
constexpr std::size_t kFewest = 10;

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
  if (value.size() < kFewest || rho < std::max(kCorrelation, 3 / std::sqrt(double(value.size())))) return 0;
  return -spacing() / std::log(std::min(rho, 0.999));
}
bool Misfit::mean_is_off() const {
  if (value.size() < kFewest) return false;
  const double rho = std::clamp(correlation(), 0.0, 0.99);
  const double error = spread() * std::sqrt((1 + rho) / (1 - rho) / double(value.size()));
  return std::abs(mean()) > std::max(kMean, 3 * error);
}

std::string Misfit::diagnosis() const {
  const bool range = component == "range";
  const double tau = correlation_time();
  std::string text;
  if (mean_is_off())
    text = fmt::format("is off by {:+.2g} sigmas on average: {} would explain it", mean(),
                       range   ? "a bias or a scale of the range (the sound speed)"
                       : angle ? "a mounting misalignment"
                               : "a bias, or another place of the sensor or of what it sees");
  if (tau > 0)
    text += fmt::format("{}has errors that stay for {:.2g} s (neighbours correlate by {:.2f}): {} would explain them",
                        text.empty() ? "" : "; ", tau, correlation(),
                        angle ? "a misalignment that drifts, or a delay" : "a bias that drifts, or a delay");
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
      if (pairs < kFewest || !(squares > 0)) break;
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
    if (!b.measured_at || !b.whole) continue;
    stop.check("misfits");
    const CalibratedEntry& entry = built.entries[b.entry];
    const Problem::Linearization at = problem.linearization(b.block);
    const Eigen::MatrixXd noise = problem.noise(b.block).covariance_matrix();
    const Eigen::MatrixXd by_states = at.jacobian * marginals.joint(at.variable_ids, at.dofs);
    const Eigen::MatrixXd taken = by_states * at.jacobian.transpose();
    const bool counts = problem.weight(b.block) >= kDownWeighted;
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
      if (!(variance > kLeast * noise(i, i))) continue;
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

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include <tandem/solvers/fit_report.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/studies/calibration/misfit.hpp>

namespace tandem {
namespace {

constexpr double kMinVarianceShare = 0.05;  // minimum share of the noise variance that is left in a residual
constexpr std::size_t kMinCount = 10;

}  // namespace

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
        const double mean = m.mean(), variance = m.standard_deviation() * m.standard_deviation();
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
  const Marginals marginals = Marginals::without_gauges(problem, stop);
  std::map<std::pair<std::size_t, std::size_t>, Misfit> found;  // key: index of the entry, index of the component
  for (const EntryBlock& b : built.blocks) {
    if (!b.measured_at || !b.primary) continue;
    stop.check("misfits");
    const CalibratedEntry& entry = built.entries[b.entry];
    const Problem::Linearization at = problem.linearization(b.block);
    const Eigen::MatrixXd noise = problem.noise(b.block).covariance_matrix();
    const Eigen::MatrixXd taken = marginals.propagated(at.jacobian, at.variable_ids, at.dofs);
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
      m.add(*b.measured_at, at.residual[i] / std::sqrt(variance));
    }
  }
  std::vector<Misfit> all;
  for (auto& [key, m] : found) all.emplace_back(std::move(m)).sort();
  return all;
}

}  // namespace tandem

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include <tandem/problem/all_blocks.hpp>
#include <tandem/solvers/fit_report.hpp>

namespace tandem {
namespace {

constexpr double kMaxRms = 2;
constexpr double kMaxContested = 0.1;
constexpr double kGenerous = 0.7;           // share of the expected cost, below which the stated noise is too large
constexpr double kFarTooLarge = 0.25;       // share of the expected cost, below which the report is not informative
constexpr double kOversized = 2;            // factor from which a noise is named as too large
constexpr double kMinVarianceShare = 0.05;  // minimum share of the noise variance that is left in a residual
constexpr std::size_t kWorst = 5;

std::string text(const char* format, double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

/// Cost of a problem and its expectation under the stated noise, before the unknowns take their share.
struct CostSum {
  double cost = 0, expected = 0;
  int rows = 0;

  /// Adds a soft block if a free variable moves one of its rows.
  void add(const Problem& problem, const Block& block, detail::LossExpectations& expectations) {
    const Problem::Linearization at = problem.linearization(block);
    const Gaussian noise = problem.noise(block);
    const Loss loss = problem.loss(block);
    cost += 0.5 * loss((noise.sqrt_information() * at.residual).squaredNorm()).rho;
    int moved = 0;
    for (Eigen::Index row = 0; row < at.residual.size(); ++row) {
      Eigen::Index column = 0;
      bool moves = false;
      for (std::size_t i = 0; i < at.dofs.size(); column += at.dofs[i++])
        moves |= !problem.is_fixed(at.variable_ids[i]) && !at.jacobian.row(row).segment(column, at.dofs[i]).isZero(0);
      moved += moves;
    }
    rows += moved;
    if (moved > 0) expected += expectations(loss, moved).half_rho;
  }
};

/// Returns the free unknowns minus the rows of the constraints that are active.
int free_unknowns(const Problem& problem, const std::vector<Block>& soft) {
  std::set<int> not_hard;
  for (const Block& block : soft) not_hard.insert(block.pool);
  if (const auto prior = problem.marginal_prior()) not_hard.insert(prior->pool);
  int active = 0;
  for (const Block& block : problem.blocks())
    if (!not_hard.contains(block.pool)) active += int((problem.multipliers(block).array() != 0).count());
  const Problem::Size size = problem.size();
  return size.unknowns - std::max(active, size.equalities);
}

/// Returns the expected variances of the block's residuals at the solution.
Eigen::VectorXd residual_variances(const Problem::Linearization& at, const Eigen::VectorXd& noise,
                                   const Marginals* marginals, double remaining) {
  if (!marginals) return remaining * noise;
  return noise - marginals->propagated(at.jacobian, at.variable_ids, at.dofs).diagonal();
}

/// Adds a block to the fit of its sensor. `counted` is true if an earlier part of the measurement is down-weighted.
void add(const Problem& problem, const MeasurementBlock& m, const Marginals* marginals, double remaining,
         SensorFit& fit, bool& counted, detail::LossExpectations& expectations) {
  const Problem::Linearization at = problem.linearization(m.block);
  const Eigen::VectorXd noise = problem.noise(m.block).covariance_matrix().diagonal();
  const Eigen::VectorXd variances = residual_variances(at, noise, marginals, remaining);
  const bool down_weighted = problem.weight(m.block) < kDownweightThreshold;
  if (m.first == 0) {
    ++fit.used;
    counted = false;
  }
  if (down_weighted && !counted) ++fit.down_weighted;
  counted |= down_weighted;
  fit.expected_down_weighted += expectations(problem.loss(m.block), int(at.residual.size())).down_weighted;
  WorstMeasurement worst{m.t, 0, 0};
  for (Eigen::Index i = 0; i < at.residual.size(); ++i) {
    if (!(variances[i] > kMinVarianceShare * noise[i])) continue;
    const double standardised = at.residual[i] / std::sqrt(variances[i]);
    const std::size_t component = std::size_t(m.first + i);
    (down_weighted ? fit.down_weighted_series : fit.series)[component].add(m.t, standardised);
    if (std::abs(standardised) > std::abs(worst.residual)) worst = {m.t, component, standardised};
  }
  fit.worst.push_back(worst);
}

/// Squared residuals of the blocks with one noise, and their expectations, by row.
struct NoiseSum {
  std::string name;
  std::vector<double> squares, expected;

  void add(const Problem& problem, const Block& block, const Marginals* marginals, double remaining) {
    const Problem::Linearization at = problem.linearization(block);
    if (problem.weight(block) < kDownweightThreshold) return;
    const Eigen::VectorXd noise = problem.noise(block).covariance_matrix().diagonal();
    const Eigen::VectorXd variances = residual_variances(at, noise, marginals, remaining);
    const std::size_t rows = std::size_t(noise.size());
    squares.resize(std::max(squares.size(), rows));
    expected.resize(squares.size());
    for (Eigen::Index i = 0; i < noise.size(); ++i) {
      if (!(variances[i] > kMinVarianceShare * noise[i])) continue;
      squares[std::size_t(i)] += at.residual[i] * at.residual[i] / noise[i];
      expected[std::size_t(i)] += variances[i] / noise[i];
    }
  }
  NoiseFit fit() const {
    NoiseFit fit{name, {}};
    for (std::size_t i = 0; i < squares.size(); ++i)
      if (expected[i] > 0) fit.rms.push_back(std::sqrt(squares[i] / expected[i]));
    return fit;
  }
};

std::vector<NoiseFit> noise_fits(const Problem& problem, std::span<const NoiseOfBlock> noises,
                                 const Marginals* marginals, double remaining) {
  std::vector<NoiseSum> sums;
  for (const NoiseOfBlock& b : noises) {
    auto sum = std::find_if(sums.begin(), sums.end(), [&](const NoiseSum& s) { return s.name == b.noise; });
    if (sum == sums.end()) sum = sums.insert(sum, NoiseSum{b.noise, {}, {}});
    sum->add(problem, b.block, marginals, remaining);
  }
  std::vector<NoiseFit> fits;
  for (const NoiseSum& sum : sums) fits.push_back(sum.fit());
  return fits;
}

/// Returns "12", or "3 to 12" for different rows, the factors by which a noise is too large. Returns an empty string if
/// none reaches kOversized.
std::string oversize(const std::vector<double>& rms) {
  constexpr double kUnknown = 1e3;  // larger factors follow from residuals that are exact
  double least = kUnknown, most = 0;
  for (const double r : rms) {
    const double factor = r > 1 / kUnknown ? 1 / r : kUnknown;
    if (factor < kOversized) continue;
    least = std::min(least, factor);
    most = std::max(most, factor);
  }
  if (most == 0) return "";
  const auto shown = [](double factor) { return text(factor < 10 ? "%.1f" : "%.0f", factor); };
  const std::string end = (most == kUnknown ? "more than " : "") + shown(most);
  return most < 1.5 * least ? end : shown(least) + " to " + end;
}

void keep_worst(std::vector<WorstMeasurement>& all) {
  std::stable_sort(all.begin(), all.end(), [](const WorstMeasurement& a, const WorstMeasurement& b) {
    return std::abs(a.residual) > std::abs(b.residual);
  });
  std::vector<WorstMeasurement> kept;
  for (const WorstMeasurement& m : all) {
    if (kept.size() == kWorst) break;
    // Parts of one measurement have the same time.
    if (std::none_of(kept.begin(), kept.end(), [&](const WorstMeasurement& k) { return k.t == m.t; }))
      kept.push_back(m);
  }
  all = std::move(kept);
}

}  // namespace

namespace detail {

LossExpectation loss_expectation(const Loss& loss, int rows) {
  if (loss.kind == Loss::Kind::none) return {0.5 * rows, 0};
  // Midpoint rule over u = √s, whose density is that of the χ distribution.
  constexpr int kSteps = 2000;
  const double k = rows, end = std::sqrt(k) + 10, du = end / kSteps;
  const double log_scale = (1 - 0.5 * k) * std::log(2.0) - std::lgamma(0.5 * k);
  LossExpectation sum{0, 0};
  for (int i = 0; i < kSteps; ++i) {
    const double u = (i + 0.5) * du;
    const double mass = std::exp(log_scale + (k - 1) * std::log(u) - 0.5 * u * u) * du;
    const Loss::Value value = loss(u * u);
    sum.half_rho += 0.5 * value.rho * mass;
    if (value.d1 < kDownweightThreshold) sum.down_weighted += mass;
  }
  return sum;
}

const LossExpectation& LossExpectations::operator()(const Loss& loss, int rows) {
  const auto key = std::tuple(loss.kind, loss.scale, rows);
  const auto it = known_.find(key);
  return it != known_.end() ? it->second : known_.emplace(key, loss_expectation(loss, rows)).first->second;
}

}  // namespace detail

std::size_t SensorFit::worst_component() const {
  const auto worst = [](const auto& all) {
    const auto less = [](const auto& a, const auto& b) { return a.rms() < b.rms(); };
    return std::size_t(std::max_element(all.begin(), all.end(), less) - all.begin());
  };
  return series.empty() ? worst(moments) : worst(series);
}

double SensorFit::contested() const {
  const int all = used + rejected;
  return all > 0 ? (rejected + std::max(0.0, down_weighted - expected_down_weighted)) / all : 0;
}

std::string SensorFit::misfit() const {
  std::string found;
  const auto say = [&found](const std::string& part) { found += (found.empty() ? "" : "; ") + part; };
  if (!series.empty()) {
    const std::size_t c = worst_component();
    if (series[c].rms() > kMaxRms)
      say("residuals of " + components[c] + " are " + text("%.3g", series[c].rms()) +
          " times their expected standard deviation" +
          (series[c].has_significant_mean() ? text(" (mean %+.3g)", series[c].mean()) : ""));
  }
  if (innovation_rms > kMaxRms)
    say("innovations are " + text("%.3g", innovation_rms) + " times their expected standard deviation");
  if (contested() > kMaxContested)
    say(std::to_string(rejected + down_weighted) + " of " + std::to_string(used + rejected) +
        " measurements are rejected or down-weighted (" + text("%.0f", expected_down_weighted) + " expected)");
  if (!likely_mistake.empty()) say("probably " + likely_mistake);
  return found;
}

bool FitReport::consistent() const {
  return std::all_of(sensors.begin(), sensors.end(), [](const SensorFit& s) { return s.misfit().empty(); }) &&
         (!is_redundant() || cost <= expected_cost + std::max(5 * cost_sigma, 0.5 * expected_cost));
}

bool FitReport::noise_is_far_too_large() const {
  constexpr double kFewestRows = 20;  // expected cost of 40 rows; the cost of fewer may be small by chance
  return expected_cost > kFewestRows && cost < kFarTooLarge * expected_cost;
}

std::string FitReport::oversized_noises() const {
  std::string found;
  if (!by_marginals) return found;
  const auto add = [&found](const std::string& name, const std::vector<double>& rms) {
    if (const std::string factor = oversize(rms); !factor.empty())
      found += (found.empty() ? "" : ", ") + name + " by a factor of " + factor;
  };
  for (const SensorFit& sensor : sensors) {
    std::vector<double> rms;
    for (const ResidualSeries& series : sensor.series)
      if (!series.t.empty()) rms.push_back(series.rms());
    add(sensor.name, rms);
  }
  for (const NoiseFit& noise : noises) add(noise.name, noise.rms);
  return found;
}

std::string FitReport::verdict() const {
  const std::string costs =
      "cost " + text("%.6g", cost) + ", expected " + text("%.6g", expected_cost) + text(" ± %.2g", cost_sigma);
  const std::string oversized = cost < kGenerous * expected_cost ? oversized_noises() : "";
  if (consistent() && noise_is_far_too_large())
    return "NOISE FAR TOO LARGE (" + costs +
           "). Too large: " + (oversized.empty() ? "the noise of motion or sensors" : oversized) +
           "; standard deviations and this report are not informative. Give smaller noise, or fit it with tandem tune.";
  if (consistent() && !is_redundant())
    return "The fit cannot be judged, because there are not more residuals than unknowns (" + costs + ").";
  if (consistent())
    return "The data fit the model (" + costs + ")." +
           (oversized.empty() ? "" : " Noise that is larger than the residuals need: " + oversized + ".");
  std::string found;
  for (const SensorFit& sensor : sensors)
    if (const std::string misfit = sensor.misfit(); !misfit.empty())
      found += (found.empty() ? "" : " ") + sensor.name + ": " + misfit + ".";
  if (found.empty()) found = "The stated noise does not explain the residuals of motion, odometry or constraints.";
  return "MISFIT (" + costs + "). " + found;
}

FitReport fit_report(const Problem& problem, const std::vector<JudgedSensor>& sensors,
                     std::span<const MeasurementBlock> measurements, const Marginals* marginals,
                     std::span<const NoiseOfBlock> noises) {
  detail::LossExpectations expectations;
  const std::vector<Block> soft = detail::soft_blocks(problem);
  CostSum sum;
  for (const Block& block : soft) sum.add(problem, block, expectations);
  const int unknowns = free_unknowns(problem, soft);
  const double remaining = sum.rows > 0 ? std::max(0.0, 1 - double(unknowns) / sum.rows) : 0;

  FitReport report;
  report.by_marginals = marginals != nullptr;
  report.cost = sum.cost;
  report.expected_cost = remaining * sum.expected;
  report.cost_sigma = std::sqrt(remaining * sum.expected);  // the variance of ½ χ² equals its mean
  for (const JudgedSensor& sensor : sensors) {
    SensorFit& fit = report.sensors.emplace_back();
    fit.name = sensor.name;
    fit.rejected = int(sensor.rejected.size());
    fit.rejected_at = sensor.rejected;
    fit.components = sensor.components;
    fit.series.resize(sensor.components.size());
    fit.down_weighted_series.resize(sensor.components.size());
  }
  bool counted = false;
  for (const MeasurementBlock& m : measurements)
    add(problem, m, marginals, remaining, report.sensors.at(m.sensor), counted, expectations);
  for (SensorFit& fit : report.sensors) {
    for (ResidualSeries& series : fit.series) series.sort();
    keep_worst(fit.worst);
  }
  report.noises = noise_fits(problem, noises, marginals, remaining);
  return report;
}

}  // namespace tandem

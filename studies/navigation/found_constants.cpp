#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <tandem/solvers/evidence_deviation.hpp>
#include <tandem/studies/navigation/found_constants.hpp>

namespace tandem {

std::string_view text(ConstantVerdict verdict) {
  switch (verdict) {
    case ConstantVerdict::found:
      return "found";
    case ConstantVerdict::predicts_better:
      return "found; predicts held-out data better: recommended";
    case ConstantVerdict::predicts_no_better:
      return "found, but predicts held-out data no better: leave it out";
    case ConstantVerdict::untold:
      return "not told by the data: what was given says more";
    case ConstantVerdict::at_odds:
      return "at odds with what was given: not to be trusted";
    case ConstantVerdict::at_odds_yet_better:
      return "at odds with what was given, but predicts held-out data better: true, or another misfit";
    case ConstantVerdict::unknown:
      break;
  }
  return "without a standard error: not known how well the data tell it";
}

ConstantVerdict FoundConstant::verdict() const {
  // Of the deviation before: far from it, and so narrow that the data say at least as much as was known, as of noise.
  constexpr double kFar = 2, kNarrower = std::numbers::sqrt2 / 2;
  // Several are tried at once, of which one in six gains more than one standard error by chance; and what gains less than
  // its own degree of freedom costs tells nothing.
  constexpr double kErrors = 2, kLeast = 2;
  const bool better = held_out && held_out->gain > std::max(kErrors * held_out->error, kLeast);
  if (std::abs(value) > kFar * given) return better ? ConstantVerdict::at_odds_yet_better : ConstantVerdict::at_odds;
  if (!(deviation > 0)) return ConstantVerdict::unknown;
  if (!(deviation <= kNarrower * given)) return ConstantVerdict::untold;
  if (!held_out) return ConstantVerdict::found;
  return better ? ConstantVerdict::predicts_better : ConstantVerdict::predicts_no_better;
}

std::string FoundConstant::text() const {
  return deviation > 0 ? fmt::format("{} {:.5f} ± {:.5f}", name, value, deviation)
                       : fmt::format("{} {:.5f}", name, value);
}

namespace {

/// Each row of an error by the name it has in tables.
void add_rows(const std::string& name, const Eigen::VectorXd& value, const Eigen::VectorXd& given,
              const Eigen::VectorXd& deviation, std::vector<FoundConstant>& found) {
  for (Eigen::Index i = 0; i < value.size(); ++i) {
    const std::string row = name.ends_with(".bias") ? fmt::format(".{}", i + 1)
                            : value.size() == 3     ? fmt::format(".r{:c}", "xyz"[i])
                                                    : std::string();
    found.push_back({name + row, value[i], given[i], deviation.size() ? deviation[i] : 0.0});
  }
}

}  // namespace

std::vector<FoundConstant> found_constants(const Problem& problem, const std::vector<SensorConstant>& constants,
                                           const Marginals* marginals) {
  std::vector<FoundConstant> found;
  const auto add = [&]<LieGroup G>(const SensorConstant& constant, const Variable<G>& x) {
    Eigen::VectorXd deviation;
    if (marginals) deviation = marginals->covariance(x).diagonal().cwiseSqrt();
    add_rows(constant.name, problem.value(x).Log(), constant.sigma, deviation, found);
  };
  for (const SensorConstant& constant : constants) std::visit([&](const auto& x) { add(constant, x); }, constant.state);
  return found;
}

std::vector<FoundConstant> found_constants_by_evidence(const Problem& problem,
                                                       const std::vector<SensorConstant>& constants,
                                                       const Marginals& marginals, const Stop& stop) {
  std::vector<FoundConstant> found = found_constants(problem, constants, &marginals);
  for (const SensorConstant& c : constants) {
    if (!c.name.ends_with(".delay")) continue;
    const auto told =
        std::find_if(found.begin(), found.end(), [&](const FoundConstant& f) { return f.name == c.name; });
    const auto deviation =
        evidence_deviation(problem, std::get<Variable<Rn<1>>>(c.state), told->deviation, told->given, stop);
    told->deviation = std::min(deviation.value_or(0), told->given);
  }
  return found;
}

std::vector<FoundConstant> found_errors(const std::vector<OnlineEstimator::SensorError>& errors) {
  std::vector<FoundConstant> found;
  for (const OnlineEstimator::SensorError& e : errors) add_rows(e.name, e.value, e.given, e.deviation, found);
  return found;
}

std::string constants_text(const std::vector<FoundConstant>& constants) {
  if (constants.empty()) return "";
  std::string lines = "Errors that stay (scale 1, misalignment rad, delay s, bias in the units of its rows):\n";
  std::vector<ConstantVerdict> verdicts;
  for (const FoundConstant& c : constants) {
    verdicts.push_back(c.verdict());
    lines += fmt::format("  {}: {}\n", c.text(), text(verdicts.back()));
  }
  return lines + constants_advice(verdicts);
}

std::string constants_advice(const std::vector<ConstantVerdict>& verdicts) {
  const auto has = [&](ConstantVerdict v) { return std::find(verdicts.begin(), verdicts.end(), v) != verdicts.end(); };
  if (has(ConstantVerdict::at_odds))
    return "At odds is what is more than two of its given standard deviations from none: it may stand for a misfit "
           "elsewhere, of\nthe target's motion above all. Try another --model, or leave it out.\n";
  if (has(ConstantVerdict::found))
    return "Found is what fits these measurements; whether it predicts others, or stands for a misfit elsewhere, "
           "tandem calibrate\n--free tells (in its folds, by default).\n";
  return "";
}

}  // namespace tandem

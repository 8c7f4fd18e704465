#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <tandem/solvers/profile_evidence.hpp>
#include <tandem/studies/navigation/systematic_error_estimates.hpp>

namespace tandem {

std::string_view text(SystematicErrorVerdict verdict) {
  constexpr std::string_view texts[] = {
      "no standard deviation: identifiability unknown",
      "identifiable",
      "identifiable; improves the prediction of held-out data: recommended",
      "identifiable, but does not improve the prediction of held-out data: not recommended",
      "not identifiable: the data are less informative than the prior",
      "inconsistent with the prior: do not trust it",
      "inconsistent with the prior, but improves the prediction of held-out data: real, or another model error"};
  return texts[int(verdict)];
}

SystematicErrorVerdict SystematicErrorEstimate::verdict() const {
  // Relative to the prior standard deviation. At √½ of it, the data are as informative as the prior.
  constexpr double kInconsistent = 2, kIdentifiable = std::numbers::sqrt2 / 2;
  // If several errors are tried, one in six gains one standard error by chance, so two are required. A gain
  // below 2 is no more than one additional degree of freedom gives.
  constexpr double kMinErrors = 2, kMinGain = 2;
  const bool better = held_out && held_out->gain > std::max(kMinErrors * held_out->error, kMinGain);
  if (std::abs(value) > kInconsistent * prior_sigma)
    return better ? SystematicErrorVerdict::inconsistent_but_improves_prediction
                  : SystematicErrorVerdict::inconsistent_with_prior;
  if (!(sigma > 0)) return SystematicErrorVerdict::no_standard_error;
  if (!(sigma <= kIdentifiable * prior_sigma)) return SystematicErrorVerdict::not_identifiable;
  if (!held_out) return SystematicErrorVerdict::identifiable;
  return better ? SystematicErrorVerdict::improves_prediction : SystematicErrorVerdict::no_improvement;
}

std::string SystematicErrorEstimate::text() const {
  return sigma > 0 ? fmt::format("{} {:.5f} ± {:.5f}", name, value, sigma) : fmt::format("{} {:.5f}", name, value);
}

namespace {

/// Appends an estimate per component of an error, named NAME, NAME.rx or, for a bias, NAME.1.
void add_components(const std::string& name, const Eigen::VectorXd& value, const Eigen::VectorXd& prior_sigma,
                    const Eigen::VectorXd& sigma, std::vector<SystematicErrorEstimate>& estimates) {
  for (Eigen::Index i = 0; i < value.size(); ++i) {
    const std::string component = name.ends_with(".bias") ? fmt::format(".{}", i + 1)
                                  : value.size() == 3     ? fmt::format(".r{:c}", "xyz"[i])
                                                          : std::string();
    estimates.push_back({name + component, value[i], prior_sigma[i], sigma.size() ? sigma[i] : 0.0});
  }
}

}  // namespace

std::vector<SystematicErrorEstimate> systematic_error_estimates(const Problem& problem,
                                                                const std::vector<SensorConstant>& constants,
                                                                const Marginals* marginals) {
  std::vector<SystematicErrorEstimate> estimates;
  const auto add = [&]<LieGroup G>(const SensorConstant& constant, const Variable<G>& x) {
    Eigen::VectorXd sigma;
    if (marginals) sigma = marginals->covariance(x).diagonal().cwiseSqrt();
    add_components(constant.name, problem.value(x).Log(), constant.sigma, sigma, estimates);
  };
  for (const SensorConstant& constant : constants) std::visit([&](const auto& x) { add(constant, x); }, constant.state);
  return estimates;
}

std::vector<SystematicErrorEstimate> systematic_error_estimates_by_evidence(
    const Problem& problem, const std::vector<SensorConstant>& constants, const Marginals& marginals,
    const Stop& stop) {
  std::vector<SystematicErrorEstimate> estimates = systematic_error_estimates(problem, constants, &marginals);
  for (const SensorConstant& c : constants) {
    if (!c.name.ends_with(".delay")) continue;
    const auto delay = std::find_if(estimates.begin(), estimates.end(),
                                    [&](const SystematicErrorEstimate& e) { return e.name == c.name; });
    const auto sigma =
        profile_evidence_sigma(problem, std::get<Variable<Rn<1>>>(c.state), delay->sigma, delay->prior_sigma, stop);
    delay->sigma = std::min(sigma.value_or(0), delay->prior_sigma);
  }
  return estimates;
}

std::vector<SystematicErrorEstimate> online_systematic_errors(const std::vector<OnlineEstimator::SensorError>& errors) {
  std::vector<SystematicErrorEstimate> estimates;
  for (const OnlineEstimator::SensorError& e : errors)
    add_components(e.name, e.value, e.prior_sigma, e.sigma, estimates);
  return estimates;
}

std::string systematic_errors_text(const std::vector<SystematicErrorEstimate>& constants) {
  if (constants.empty()) return "";
  std::string lines = "Systematic errors (scale [1], misalignment [rad], delay [s], bias [sensor's unit]):\n";
  std::vector<SystematicErrorVerdict> verdicts;
  for (const SystematicErrorEstimate& c : constants) {
    verdicts.push_back(c.verdict());
    lines += fmt::format("  {}: {}\n", c.text(), text(verdicts.back()));
  }
  return lines + systematic_errors_advice(verdicts);
}

std::string systematic_errors_advice(const std::vector<SystematicErrorVerdict>& verdicts) {
  const auto has = [&](SystematicErrorVerdict v) {
    return std::find(verdicts.begin(), verdicts.end(), v) != verdicts.end();
  };
  if (has(SystematicErrorVerdict::inconsistent_with_prior))
    return "Inconsistent: more than two prior standard deviations from 0. Another model error may cause it, most "
           "likely "
           "of the\ntarget's motion. Try another --model, or do not estimate this error.\n";
  if (has(SystematicErrorVerdict::identifiable))
    return "An identifiable error may still absorb another model error. tandem calibrate --free cross-validates "
           "whether it "
           "improves\nthe prediction of held-out data.\n";
  return "";
}

}  // namespace tandem

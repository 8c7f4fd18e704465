#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/calibration/calibration_report.hpp>
#include <tandem/studies/navigation/systematic_error_estimates.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

using Align = TextTable::Align;

/// Returns whether the identifiability of a parameter was tested.
bool has_range(const CalibratedNoise& noise) { return noise.flat_from < noise.flat_to; }

std::string verdict(const CalibratedParameter& p) {
  const CalibratedNoise& r = p.result;
  switch (p.keep_reason) {
    case KeepReason::misfit:
      return "not explained by white noise (see below); given value kept";
    case KeepReason::untested:
      return "smaller noise is not testable over gaps without fixes (see below); given value kept";
    case KeepReason::at_limit:
      return "ran to the limit, a factor of 1000; given value kept: start from a closer one (--noise)";
    case KeepReason::none:
      break;
  }
  if (!has_range(r)) return "stopped early: identifiability unknown";
  if (r.identifiable) return "identifiable";
  if (r.bounded) {
    const bool less = r.flat_to < 1;
    const double bound = less ? r.flat_to : r.flat_from;
    const bool beyond = less ? r.factor > bound : r.factor < bound;  // pulled there by the prior
    return fmt::format("{} {:.2g} by the data; {}", less ? "at most" : "at least", p.given * bound,
                       beyond ? "the prior pulls the estimate beyond this bound"
                              : fmt::format("the {} bound comes from the prior", less ? "lower" : "upper"));
  }
  return fmt::format("not identifiable (evidence is flat from {:.2g} to {:.2g}); given value kept",
                     p.given * r.flat_from, p.given * r.flat_to);
}

std::string held_out_sentence(const ScenarioCalibration& c) {
  if (c.parameters.empty()) {
    const bool constants_tested = std::any_of(c.constants.begin(), c.constants.end(),
                                              [](const CalibratedConstant& k) { return k.found.held_out.has_value(); });
    return constants_tested ? "No noise was calibrated; cross-validation tested the systematic errors."
                            : "No noise was calibrated, so there was no cross-validation.";
  }
  if (std::all_of(c.parameters.begin(), c.parameters.end(),
                  [](const CalibratedParameter& p) { return p.keep_reason != KeepReason::none; }))
    return "No estimate is accepted: keep the given noise.";
  if (c.folds == 0)
    return c.cut_short
               ? "Stopped before cross-validation was complete: it is unknown whether this noise predicts better. The "
                 "given noise is kept."
               : "No cross-validation (--folds 0): it is unknown whether this noise predicts better.";
  if (!c.why_not_validated.empty())
    return fmt::format("Cross-validation failed ({}): the given noise is kept.", c.why_not_validated);
  int n = 0;
  for (const HeldOutScore& score : c.scores) n += score.measurements;
  return fmt::format(
      "{} measurements held out in {} folds: the calibrated noise changes their log-likelihood by {:+.1f} ± {:.1f}. {}",
      n, c.folds, c.gain, c.gain_error,
      c.recommended() ? "It predicts better: recommended." : "It does not predict better: keep the given noise.");
}

/// Returns the table of constants, whose priors are 0 ± given.
std::string constants_table(const ScenarioCalibration& c) {
  if (c.constants.empty()) return "";
  TextTable table({{"systematic error", Align::left},
                   {"prior ±"},
                   {"estimate"},
                   {"±"},
                   {"held-out gain"},
                   {"verdict", Align::left}});
  std::vector<SystematicErrorVerdict> verdicts;
  bool validated = false;
  for (const CalibratedConstant& constant : c.constants) {
    const SystematicErrorEstimate& f = constant.found;
    verdicts.push_back(f.verdict());
    validated = validated || f.held_out;
    table.row({display_name(c, constant), fmt::format("{:.4g}", f.prior_sigma), fmt::format("{:.5f}", f.value),
               fmt::format("{:.2g}", f.sigma),
               f.held_out ? fmt::format("{:+.1f} ± {:.1f}", f.held_out->gain, f.held_out->error) : "–",
               std::string(text(verdicts.back()))});
  }
  return (c.parameters.empty() ? "" : "\n") + table.str() +
         "Scale factor errors are relative; misalignments in rad, delays in s, biases in the units of the "
         "measurement.\n" +
         (validated ? "Held-out gain: increase of the log-likelihood of held-out measurements by the constant.\n"
                    : "") +
         systematic_errors_advice(verdicts);
}

}  // namespace

std::string display_name(const ScenarioCalibration& c, const CalibratedConstant& constant) {
  return c.scenarios.size() > 1 ? fmt::format("{} of {}", constant.found.name, constant.scenario) : constant.found.name;
}

std::string report(const ScenarioCalibration& c) {
  std::string text = fmt::format("{}: noise calibration ({}, {} solves, {:.2f} s)\n\n", fmt::join(c.scenarios, ", "),
                                 name(c.summary.status), c.summary.solves, c.seconds);
  TextTable table({{"parameter", Align::left}, {"given"}, {"estimate"}, {"±"}, {"gain"}, {"verdict", Align::left}});
  for (const CalibratedParameter& p : c.parameters) {
    const bool estimated =
        p.keep_reason == KeepReason::none && (p.result.identifiable || p.result.bounded || !has_range(p.result));
    table.row({p.name, fmt::format("{:.4g}", p.given), estimated ? fmt::format("{:.4g}", p.found()) : "–",
               estimated && has_range(p.result) ? fmt::format("{:.2g}", p.found() * p.result.log_error) : "–",
               estimated && has_range(p.result) ? fmt::format("{:.1f}", p.result.gain) : "–", verdict(p)});
  }
  if (!c.parameters.empty()) text += table.str();
  text += constants_table(c);
  if (!c.parameters.empty())
    text += fmt::format("\nTotal gain in log evidence: {:+.1f}. The column `gain` is that of one parameter alone.\n",
                        c.summary.gain);
  for (const std::string& sentence : c.notes) text += sentence + ".\n";

  TextTable residuals(
      {{"residuals of", Align::left}, {"n"}, {"mean"}, {"std"}, {"lag-1 corr."}, {"mean"}, {"std"}, {"lag-1 corr."}});
  residuals.group(2, 4, "given noise [σ]");
  residuals.group(5, 7, "calibrated noise [σ]");
  std::string diagnoses;
  for (std::size_t i = 0; i < c.after.size() && i < c.before.size(); ++i) {
    const Misfit &a = c.before[i], &b = c.after[i];
    const std::string who = (c.scenarios.size() > 1 ? b.scenario + " " : "") + b.parameter;
    residuals.row({who, fmt::format("{}", b.value.size()), fmt::format("{:+.2f}", a.mean()),
                   fmt::format("{:.2f}", a.standard_deviation()), fmt::format("{:+.2f}", a.correlation()),
                   fmt::format("{:+.2f}", b.mean()), fmt::format("{:.2f}", b.standard_deviation()),
                   fmt::format("{:+.2f}", b.correlation())});
    if (const std::string sentence = b.diagnosis(); !sentence.empty())
      diagnoses += (c.scenarios.size() > 1 ? b.scenario + ": " : "") + sentence + ".\n";
  }
  text += "\n" + residuals.str();
  text += fmt::format(
      "\nWhite noise has mean 0, standard deviation 1 and lag-1 correlation 0. Smaller noise is not recommended if the "
      "correlation exceeds {:g} and three standard errors.\n",
      Misfit::kMaxCorrelation);
  if (!diagnoses.empty()) text += "Not explained by white noise:\n" + diagnoses;

  text += "\n" + held_out_sentence(c) + "\n";
  for (const HeldOutScore& s : c.scores)
    text += fmt::format(
        "  {}: log-likelihood per measurement {:.3f} with the given noise, {:.3f} with the calibrated noise\n",
        s.scenario, s.given, s.found);
  return text;
}

std::string noise_file_comment(const ScenarioCalibration& c) {
  const bool kept = (c.folds > 0 || c.cut_short) && !c.recommended();
  return fmt::format("tandem calibrate {}\n{}\n{}", fmt::join(c.scenarios, " "), held_out_sentence(c),
                     kept ? "These are the given standard deviations." : "");
}

}  // namespace tandem

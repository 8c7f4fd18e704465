#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/calibration/calibration_report.hpp>
#include <tandem/studies/navigation/found_constants_json.hpp>
#include <tandem/studies/support/json_text.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

using CalibrationJson = nlohmann::ordered_json;
using Align = TextTable::Align;

/// Whether the range over which the evidence is flat was looked for.
bool has_range(const CalibratedNoise& noise) { return noise.flat_from < noise.flat_to; }

std::string verdict(const CalibratedParameter& p) {
  const CalibratedNoise& r = p.result;
  switch (p.distrust) {
    case Distrust::misfit:
      return "not noise alone (below), and no less of it is believed; kept";
    case Distrust::untried:
      return "less is not tried over times without fixes (below); kept";
    case Distrust::at_bound:
      return "ran a thousandfold from what was given, as far as is allowed; kept: give a nearer one (--noise)";
    case Distrust::none:
      break;
  }
  if (!has_range(r)) return "cut short: not known how well the data tell it";
  if (r.determined) return "found";
  if (r.bounded) {
    const bool less = r.flat_to < 1;
    const double bound = less ? r.flat_to : r.flat_from;
    const bool beyond = less ? r.factor > bound : r.factor < bound;  // where its prior holds it
    return fmt::format("the data say no {} than {:.2g}; {}", less ? "more" : "less", p.given * bound,
                       beyond ? "what was given holds it nearer"
                              : fmt::format("how much {}, what was given says", less ? "less" : "more"));
  }
  return fmt::format("the data do not tell it: as likely from {:.2g} to {:.2g}; kept", p.given * r.flat_from,
                     p.given * r.flat_to);
}

std::string held_out_sentence(const ScenarioCalibration& c) {
  if (c.parameters.empty()) return "No noise was calibrated: nothing was held out.";
  if (std::all_of(c.parameters.begin(), c.parameters.end(),
                  [](const CalibratedParameter& p) { return p.distrust != Distrust::none; }))
    return "Nothing that was found is believed: keep what you had.";
  if (c.folds == 0)
    return c.cut_short ? "It was stopped before all was held out: whether this noise predicts better is not known."
                       : "Nothing was held out (--folds): whether this noise predicts better is not known.";
  if (!c.why_not_validated.empty())
    return fmt::format("Held-out measurements have no answer ({}): what was given is kept.", c.why_not_validated);
  int n = 0;
  for (const HeldOutScore& score : c.scores) n += score.measurements;
  return fmt::format(
      "{} measurements held out in {} folds: their log likelihood is {:+.1f} ± {:.1f} against the noise as given. {}",
      n, c.folds, c.gain, c.gain_error,
      c.recommended() ? "The noise that was found predicts better: recommended."
                      : "The noise that was found predicts no better: keep what you had.");
}

std::string told_name(const ScenarioCalibration& c, const CalibratedConstant& constant) {
  return c.scenarios.size() > 1 ? fmt::format("{} of {}", constant.found.name, constant.scenario) : constant.found.name;
}

/// A constant's own prior is 0 ± given.
std::string constants_table(const ScenarioCalibration& c) {
  if (c.constants.empty()) return "";
  TextTable table(
      {{"error that stays", Align::left}, {"given ±"}, {"found"}, {"±"}, {"held out"}, {"verdict", Align::left}});
  std::vector<ConstantVerdict> verdicts;
  bool tried = false;
  for (const CalibratedConstant& constant : c.constants) {
    const FoundConstant& f = constant.found;
    verdicts.push_back(f.verdict());
    tried = tried || f.held_out;
    table.row({told_name(c, constant), fmt::format("{:.4g}", f.given), fmt::format("{:.5f}", f.value),
               fmt::format("{:.2g}", f.deviation),
               f.held_out ? fmt::format("{:+.1f} ± {:.1f}", f.held_out->gain, f.held_out->error) : "–",
               std::string(text(verdicts.back()))});
  }
  return (c.parameters.empty() ? "" : "\n") + table.str() +
         "Scales are what is read too much of 1; misalignments in rad, delays in s, biases in the units of their "
         "rows.\n" +
         (tried ? "Held out: the gain in the log likelihood of held-out measurements, by the constant as found on the "
                  "others.\n"
                : "") +
         constants_advice(verdicts);
}

CalibrationJson entries_json(const std::vector<NoiseEntry>& entries) {
  CalibrationJson json = CalibrationJson::object();
  for (const NoiseEntry& entry : entries) json[entry.name] = entry.sigmas;
  return json;
}

}  // namespace

std::string report(const ScenarioCalibration& c) {
  std::string text = fmt::format("{}: noise that the measurements tell ({}, {} solves, {:.2f} s)\n\n",
                                 fmt::join(c.scenarios, ", "), name(c.summary.status), c.summary.solves, c.seconds);
  TextTable table({{"parameter", Align::left}, {"given"}, {"found"}, {"±"}, {"gain"}, {"verdict", Align::left}});
  for (const CalibratedParameter& p : c.parameters) {
    const bool told = p.distrust == Distrust::none && (p.result.determined || p.result.bounded || !has_range(p.result));
    table.row({p.name, fmt::format("{:.4g}", p.given), told ? fmt::format("{:.4g}", p.found()) : "–",
               told && has_range(p.result) ? fmt::format("{:.2g}", p.found() * p.result.log_error) : "–",
               told && has_range(p.result) ? fmt::format("{:.1f}", p.result.gain) : "–", verdict(p)});
  }
  if (!c.parameters.empty()) text += table.str();
  text += constants_table(c);
  if (!c.parameters.empty())
    text += fmt::format("\nEvidence {:+.1f} in all; gain is a parameter's own, in the logarithm of the evidence.\n",
                        c.summary.gain);
  for (const std::string& sentence : c.held) text += sentence + ".\n";

  TextTable residuals({{"residuals of", Align::left},
                       {"n"},
                       {"mean"},
                       {"spread"},
                       {"neighbours"},
                       {"mean"},
                       {"spread"},
                       {"neighbours"}});
  residuals.group(2, 4, "as given [σ]");
  residuals.group(5, 7, "as found [σ]");
  std::string diagnoses;
  for (std::size_t i = 0; i < c.after.size() && i < c.before.size(); ++i) {
    const Misfit &a = c.before[i], &b = c.after[i];
    const std::string who = (c.scenarios.size() > 1 ? b.scenario + " " : "") + b.parameter;
    residuals.row({who, fmt::format("{}", b.value.size()), fmt::format("{:+.2f}", a.mean()),
                   fmt::format("{:.2f}", a.spread()), fmt::format("{:+.2f}", a.correlation()),
                   fmt::format("{:+.2f}", b.mean()), fmt::format("{:.2f}", b.spread()),
                   fmt::format("{:+.2f}", b.correlation())});
    if (const std::string sentence = b.diagnosis(); !sentence.empty())
      diagnoses += (c.scenarios.size() > 1 ? b.scenario + ": " : "") + sentence + ".\n";
  }
  text += "\n" + residuals.str();
  text += "\nIf noise were all, means were 0, spreads 1 and neighbours did not correlate.\n";
  if (!diagnoses.empty()) text += "What noise does not explain:\n" + diagnoses;

  text += "\n" + held_out_sentence(c) + "\n";
  for (const HeldOutScore& s : c.scores)
    text += fmt::format("  {}: {:.3f} a measurement as given, {:.3f} as found\n", s.scenario, s.given, s.found);
  return text;
}

std::string noise_file_comment(const ScenarioCalibration& c) {
  const bool kept = c.folds > 0 && !c.recommended();
  return fmt::format("tandem calibrate {}\n{}\n{}", fmt::join(c.scenarios, " "), held_out_sentence(c),
                     kept ? "These are the standard deviations as given." : "");
}

std::string calibration_json(const ScenarioCalibration& c) {
  CalibrationJson json = {{"scenarios", c.scenarios},
                          {"status", name(c.summary.status)},
                          {"message", c.summary.message},
                          {"evidence_gain", c.summary.gain},
                          {"iterations", c.summary.iterations},
                          {"solves", c.summary.solves},
                          {"seconds", c.seconds},
                          {"parameters", CalibrationJson::array()}};
  for (const CalibratedParameter& p : c.parameters) {
    CalibrationJson row = {{"name", p.name},
                           {"given", p.given},
                           {"found", p.found()},
                           {"standard_error", p.found() * p.result.log_error},
                           {"gain", p.result.gain},
                           {"determined", p.result.determined},
                           {"bounded", p.result.bounded},
                           {"distrusted", p.distrust != Distrust::none},
                           {"at_bound", p.result.at_bound},
                           {"rows", p.result.rows},
                           {"effective_rows", p.result.effective_rows}};
    row["flat_from"] = p.given * p.result.flat_from;
    row["flat_to"] = p.given * p.result.flat_to;
    json["parameters"].push_back(row);
  }
  for (const CalibratedConstant& constant : c.constants) {
    CalibrationJson entry = {{"scenario", constant.scenario}};
    entry.update(staying_error(constant.found));
    if (const auto& held_out = constant.found.held_out)
      entry["held_out"] = {{"gain", held_out->gain}, {"gain_error", held_out->error}};
    std::string key = told_name(c, constant);
    for (int k = 2; json["staying_errors"].contains(key); ++k)  // of scenarios of one name
      key = fmt::format("{} ({})", told_name(c, constant), k);
    json["staying_errors"][key] = std::move(entry);
  }
  json["residuals"] = CalibrationJson::array();
  for (std::size_t i = 0; i < c.after.size() && i < c.before.size(); ++i) {
    CalibrationJson row = {{"scenario", c.after[i].scenario}, {"parameter", c.after[i].parameter}};
    for (const auto& [key, m] : {std::pair{"given", &c.before[i]}, {"found", &c.after[i]}})
      row[key] = {
          {"n", m->value.size()},  {"down_weighted", m->down_weighted}, {"mean", m->mean()},
          {"spread", m->spread()}, {"correlation", m->correlation()},   {"correlation_time", m->correlation_time()}};
    row["diagnosis"] = c.after[i].diagnosis();
    json["residuals"].push_back(row);
  }
  json["held_out"] = {{"folds", c.folds},
                      {"gain", c.gain},
                      {"gain_error", c.gain_error},
                      {"recommended", c.recommended()},
                      {"why_not", c.why_not_validated},
                      {"scenarios", CalibrationJson::array()}};
  for (const HeldOutScore& s : c.scores)
    json["held_out"]["scenarios"].push_back(
        {{"scenario", s.scenario}, {"measurements", s.measurements}, {"given", s.given}, {"found", s.found}});
  json["held"] = c.held;
  json["noise"] = entries_json(c.noise);
  json["given_noise"] = entries_json(c.given_noise);
  return json_text(json);
}

}  // namespace tandem

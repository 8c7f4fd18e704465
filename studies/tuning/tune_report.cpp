#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/text_table.hpp>
#include <tandem/studies/tuning/model_settings.hpp>
#include <tandem/studies/tuning/tune_report.hpp>

namespace tandem {
namespace {

using Align = TextTable::Align;
constexpr std::size_t kShownRejected = 5;

bool is_in_model(const ModelStep& step) {
  return step.verdict == ModelVerdict::kept || step.verdict == ModelVerdict::removed ||
         step.verdict == ModelVerdict::needed;
}

/// Returns the settings that differ from the given ones.
ModelSettings difference(const Tuning& t) {
  ModelSettings changes;
  for (const auto& [setting, value] : t.selection.settings) {
    const auto at = t.given.find(setting);
    if (at == t.given.end() || at->second != value) changes[setting] = value;
  }
  return changes;
}

std::string gain_text(const ModelStep& step) {
  return step.verdict == ModelVerdict::impossible || step.verdict == ModelVerdict::needed
             ? "–"
             : fmt::format("{:+.1f} ± {:.1f}", step.gain.gain, step.gain.standard_error);
}

std::string coverage_text(const PredictiveScore& score) {
  std::vector<std::string> parts;
  const auto coverage = score.coverage();
  for (std::size_t i = 0; i < coverage.size(); ++i)
    parts.push_back(fmt::format("{:.0f} ± {:.0f} % in {:.0f} %", 100 * coverage[i].share,
                                200 * coverage[i].standard_error, 100 * kCoverageLevels[i]));
  return fmt::format("{}", fmt::join(parts, ", "));
}

/// Returns a sentence for each sensor whose residuals the selected model does not explain.
std::vector<std::string> unexplained(const Tuning& t) {
  std::vector<std::string> sentences;
  for (const Misfit& m : t.after) {
    const std::string text = m.diagnosis();
    if (!text.empty()) sentences.push_back((t.scenarios.size() > 1 ? m.scenario + ": " : "") + text + ".");
  }
  return sentences;
}

CsvTable<ModelStep> step_columns() {
  CsvTable<ModelStep> table;
  table
      .add("change", "options of the command line; `without` resets an option",
           [](const ModelStep& s) { return describe(s.change.settings); })
      .add("gain", "gain in predictive log-likelihood over the model at that step",
           [](const ModelStep& s) { return s.gain.gain; })
      .add("standard_error", "standard error of the gain, by blocks of time",
           [](const ModelStep& s) { return s.gain.standard_error; })
      .add("verdict", "kept, removed, needed, not better, inconsistent or impossible",
           [](const ModelStep& s) { return std::string(name(s.verdict)); })
      .add("why", "what suggested the change, or why it is impossible",
           [](const ModelStep& s) { return s.why.empty() ? s.change.why : s.why; });
  return table;
}

JsonFields<ModelStep> step_fields() {
  return JsonFields<ModelStep>()
      .add("change", "options of the command line", [](const ModelStep& s) { return describe(s.change.settings); })
      .add("gain", "gain in predictive log-likelihood", [](const ModelStep& s) { return s.gain.gain; })
      .add("standard_error", "standard error of the gain", [](const ModelStep& s) { return s.gain.standard_error; })
      .add("verdict", "kept, removed, needed, not better, inconsistent or impossible",
           [](const ModelStep& s) { return std::string(name(s.verdict)); })
      .add("why", "what suggested the change, or why it is impossible",
           [](const ModelStep& s) { return s.why.empty() ? s.change.why : s.why; });
}

JsonFields<Tuning> tune_fields() {
  return JsonFields<Tuning>()
      .add("scenarios", "names of the scenarios", [](const Tuning& t) { return t.scenarios; })
      .add("block_length", "length of the held-out blocks of time [s]", [](const Tuning& t) { return t.block_length; })
      .add("ahead", "time of predictions from earlier measurements only [s]; 0: none",
           [](const Tuning& t) { return t.ahead; })
      .add("model", "the selected model in one sentence", [](const Tuning& t) { return tuned_model(t); })
      .add("options", "options of the selected model, as words of a command line",
           [](const Tuning& t) { return words_of(t.selection.settings); })
      .add("gain", "gain in predictive log-likelihood over the model from which the search starts",
           [](const Tuning& t) { return t.selection.gain.gain; })
      .add("standard_error", "standard error of the gain",
           [](const Tuning& t) { return t.selection.gain.standard_error; })
      .add("models", "number of models that were scored", [](const Tuning& t) { return t.selection.models; })
      .add("complete", "whether the search ended by itself", [](const Tuning& t) { return !t.selection.cut_short; })
      .add("coverage", "shares of held-out measurements in their 50, 95 and 99 % intervals",
           [](const Tuning& t) {
             std::vector<double> shares;
             for (const Coverage& c : t.selection.found.coverage()) shares.push_back(c.share);
             return shares;
           })
      .add("unexplained", "what remains in the residuals, by sensor", [](const Tuning& t) { return unexplained(t); })
      .add_list("steps", "evaluated changes", step_fields(),
                [](const Tuning& t) -> const std::vector<ModelStep>& { return t.selection.steps; });
}

std::string held_out_text(const Tuning& t) {
  return fmt::format("in blocks of {:.2g} s", t.block_length) +
         (t.ahead > 0 ? fmt::format(" and predicted up to {:.2g} s ahead", t.ahead) : "");
}

}  // namespace

std::string tuned_model(const Tuning& t) {
  const ModelSettings changes = difference(t);
  const bool complete = !t.selection.cut_short;
  if (changes.empty())
    return complete ? "The given model predicts best; nothing is changed."
                    : "No better model was found before the search was stopped; nothing is changed.";
  if (t.selection.settings == t.start)
    return fmt::format("Needed: {}; no further change {}.", describe(changes),
                       complete ? "predicts better" : "was found to predict better before the search was stopped");
  return fmt::format("{}: {} (gain {:+.1f} ± {:.1f} in predictive log-likelihood).",
                     complete ? "Predicts best" : "Best model when the search was stopped", describe(changes),
                     t.selection.gain.gain, t.selection.gain.standard_error);
}

std::string tune_report(const Tuning& t, bool full) {
  TextTable table({{"change", Align::left}, {"gain"}, {"verdict", Align::left}, {"why", Align::left}});
  std::size_t rejected = 0;
  for (const bool in_model : {true, false})
    for (const ModelStep& step : t.selection.steps) {
      if (is_in_model(step) != in_model) continue;
      if (!in_model && ++rejected > kShownRejected && !full) continue;
      table.row({describe(step.change.settings), gain_text(step), std::string(name(step.verdict)),
                 step.why.empty() ? step.change.why : step.why});
    }
  std::string text =
      fmt::format("{}\n\n{}: {} models scored in {:.0f} s on measurements held out {}\n\n{}", tuned_model(t),
                  fmt::join(t.scenarios, ", "), t.selection.models, t.seconds, held_out_text(t), table.str());
  if (!full && rejected > kShownRejected)
    text += fmt::format("… and {} candidates that are not kept. All: --full, or steps.csv in --out.\n",
                        rejected - kShownRejected);
  if (t.selection.cut_short) text += "The search was stopped early; more time (--time) may find a better model.\n";
  text += fmt::format("\nHeld-out measurements inside of their intervals: {}", coverage_text(t.selection.start));
  if (t.changed()) text += fmt::format("; tuned: {}", coverage_text(t.selection.found));
  text += ".\n";
  const std::vector<std::string> rest = unexplained(t);
  text += rest.empty() ? "The residuals of all sensors are white.\n" : "Unexplained:\n";
  for (const std::string& sentence : rest) text += "  " + sentence + "\n";
  return text;
}

std::string candidates_report(const Tuning& t) {
  TextTable table({{"candidate", Align::left}, {"why", Align::left}});
  for (const ModelChange& change : t.candidates) table.row({describe(change.settings), change.why});
  return fmt::format("{}: {} candidates, to be validated on measurements held out {}\n\n{}",
                     fmt::join(t.scenarios, ", "), t.candidates.size(), held_out_text(t), table.str());
}

std::string tune_json(const Tuning& t) { return json_text(json_document("tune", tune_fields(), t)); }
FileDescription tune_json_keys() { return describe_json("summary.json", "tune", tune_fields()); }

std::string steps_csv(const Tuning& t) { return step_columns().text(t.selection.steps); }
std::vector<FileDescription> tune_file_columns() { return {step_columns().describe("steps.csv")}; }

std::string tuned_run_file(const Tuning& t, const std::vector<std::string>& scenarios) {
  std::string text = fmt::format("# {}\n# Use it by: tandem COMMAND --config FILE\ncommand: tune\nscenario: {}\n",
                                 tuned_model(t), yaml_text(scenarios.front()));
  for (const auto& [option, values] : option_values(t.selection.settings)) {
    std::vector<std::string> quoted;
    for (std::string value : values) {
      if (option == "noise-from") value = std::filesystem::absolute(value).lexically_normal().string();
      quoted.push_back(value == "true" ? value : yaml_text(value));
    }
    const bool single = t.selection.settings.contains(option);
    text += fmt::format(fmt::runtime(single ? "{}: {}\n" : "{}: [{}]\n"), option, fmt::join(quoted, ", "));
  }
  return text;
}

}  // namespace tandem

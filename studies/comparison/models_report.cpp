#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/comparison/model_scores.hpp>
#include <tandem/studies/comparison/models_report.hpp>
#include <tandem/studies/estimation/error_fields.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

using Align = TextTable::Align;

constexpr std::size_t kMaxModelRows = 20;  // rows of a summary
constexpr double kAsGood = 1.01;           // ratio to the best value up to which values are marked as best, too

/// A column of mean errors.
struct Measure {
  std::optional<std::size_t> type;  ///< index in keyframe_types; nullopt: all keyframes
  bool orientation;

  std::string keyframes() const { return type ? std::string(name(keyframe_types[*type])) : "all"; }
  std::optional<double> operator()(const ModelResult& result) const {
    const ErrorSummary& e = type ? result.errors[*type] : result.all;
    const std::optional<MeanStd>& errors = orientation ? e.orientation : e.position;
    // If some states are points without orientation, the mean over the others would be too optimistic.
    const bool whole = errors && (type || errors->n == e.compared);
    return result.solved && whole ? std::optional(errors->mean) : std::nullopt;
  }
};

std::vector<Measure> measures() {
  std::vector<Measure> all;
  for (const bool orientation : {false, true}) {
    for (std::size_t i = 0; i < keyframe_types.size(); ++i) all.push_back({i, orientation});
    all.push_back({{}, orientation});
  }
  return all;
}

std::optional<double> best(const std::vector<ModelResult>& results, const Measure& measure) {
  std::optional<double> least;
  for (const ModelResult& r : results)
    if (const auto value = measure(r); value && r.status == name(Status::converged) && (!least || *value < *least))
      least = value;
  return least;
}

/// Returns "Least position error over all keyframes: MODEL, 1.574 m", or an empty string without errors.
std::string winner(const std::vector<ModelResult>& results, const Measure& measure) {
  const auto least = best(results, measure);
  for (const ModelResult& r : results)
    if (least && measure(r) == least && r.status == name(Status::converged))
      return fmt::format("Least {} error over all keyframes: {}, {:.{}f}{}\n",
                         measure.orientation ? "orientation" : "position", r.name, *least, measure.orientation ? 2 : 3,
                         measure.orientation ? "°" : " m");
  return "";
}

/// Returns the results by their position error over all keyframes, or without errors by their scores; those without
/// either follow.
std::vector<ModelResult> ranked(std::vector<ModelResult> results) {
  const bool by_score = best_score(results).has_value();
  const auto error = [by_score](const ModelResult& r) {
    if (by_score) return r.score ? -r.score->total() : HUGE_VAL;
    return r.solved && r.all.position ? r.all.position->mean : HUGE_VAL;
  };
  std::stable_sort(results.begin(), results.end(),
                   [&](const ModelResult& a, const ModelResult& b) { return error(a) < error(b); });
  return results;
}

struct ModelRow {
  const std::string& scenario;
  const ModelResult& result;
};

constexpr const char* kGainText = "predictive log-likelihood of held-out measurements minus that of the best model";

/// Returns the log-likelihood minus that of the best model, if both are known.
std::optional<ScoreGain> to_best(const std::vector<ModelResult>& results, const ModelResult& result) {
  const auto best = best_score(results);
  return best && result.score ? std::optional(score_gain(*results[*best].score, *result.score)) : std::nullopt;
}

/// Returns a cell with a number of the result; empty if it is not valid.
template <class T>
std::function<CsvCell(const ModelRow&)> if_solved(T ModelResult::*number) {
  return [number](const ModelRow& r) { return r.result.solved ? CsvCell(r.result.*number) : CsvCell(); };
}

CsvTable<ModelRow> model_columns() {
  CsvTable<ModelRow> table;
  table.add("scenario", "name of the scenario", [](const ModelRow& r) { return r.scenario; })
      .add("model", "specification of the model, as --models takes it", [](const ModelRow& r) { return r.result.name; })
      .add("solver", "name of the solver", [](const ModelRow& r) { return r.result.solver; })
      .add("status", "converged, or why the solve ended; refused: there is no valid problem",
           [](const ModelRow& r) { return r.result.status; })
      .add("cost", "final cost; costs of different models are not comparable", if_solved(&ModelResult::cost))
      .add("violation", "largest violation of a hard constraint", if_solved(&ModelResult::violation))
      .add("iterations", "number of iterations", if_solved(&ModelResult::iterations))
      .add("seconds", "duration of the solve [s]", if_solved(&ModelResult::seconds));
  for (const Measure& m : measures())
    table.add(fmt::format("at_{}_{}", m.keyframes(), m.orientation ? "orientation_deg" : "error_m"),
              m.orientation ? "mean orientation error over the keyframes of that type, as in errors.csv [deg]"
                            : "mean position error over the keyframes of that type, as in errors.csv [m]",
              [m](const ModelRow& r) { return m(r.result); });
  table.add("score", "predictive log-likelihood of held-out measurements; empty with truth",
            [](const ModelRow& r) { return r.result.score ? CsvCell(r.result.score->total()) : CsvCell(); });
  return table.add("message", "explanation of the status", [](const ModelRow& r) { return r.result.message; });
}

template <class T>
auto json_if_solved(T ModelResult::*number) {
  return [number](const ModelResult& r) { return r.solved ? std::optional(r.*number) : std::nullopt; };
}

JsonFields<ModelResult> model_fields() {
  return JsonFields<ModelResult>()
      .add("model", "specification of the model, as --models takes it", [](const ModelResult& r) { return r.name; })
      .add("solver", "name of the solver", [](const ModelResult& r) { return r.solver; })
      .add("status", "converged, or why the solve ended; refused: there is no valid problem",
           [](const ModelResult& r) { return r.status; })
      .add("message", "explanation of the status", [](const ModelResult& r) { return r.message; })
      .add("cost", "final cost; costs of different models are not comparable", json_if_solved(&ModelResult::cost))
      .add("violation", "largest violation of a hard constraint", json_if_solved(&ModelResult::violation))
      .add("iterations", "number of iterations", json_if_solved(&ModelResult::iterations))
      .add("seconds", "duration of the solve [s]", json_if_solved(&ModelResult::seconds))
      .add_map("errors", "TYPE",
               "errors by the measurement at the keyframe: position, pose, partial, none; and at all keyframes",
               error_fields(), [](const ModelResult& r) {
                 std::vector<std::pair<std::string, ErrorSummary>> errors;
                 if (!r.solved) return errors;
                 for (std::size_t i = 0; i < keyframe_types.size(); ++i)
                   errors.emplace_back(name(keyframe_types[i]), r.errors[i]);
                 errors.emplace_back("all", r.all);
                 return errors;
               });
}

struct ScoredModel {
  std::string model;
  ScoreGain gain;
};

JsonFields<ScoredModel> score_fields() {
  return JsonFields<ScoredModel>()
      .add("model", "specification of the model", [](const ScoredModel& s) { return s.model; })
      .add("gain", kGainText, [](const ScoredModel& s) { return s.gain.gain; })
      .add("standard_error", "standard error of the gain, by blocks of time",
           [](const ScoredModel& s) { return s.gain.standard_error; });
}

struct Models {
  const std::string& scenario;
  const std::vector<ModelResult>& results;
};

JsonFields<Models> models_fields() {
  return JsonFields<Models>()
      .add("scenario", "name of the scenario", [](const Models& m) { return m.scenario; })
      .add_list("models", "results, in the order of --models", model_fields(),
                [](const Models& m) -> const std::vector<ModelResult>& { return m.results; })
      .add_list("scores", "scores without truth, the best one first; empty with truth", score_fields(),
                [](const Models& m) {
                  std::vector<ScoredModel> scores;
                  for (const ModelResult& r : ranked(m.results))
                    if (const auto gain = to_best(m.results, r)) scores.push_back({r.name, *gain});
                  return scores;
                })
      .add("recommendation", "the recommended model in one sentence; only without truth", [](const Models& m) {
        const std::string text = recommendation(m.results);
        return text.empty() ? std::nullopt : std::optional(text);
      });
}

}  // namespace

std::string models_report(const std::string& scenario, const std::vector<ModelResult>& results, bool full) {
  std::vector<Measure> columns;  // measures that have a value for at least one model
  for (const Measure& m : measures())
    if (std::any_of(results.begin(), results.end(), [&](const ModelResult& r) { return m(r).has_value(); }))
      columns.push_back(m);

  const bool scored = best_score(results).has_value();
  std::vector<TextTable::Column> heads = {{"model", Align::left}, {"status", Align::left}, {"cost"}, {"seconds"}};
  if (scored) heads.push_back({"held-out log-likelihood"});
  for (const Measure& m : columns) heads.push_back({m.keyframes() + " "});
  TextTable table(heads);
  for (const bool orientation : {false, true}) {
    std::optional<std::size_t> first, last;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (columns[i].orientation != orientation) continue;
      if (!first) first = 4 + i;
      last = 4 + i;
    }
    if (first) table.group(*first, *last, orientation ? "orientation error [°]" : "position error [m]");
  }
  std::string solvers;
  const std::size_t rows = full ? results.size() : std::min(results.size(), kMaxModelRows);
  const std::vector<ModelResult> shown = scored || rows < results.size() ? ranked(results) : results;
  for (std::size_t i = 0; i < rows; ++i) {
    const ModelResult& r = shown[i];
    if (!r.solved) {
      table.row({r.name, r.status}, r.message);
      continue;
    }
    if (solvers.find(r.solver) == std::string::npos) solvers += (solvers.empty() ? "" : ", ") + r.solver;
    std::vector<std::string> cells = {r.name, r.status, fmt::format("{:.6g}", r.cost),
                                      fmt::format("{:.3f}", r.seconds)};
    if (scored) {
      const auto gain = to_best(results, r);
      cells.push_back(gain ? fmt::format("{:+.1f} ± {:.1f}", gain->gain, gain->standard_error) : "–");
    }
    for (const Measure& m : columns) {
      const auto value = m(r), least = best(results, m);
      cells.push_back(value ? fmt::format("{:.{}f}{}", *value, m.orientation ? 2 : 3,
                                          least && *value <= kAsGood * *least ? "*" : " ")
                            : "– ");
    }
    table.row(cells);
  }
  std::string text;
  for (const Measure& m : columns)
    if (!m.type) text += winner(results, m);
  text += fmt::format("{}{}: mean errors by the measurement at the keyframe{}\n\n{}", text.empty() ? "" : "\n",
                      scenario, solvers.empty() ? "" : " (solved by " + solvers + ")", table.str());
  if (rows < results.size())
    text += fmt::format("… and {} more. All models: --full, or models.csv in --out.\n", results.size() - rows);
  for (const ModelResult& r : results)
    if (!r.why_no_score.empty()) text += fmt::format("{} has no score: {}\n", r.name, r.why_no_score);
  if (columns.empty()) text += "\nErrors are not available: they need the truth of both chaser and target.\n";
  if (scored)
    text +=
        "\nThe log-likelihood is relative to the best model, ± its standard error. Costs of different models are not "
        "comparable.\n" +
        recommendation(results) + "\n";
  if (columns.empty()) return text;
  return text + "\n* least error of the column, to 1 %. Costs of different models are not comparable.\n";
}

std::string models_csv(const std::string& scenario, const std::vector<ModelResult>& results) {
  std::vector<ModelRow> rows;
  for (const ModelResult& result : results) rows.push_back({scenario, result});
  return model_columns().text(rows);
}

std::string models_json(const std::string& scenario, const std::vector<ModelResult>& results) {
  return json_text(json_document("models", models_fields(), Models{scenario, results}));
}

FileDescription models_json_keys() { return describe_json("--json", "models", models_fields()); }

std::vector<FileDescription> models_file_columns() { return {model_columns().describe("models.csv")}; }

}  // namespace tandem

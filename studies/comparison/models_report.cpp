#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/comparison/models_report.hpp>
#include <tandem/studies/estimation/spread_text.hpp>
#include <tandem/studies/support/json_text.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

using Json = nlohmann::ordered_json;
using Align = TextTable::Align;

constexpr double kAsGood = 1.01;  // times the best: marked too, the difference says nothing

/// A column of errors.
struct Measure {
  const char* keyframes;
  ErrorSummary ModelResult::*errors;
  bool orientation;

  std::optional<double> operator()(const ModelResult& result) const {
    const ErrorSummary& e = result.*errors;
    const std::optional<MeanStd>& spread = orientation ? e.orientation : e.position;
    // Where points have no orientation, the mean over the rest would look better than it is.
    const bool whole = spread && (errors != &ModelResult::all || spread->n == e.compared);
    return result.solved && whole ? std::optional(spread->mean) : std::nullopt;
  }
};

std::vector<Measure> measures() {
  std::vector<Measure> all;
  for (const bool orientation : {false, true})
    for (const auto& [name, errors] :
         {std::pair{"usbl", &ModelResult::usbl}, std::pair{"optical", &ModelResult::optical},
          std::pair{"gated", &ModelResult::gated}, std::pair{"all", &ModelResult::all}})
      all.push_back({name, errors, orientation});
  return all;
}

std::optional<double> best(const std::vector<ModelResult>& results, const Measure& measure) {
  std::optional<double> least;
  for (const ModelResult& r : results)
    if (const auto value = measure(r); value && r.status == name(Status::converged) && (!least || *value < *least))
      least = value;
  return least;
}

/// "best position over all keyframes: MODEL, 1.574 m".
std::string winner(const std::vector<ModelResult>& results, const Measure& measure) {
  const auto least = best(results, measure);
  for (const ModelResult& r : results)
    if (least && measure(r) == least && r.status == name(Status::converged))
      return fmt::format("Least {} error over all keyframes: {}, {:.{}f}{}\n",
                         measure.orientation ? "orientation" : "position", r.name, *least, measure.orientation ? 2 : 3,
                         measure.orientation ? "°" : " m");
  return "";
}

struct ModelRow {
  const std::string& scenario;
  const ModelResult& result;
};

/// A number of a model that was solved.
template <class T>
std::function<CsvCell(const ModelRow&)> if_solved(T ModelResult::*number) {
  return [number](const ModelRow& r) { return r.result.solved ? CsvCell(r.result.*number) : CsvCell(); };
}

CsvTable<ModelRow> model_columns() {
  CsvTable<ModelRow> table;
  table.add("scenario", "its name", [](const ModelRow& r) { return r.scenario; })
      .add("model", "the words that select it", [](const ModelRow& r) { return r.result.name; })
      .add("solver", "what solved it", [](const ModelRow& r) { return r.result.solver; })
      .add("status", "converged or why it ended; refused: nothing was solved",
           [](const ModelRow& r) { return r.result.status; })
      .add("cost", "at the end; costs of different models do not compare", if_solved(&ModelResult::cost))
      .add("violation", "largest one of a hard constraint", if_solved(&ModelResult::violation))
      .add("iterations", "of the solver", if_solved(&ModelResult::iterations))
      .add("seconds", "that the solve took [s]", if_solved(&ModelResult::seconds));
  for (const Measure& m : measures())
    table.add(fmt::format("{}_{}", m.keyframes, m.orientation ? "orientation_error_deg" : "position_error_m"),
              m.orientation ? "mean over the keyframes of that type, or all, as in errors.csv [deg]"
                            : "mean over the keyframes of that type, or all, as in errors.csv [m]",
              [m](const ModelRow& r) { return m(r.result); });
  return table.add("message", "a sentence", [](const ModelRow& r) { return r.result.message; });
}

}  // namespace

std::string models_report(const std::string& scenario, const std::vector<ModelResult>& results) {
  std::vector<Measure> columns;  // those that some model has
  for (const Measure& m : measures())
    if (std::any_of(results.begin(), results.end(), [&](const ModelResult& r) { return m(r).has_value(); }))
      columns.push_back(m);

  std::vector<TextTable::Column> heads = {{"model", Align::left}, {"status", Align::left}, {"cost"}, {"seconds"}};
  for (const Measure& m : columns) heads.push_back({std::string(m.keyframes) + " "});
  TextTable table(heads);
  for (const bool orientation : {false, true}) {
    std::optional<std::size_t> first, last;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (columns[i].orientation != orientation) continue;
      if (!first) first = 4 + i;
      last = 4 + i;
    }
    if (first) table.group(*first, *last, orientation ? "orientation [°]" : "position [m]");
  }
  std::string solvers;
  for (const ModelResult& r : results) {
    if (!r.solved) {
      table.row({r.name, r.status}, r.message);
      continue;
    }
    if (solvers.find(r.solver) == std::string::npos) solvers += (solvers.empty() ? "" : ", ") + r.solver;
    std::vector<std::string> cells = {r.name, r.status, fmt::format("{:.6g}", r.cost),
                                      fmt::format("{:.3f}", r.seconds)};
    for (const Measure& m : columns) {
      const auto value = m(r), least = best(results, m);
      cells.push_back(value ? fmt::format("{:.{}f}{}", *value, m.orientation ? 2 : 3,
                                          least && *value <= kAsGood * *least ? "*" : " ")
                            : "– ");
    }
    table.row(cells);
  }
  std::string text = fmt::format("{}: mean errors by keyframe type{}\n\n{}", scenario,
                                 solvers.empty() ? "" : " (solved by " + solvers + ")", table.str());
  if (columns.empty()) return text + "\nThere is no truth to compare with.\n";
  text += "\n* least error of the column, to 1 %. Costs of different models do not compare.\n";
  for (const Measure& m : columns)
    if (m.errors == &ModelResult::all) text += winner(results, m);
  return text;
}

std::string models_csv(const std::string& scenario, const std::vector<ModelResult>& results) {
  std::vector<ModelRow> rows;
  for (const ModelResult& result : results) rows.push_back({scenario, result});
  return model_columns().text(rows);
}

std::string models_json(const std::string& scenario, const std::vector<ModelResult>& results) {
  Json json = {{"scenario", scenario}, {"models", Json::array()}};
  for (const ModelResult& r : results) {
    Json row = {{"model", r.name}, {"solver", r.solver}, {"status", r.status}, {"message", r.message}};
    if (r.solved) {
      row["cost"] = r.cost;
      row["violation"] = r.violation;
      row["iterations"] = r.iterations;
      row["seconds"] = r.seconds;
      row["errors"] = {{"usbl", errors_json(r.usbl)},
                       {"optical", errors_json(r.optical)},
                       {"gated", errors_json(r.gated)},
                       {"all", errors_json(r.all)}};
    }
    json["models"].push_back(row);
  }
  return json_text(json);
}

std::vector<CsvDescription> models_file_columns() { return {model_columns().describe("models.csv")}; }

}  // namespace tandem

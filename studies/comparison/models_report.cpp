#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/comparison/models_report.hpp>
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
  bool angle;

  std::optional<double> operator()(const ModelResult& result) const {
    const ErrorSummary& e = result.*errors;
    const std::optional<MeanStd>& spread = angle ? e.angle : e.position;
    // Where points have no orientation, the mean over the rest would look better than it is.
    const bool whole = spread && (errors != &ModelResult::all || spread->n == e.compared);
    return result.solved && whole ? std::optional(spread->mean) : std::nullopt;
  }
};

std::vector<Measure> measures() {
  std::vector<Measure> all;
  for (const bool angle : {false, true})
    for (const auto& [name, errors] :
         {std::pair{"usbl", &ModelResult::usbl}, std::pair{"optical", &ModelResult::optical},
          std::pair{"gated", &ModelResult::gated}, std::pair{"all", &ModelResult::all}})
      all.push_back({name, errors, angle});
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
                         measure.angle ? "orientation" : "position", r.name, *least, measure.angle ? 2 : 3,
                         measure.angle ? "°" : " m");
  return "";
}

Json errors_json(const ErrorSummary& errors) {
  Json json = {{"n", errors.n}};
  if (errors.position) json["position_mean_m"] = errors.position->mean, json["position_std_m"] = errors.position->std;
  if (errors.angle) json["angle_mean_deg"] = errors.angle->mean, json["angle_std_deg"] = errors.angle->std;
  return json;
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
  for (const bool angle : {false, true}) {
    std::optional<std::size_t> first, last;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (columns[i].angle != angle) continue;
      if (!first) first = 4 + i;
      last = 4 + i;
    }
    if (first) table.group(*first, *last, angle ? "orientation [°]" : "position [m]");
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
      cells.push_back(
          value ? fmt::format("{:.{}f}{}", *value, m.angle ? 2 : 3, least && *value <= kAsGood * *least ? "*" : " ")
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
  std::string text = "scenario,model,solver,status,cost,violation,iterations,seconds";
  for (const Measure& m : measures())
    text += fmt::format(",{}_{}", m.keyframes, m.angle ? "angle_error_deg" : "position_error_m");
  text += ",message\n";
  for (const ModelResult& r : results) {
    text += fmt::format("{},{},{},{}", csv_field(scenario), csv_field(r.name), r.solver, r.status);
    text += r.solved ? fmt::format(",{},{},{},{}", r.cost, r.violation, r.iterations, r.seconds) : ",,,,";
    for (const Measure& m : measures()) {
      const auto value = m(r);
      text += value ? fmt::format(",{}", *value) : ",";
    }
    text += "," + csv_field(r.message) + "\n";
  }
  return text;
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
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace tandem

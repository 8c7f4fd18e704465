#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/comparison/compare_report.hpp>
#include <tandem/studies/support/json_text.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

using Json = nlohmann::ordered_json;
using Align = TextTable::Align;

constexpr double kFeasible = 1e-6;  // in the constraints' own units
constexpr double kSameCost = 1e-6;  // relatively
constexpr double kAsLow = 1e-8;     // relatively: as low as the best, within the constraints' tolerance

bool holds(const ComparedSolve& s) {
  return s.solved && std::isfinite(s.cost) && (s.role != Role::hard || s.violation <= kFeasible);
}

double above(const ComparedSolve& s, double best) { return (s.cost - best) / std::max(std::abs(best), 1e-12); }

/// The fastest of those that converged to the best cost.
const ComparedSolve* fastest(const std::vector<ComparedSolve>& solves, std::optional<double> best) {
  const ComparedSolve* result = nullptr;
  for (const ComparedSolve& s : solves)
    if (holds(s) && s.converged() && above(s, *best) <= kSameCost && (!result || s.seconds < result->seconds))
      result = &s;
  return result;
}

std::string shown(const std::optional<double>& value, int decimals) {
  return value ? fmt::format("{:.{}f}", *value, decimals) : "–";
}

std::string above_shown(const ComparedSolve& s, std::optional<double> best) {
  if (!best || !holds(s)) return "–";
  const double by = above(s, *best);
  return by < kAsLow ? "best" : fmt::format("{:.0e}", by);
}

/// Decimals that show a number to eight digits, so that all costs of a table have the same.
int decimals(double value) {
  const int before = value > 1 ? static_cast<int>(std::log10(value)) + 1 : 1;
  return std::clamp(8 - before, 0, 7);
}

/// "takes no hard equalities, …": without the solver's name, which stands beside it, and without advice.
std::string reason(const ComparedSolve& s) {
  std::string text = s.message;
  if (text.starts_with(s.solver + " ")) text.erase(0, s.solver.size() + 1);
  if (const std::size_t advice = text.find(": use "); advice != std::string::npos) text.erase(advice);
  return text;
}

std::string title(const std::vector<ComparedSolve>& solves, bool first_keyframes) {
  const ComparedSolve& s = solves.front();
  const std::string keyframes = fmt::format("{} {} keyframes", first_keyframes ? "first" : "all", s.keyframes);
  if (s.role == Role::off) return keyframes + ", no constraints";
  std::string text = fmt::format("{}, {} constraints", keyframes, constraints_name(s.role));
  if (s.role == Role::hard) return text;
  const auto best = std::min_element(solves.begin(), solves.end(), [](const auto& a, const auto& b) {
    return (holds(a) ? a.cost : HUGE_VAL) < (holds(b) ? b.cost : HUGE_VAL);
  });
  return holds(*best) ? text + fmt::format(" (at the best, {:.3g} of the cost is theirs)", best->constraint_cost)
                      : text;
}

std::string table(const std::vector<ComparedSolve>& solves) {
  TextTable table({{"solver", Align::left},
                   {"status", Align::left},
                   {"cost"},
                   {"above best"},
                   {"violation"},
                   {"iterations"},
                   {"evaluations"},
                   {"seconds "},
                   {"MB"},
                   {"position [m]"},
                   {"heading [°]"}});
  const std::optional<double> best = best_cost(solves);
  const ComparedSolve* const winner = best ? fastest(solves, best) : nullptr;
  const int cost_decimals = decimals(best.value_or(1)), time_decimals = winner && winner->seconds < 0.01 ? 4 : 3;
  for (const ComparedSolve& s : solves) {
    if (!s.solved) {
      table.row({s.solver, s.status}, reason(s));
      continue;
    }
    table.row({s.solver, s.status, fmt::format("{:.{}f}", s.cost, cost_decimals), above_shown(s, best),
               fmt::format("{:.1e}", s.violation), fmt::format("{}", s.iterations), fmt::format("{}", s.evaluations),
               fmt::format("{:.{}f}{}", s.seconds, time_decimals, &s == winner ? "*" : " "),
               s.peak_memory > 0 ? fmt::format("{:.0f}", s.peak_memory * 1e-6) : "–", shown(s.position, 3),
               shown(s.heading, 2)});
  }
  return table.str();
}

Json json_of(const ComparedSolve& s) {
  Json json = {{"keyframes", s.keyframes},
               {"constraints", constraints_name(s.role)},
               {"solver", s.solver},
               {"status", s.status},
               {"message", s.message}};
  if (s.solved) {
    json["initial_cost"] = s.initial_cost;
    json["cost"] = s.cost;
    json["constraint_cost"] = s.constraint_cost;
    json["violation"] = s.violation;
    json["iterations"] = s.iterations;
    json["evaluations"] = s.evaluations;
    json["seconds"] = s.seconds;
    if (s.position) json["position_error_m"] = *s.position;
    if (s.heading) json["heading_error_deg"] = *s.heading;
  }
  if (s.peak_memory > 0) json["peak_memory_bytes"] = s.peak_memory;
  return json;
}

struct SolveRow {
  const std::string& scenario;
  const ComparedSolve& solve;
};

/// A number of a solver that took the problem.
template <class T>
std::function<CsvCell(const SolveRow&)> if_solved(T ComparedSolve::*number) {
  return [number](const SolveRow& r) { return r.solve.solved ? CsvCell(r.solve.*number) : CsvCell(); };
}

CsvTable<SolveRow> solve_columns() {
  return CsvTable<SolveRow>()
      .add("scenario", "its name", [](const SolveRow& r) { return r.scenario; })
      .add("keyframes", "of the problem", [](const SolveRow& r) { return r.solve.keyframes; })
      .add("constraints", "none, soft or hard", [](const SolveRow& r) { return constraints_name(r.solve.role); })
      .add("solver", "its name", [](const SolveRow& r) { return r.solve.solver; })
      .add("status", "converged or why it ended; without numbers if unsupported, crashed, or not finite",
           [](const SolveRow& r) { return r.solve.status; })
      .add("initial_cost", "at the start, which all have in common", if_solved(&ComparedSolve::initial_cost))
      .add("cost", "at the end, soft constraints included", if_solved(&ComparedSolve::cost))
      .add("constraint_cost", "of it, what soft constraints cost", if_solved(&ComparedSolve::constraint_cost))
      .add("violation", "largest one of the constraints, held or not [m/s, rad/s, rad]",
           if_solved(&ComparedSolve::violation))
      .add("iterations", "of the solver", if_solved(&ComparedSolve::iterations))
      .add("evaluations", "of the cost", if_solved(&ComparedSolve::evaluations))
      .add("seconds", "that the solve took [s]", if_solved(&ComparedSolve::seconds))
      .add("peak_memory_bytes", "largest resident set of its process; 0 where not known",
           [](const SolveRow& r) { return std::llround(r.solve.peak_memory); })
      .add("position_error_m", "mean over the keyframes that the truth covers [m]",
           [](const SolveRow& r) { return r.solve.position; })
      .add("heading_error_deg", "mean size of the error of the relative heading: about the vertical [deg]",
           [](const SolveRow& r) { return r.solve.heading; })
      .add("message", "a sentence", [](const SolveRow& r) { return r.solve.message; });
}

struct ProgressRow {
  const ComparedSolve& solve;
  const CurvePoint& point;
};

CsvTable<ProgressRow> progress_columns() {
  return CsvTable<ProgressRow>()
      .add("keyframes", "of the problem", [](const ProgressRow& r) { return r.solve.keyframes; })
      .add("constraints", "none, soft or hard", [](const ProgressRow& r) { return constraints_name(r.solve.role); })
      .add("solver", "its name", [](const ProgressRow& r) { return r.solve.solver; })
      .add("seconds", "since its start [s]", [](const ProgressRow& r) { return r.point.seconds; })
      .add("cost", "at that time", [](const ProgressRow& r) { return r.point.cost; })
      .add("violation", "at that time, as the solver sees it", [](const ProgressRow& r) { return r.point.violation; });
}

}  // namespace

std::vector<std::vector<ComparedSolve>> by_problem(const Comparison& comparison) {
  std::vector<std::vector<ComparedSolve>> problems;
  for (const ComparedSolve& s : comparison.solves) {
    if (problems.empty() || problems.back().front().role != s.role || problems.back().front().keyframes != s.keyframes)
      problems.emplace_back();
    problems.back().push_back(s);
  }
  return problems;
}

std::optional<double> best_cost(const std::vector<ComparedSolve>& solves) {
  std::optional<double> best;
  for (const ComparedSolve& s : solves)
    if (holds(s) && (!best || s.cost < *best)) best = s.cost;
  return best;
}

std::string report(const Comparison& comparison) {
  std::string text = fmt::format(
      "{}, mode {}. Constraints: {}.\nEach solve has a process of its own, the same start and at most {:g} s.\n",
      comparison.scenario, name(comparison.mode), describe(comparison.constraints), comparison.time_limit);
  std::size_t most = 0;
  for (const ComparedSolve& s : comparison.solves) most = std::max(most, s.keyframes);
  bool marked = false;
  for (const std::vector<ComparedSolve>& solves : by_problem(comparison)) {
    text += "\n" + title(solves, solves.front().keyframes < most) + "\n" + table(solves);
    const auto best = best_cost(solves);
    marked = marked || (best && fastest(solves, best));
  }
  if (marked)
    text += fmt::format("\nbest: the least cost, to {:.0e} of it; *: the fastest that converged to it, to {:.0e}\n",
                        kAsLow, kSameCost);
  return text;
}

std::string compare_csv(const Comparison& comparison) {
  std::vector<SolveRow> rows;
  for (const ComparedSolve& s : comparison.solves) rows.push_back({comparison.scenario, s});
  return solve_columns().text(rows);
}

std::string progress_csv(const Comparison& comparison) {
  std::vector<ProgressRow> rows;
  for (const ComparedSolve& s : comparison.solves)
    for (const CurvePoint& p : s.curve) rows.push_back({s, p});
  return progress_columns().text(rows);
}

std::vector<CsvDescription> compare_file_columns() {
  return {solve_columns().describe("compare.csv"), progress_columns().describe("compare_progress.csv")};
}

std::string compare_json(const Comparison& comparison) {
  Json json = {{"scenario", comparison.scenario},
               {"mode", name(comparison.mode)},
               {"constraints", describe(comparison.constraints)},
               {"time_limit", comparison.time_limit},
               {"solves", Json::array()}};
  for (const ComparedSolve& s : comparison.solves) json["solves"].push_back(json_of(s));
  return json_text(json);
}

}  // namespace tandem

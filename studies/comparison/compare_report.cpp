#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include <fmt/format.h>

#include <tandem/studies/comparison/compare_report.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

using Align = TextTable::Align;

constexpr std::size_t kMaxRows = 15;  // Rows of a summary.
constexpr double kFeasible = 1e-6;    // Largest violation, in the units of the constraints.
constexpr double kSameCost = 1e-6;  // Solvers are ranked by time if their costs exceed the best one by less (relative).
constexpr double kBest = 1e-8;      // A cost is shown as "best" if it exceeds the best one by less (relative).

/// Returns whether the solve has a finite cost and satisfies its hard constraints.
bool is_feasible(const ComparedSolve& s) {
  return s.solved && std::isfinite(s.cost) && (s.role != Role::hard || s.violation <= kFeasible);
}

/// Returns the relative difference from the best cost.
double above(const ComparedSolve& s, double best) { return (s.cost - best) / std::max(std::abs(best), 1e-12); }

bool reaches(const ComparedSolve& s, double best) {
  return is_feasible(s) && s.converged() && above(s, best) <= kSameCost;
}

/// Returns the fastest solve that converged to the best cost, or null.
const ComparedSolve* fastest(const std::vector<ComparedSolve>& solves, std::optional<double> best) {
  const ComparedSolve* result = nullptr;
  for (const ComparedSolve& s : solves)
    if (best && reaches(s, *best) && (!result || s.seconds < result->seconds)) result = &s;
  return result;
}

std::string shown(const std::optional<double>& value, int decimals) {
  return value ? fmt::format("{:.{}f}", *value, decimals) : "–";
}

std::string above_shown(const ComparedSolve& s, std::optional<double> best) {
  if (!best || !is_feasible(s)) return "–";
  const double by = above(s, *best);
  return by < kBest ? "best" : fmt::format("{:.0e}", by);
}

/// Returns the number of decimals with which a value has eight significant digits.
int decimals(double value) {
  const int before = value > 1 ? static_cast<int>(std::log10(value)) + 1 : 1;
  return std::clamp(8 - before, 0, 7);
}

/// Returns the message without the solver's name, which is in another column, and without advice.
std::string reason(const ComparedSolve& s) {
  std::string text = s.message;
  if (text.starts_with(s.solver + " ")) text.erase(0, s.solver.size() + 1);
  if (const std::size_t advice = text.find(": use "); advice != std::string::npos) text.erase(advice);
  return text;
}

std::string title(const std::vector<ComparedSolve>& solves, bool first_keyframes) {
  const ComparedSolve& s = solves.front();
  const std::string keyframes = fmt::format("{}{} keyframes", first_keyframes ? "first " : "", s.keyframes);
  if (s.role == Role::off) return keyframes + ", no constraints";
  std::string text = fmt::format("{}, {} constraints", keyframes, constraints_name(s.role));
  if (s.role == Role::hard) return text;
  const auto best = std::min_element(solves.begin(), solves.end(), [](const auto& a, const auto& b) {
    return (is_feasible(a) ? a.cost : HUGE_VAL) < (is_feasible(b) ? b.cost : HUGE_VAL);
  });
  return is_feasible(*best)
             ? text + fmt::format(" (cost of the constraints at the best solution: {:.3g})", best->constraint_cost)
             : text;
}

/// Returns the solves in the order of a summary: those that reach the best cost by their time, then the others by cost.
std::vector<ComparedSolve> ranked(std::vector<ComparedSolve> solves) {
  const std::optional<double> best = best_cost(solves);
  const auto rank = [best](const ComparedSolve& s) {
    if (!best || !is_feasible(s)) return std::tuple(3, s.solved ? s.cost : HUGE_VAL);
    if (above(s, *best) > kSameCost) return std::tuple(2, s.cost);
    return std::tuple(s.converged() ? 0 : 1, s.seconds);
  };
  std::stable_sort(solves.begin(), solves.end(),
                   [&](const ComparedSolve& a, const ComparedSolve& b) { return rank(a) < rank(b); });
  return solves;
}

/// Returns for example "augmented-lagrangian: fastest of 5 solvers that converged to the least cost, 0.080 s".
std::string conclusion(const std::vector<ComparedSolve>& solves) {
  const std::optional<double> best = best_cost(solves);
  const ComparedSolve* const winner = best ? fastest(solves, best) : nullptr;
  if (!winner) {
    const bool any = std::any_of(solves.begin(), solves.end(), [](const ComparedSolve& s) { return s.converged(); });
    return any ? "no solver converged to the least cost" : "no solver converged";
  }
  const auto n = std::count_if(solves.begin(), solves.end(), [&](const ComparedSolve& s) { return reaches(s, *best); });
  if (n == 1)
    return fmt::format("{}: the only solver that converged to the least cost, {:.2g} s", winner->solver,
                       winner->seconds);
  return fmt::format("{}: fastest of {} solvers that converged to the least cost, {:.2g} s", winner->solver, n,
                     winner->seconds);
}

/// Returns one sentence that names the solver which converges to the least cost of most problems, the fastest of them;
/// empty if none converges.
std::string recommendation(const Comparison& comparison) {
  const std::vector<std::vector<ComparedSolve>> problems = by_problem(comparison);
  std::map<std::string, std::pair<std::size_t, double>> reached;  // number of problems, seconds
  for (const std::vector<ComparedSolve>& solves : problems) {
    const std::optional<double> best = best_cost(solves);
    for (const ComparedSolve& s : solves) {
      if (!best || !reaches(s, *best)) continue;
      auto& [count, seconds] = reached[s.solver];
      ++count;
      seconds += s.seconds;
    }
  }
  const auto best = std::min_element(reached.begin(), reached.end(), [](const auto& a, const auto& b) {
    return std::pair(b.second.first, a.second.second) < std::pair(a.second.first, b.second.second);
  });
  if (best == reached.end()) return "";
  const auto& [count, seconds] = best->second;
  return fmt::format("Recommended: {}. It converges to the least cost {}, in {:.2g} s{}.", best->first,
                     problems.size() == 1       ? "known"
                     : count == problems.size() ? fmt::format("of all {} problems", count)
                                                : fmt::format("of {} of {} problems", count, problems.size()),
                     seconds, count > 1 ? " together" : "");
}

/// Returns the table of the first `rows` solves. `all` are the solves of the problem.
std::string table(const std::vector<ComparedSolve>& all, const std::vector<ComparedSolve>& solves, std::size_t rows) {
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
  const std::optional<double> best = best_cost(all);
  const ComparedSolve* const winner = best ? fastest(solves, best) : nullptr;
  const int cost_decimals = decimals(best.value_or(1)), time_decimals = winner && winner->seconds < 0.01 ? 4 : 3;
  for (const ComparedSolve& s : solves) {
    if (rows-- == 0) break;
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

struct SolveRow {
  const std::string& scenario;
  const ComparedSolve& solve;
};

/// Returns a cell with a number of the solve; empty if it has no valid result.
template <class T>
std::function<CsvCell(const SolveRow&)> if_solved(T ComparedSolve::*number) {
  return [number](const SolveRow& r) { return r.solve.solved ? CsvCell(r.solve.*number) : CsvCell(); };
}

CsvTable<SolveRow> solve_columns() {
  return CsvTable<SolveRow>()
      .add("scenario", "name of the scenario", [](const SolveRow& r) { return r.scenario; })
      .add("keyframes", "number of keyframes of the problem", [](const SolveRow& r) { return r.solve.keyframes; })
      .add("constraints", "off, soft or hard", [](const SolveRow& r) { return constraints_name(r.solve.role); })
      .add("solver", "name of the solver", [](const SolveRow& r) { return r.solve.solver; })
      .add("status",
           "converged, or why the solve ended; the numbers are empty if it is unsupported, crashed or not finite",
           [](const SolveRow& r) { return r.solve.status; })
      .add("initial_cost", "cost of the initial guess, the same for all solvers",
           if_solved(&ComparedSolve::initial_cost))
      .add("cost", "final cost, including soft constraints", if_solved(&ComparedSolve::cost))
      .add("constraint_cost", "part of the cost due to soft constraints", if_solved(&ComparedSolve::constraint_cost))
      .add("violation", "largest violation of the constraints, also if they are off [m/s, rad/s, rad]",
           if_solved(&ComparedSolve::violation))
      .add("iterations", "number of iterations", if_solved(&ComparedSolve::iterations))
      .add("evaluations", "number of evaluations of the cost", if_solved(&ComparedSolve::evaluations))
      .add("seconds", "duration of the solve [s]", if_solved(&ComparedSolve::seconds))
      .add("peak_memory_bytes", "peak resident memory of the process; 0 if unknown",
           [](const SolveRow& r) { return std::llround(r.solve.peak_memory); })
      .add("position_error_m", "mean error of the relative position over the keyframes that the truth covers [m]",
           [](const SolveRow& r) { return r.solve.position; })
      .add("heading_error_deg", "mean absolute error of the relative heading, about the vertical [deg]",
           [](const SolveRow& r) { return r.solve.heading; })
      .add("message", "explanation of the status", [](const SolveRow& r) { return r.solve.message; });
}

struct ProgressRow {
  const ComparedSolve& solve;
  const CurvePoint& point;
};

CsvTable<ProgressRow> progress_columns() {
  return CsvTable<ProgressRow>()
      .add("keyframes", "number of keyframes of the problem", [](const ProgressRow& r) { return r.solve.keyframes; })
      .add("constraints", "off, soft or hard", [](const ProgressRow& r) { return constraints_name(r.solve.role); })
      .add("solver", "name of the solver", [](const ProgressRow& r) { return r.solve.solver; })
      .add("seconds", "time since the start of the solve [s]", [](const ProgressRow& r) { return r.point.seconds; })
      .add("cost", "cost at that time", [](const ProgressRow& r) { return r.point.cost; })
      .add("violation", "largest violation of hard constraints at that time",
           [](const ProgressRow& r) { return r.point.violation; });
}

template <class T>
auto json_if_solved(T ComparedSolve::*number) {
  return [number](const ComparedSolve& s) { return s.solved ? std::optional(s.*number) : std::nullopt; };
}

JsonFields<ComparedSolve> solve_fields() {
  using S = ComparedSolve;
  return JsonFields<S>()
      .add("keyframes", "number of keyframes of the problem", [](const S& s) { return s.keyframes; })
      .add("constraints", "off, soft or hard", [](const S& s) { return constraints_name(s.role); })
      .add("solver", "name of the solver", [](const S& s) { return s.solver; })
      .add("status",
           "converged, or why the solve ended; there are no numbers if it is unsupported, crashed or not finite",
           [](const S& s) { return s.status; })
      .add("message", "explanation of the status", [](const S& s) { return s.message; })
      .add("initial_cost", "cost of the initial guess, the same for all solvers", json_if_solved(&S::initial_cost))
      .add("cost", "final cost, including soft constraints", json_if_solved(&S::cost))
      .add("constraint_cost", "part of the cost due to soft constraints", json_if_solved(&S::constraint_cost))
      .add("violation", "largest violation of the constraints, also if they are off [m/s, rad/s, rad]",
           json_if_solved(&S::violation))
      .add("iterations", "number of iterations", json_if_solved(&S::iterations))
      .add("evaluations", "number of evaluations of the cost", json_if_solved(&S::evaluations))
      .add("seconds", "duration of the solve [s]", json_if_solved(&S::seconds))
      .add("position_error_m", "mean error of the relative position over the keyframes that the truth covers [m]",
           [](const S& s) { return s.solved ? s.position : std::nullopt; })
      .add("heading_error_deg", "mean absolute error of the relative heading, about the vertical [deg]",
           [](const S& s) { return s.solved ? s.heading : std::nullopt; })
      .add("peak_memory_bytes", "peak resident memory of the process, if known",
           [](const S& s) { return s.peak_memory > 0 ? std::optional(s.peak_memory) : std::nullopt; });
}

JsonFields<Comparison> comparison_fields() {
  using C = Comparison;
  return JsonFields<C>()
      .add("scenario", "name of the scenario", [](const C& c) { return c.scenario; })
      .add("mode", "A or B", [](const C& c) { return name(c.mode); })
      .add("constraints", "constraints of the soft and hard problems",
           [](const C& c) { return describe(c.constraints); })
      .add("time_limit", "time limit of each solve [s]", [](const C& c) { return c.time_limit; })
      .add_list("solves", "all solves; those of one problem are consecutive", solve_fields(),
                [](const C& c) -> const std::vector<ComparedSolve>& { return c.solves; })
      .add("recommendation", "the recommended solver in one sentence, if one converges", [](const C& c) {
        const std::string text = recommendation(c);
        return text.empty() ? std::nullopt : std::optional(text);
      });
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
    if (is_feasible(s) && (!best || s.cost < *best)) best = s.cost;
  return best;
}

std::string report(const Comparison& comparison, bool full) {
  const std::vector<std::vector<ComparedSolve>> problems = by_problem(comparison);
  std::size_t most = 0;
  for (const ComparedSolve& s : comparison.solves) most = std::max(most, s.keyframes);
  std::string text;
  for (const std::vector<ComparedSolve>& solves : problems) {
    const std::string problem = title(solves, solves.front().keyframes < most);
    if (problems.size() > 1) text += problem.substr(0, problem.find(" (")) + ": ";
    text += conclusion(solves) + "\n";
  }
  text += fmt::format(
      "\n{}, mode {}. Constraints: {}.\nEach solve runs in its own process, from the same initial guess, for at most "
      "{:g} s.\n",
      comparison.scenario, name(comparison.mode), describe(comparison.constraints), comparison.time_limit);
  const bool summary = !full && comparison.solves.size() > kMaxRows;
  const std::size_t rows = summary ? std::max<std::size_t>(2, kMaxRows / problems.size()) : comparison.solves.size();
  bool marked = false;
  for (const std::vector<ComparedSolve>& solves : problems) {
    text += "\n" + title(solves, solves.front().keyframes < most) + "\n" +
            table(solves, summary ? ranked(solves) : solves, rows);
    if (solves.size() > rows) text += fmt::format("… and {} more\n", solves.size() - rows);
    const auto best = best_cost(solves);
    marked = marked || (best && fastest(solves, best));
  }
  if (marked)
    text += fmt::format(
        "\nbest: least cost (relative tolerance {:.0e}); *: fastest solver that converged to it (tolerance {:.0e})\n",
        kBest, kSameCost);
  if (summary) text += "All solves: --full, or compare.csv in --out.\n";
  if (const std::string sentence = recommendation(comparison); !sentence.empty()) text += sentence + "\n";
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

std::vector<FileDescription> compare_file_columns() {
  return {solve_columns().describe("compare.csv"), progress_columns().describe("compare_progress.csv")};
}

std::string compare_json(const Comparison& comparison) {
  return json_text(json_document("compare", comparison_fields(), comparison));
}

FileDescription compare_json_keys() { return describe_json("--json", "compare", comparison_fields()); }

}  // namespace tandem

#pragma once

#include <string>
#include <vector>

#include <tandem/studies/comparison/compare.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// All solves of a comparison. Solves of the same problem are consecutive.
struct Comparison {
  std::string scenario;
  Mode mode = Mode::A;
  TargetConstraints constraints;
  double time_limit = 60;  ///< s
  std::vector<ComparedSolve> solves;
};

/// Returns a report for a terminal: the fastest solver that converged to the best cost of each problem, and a table per
/// problem. The tables have about 15 rows in all, the best solves first, or all rows with `full`.
std::string report(const Comparison& comparison, bool full = false);
/// Returns the contents of compare.csv: one row per solve, with full precision.
std::string compare_csv(const Comparison& comparison);
/// Returns the contents of compare_progress.csv: cost and violation over time of each solve.
std::string progress_csv(const Comparison& comparison);
/// Returns all results as JSON, for --json.
std::string compare_json(const Comparison& comparison);
/// Returns the keys of that JSON document.
FileDescription compare_json_keys();
/// Returns the columns of both files, for documentation.
std::vector<FileDescription> compare_file_columns();

/// Groups the solves by problem.
std::vector<std::vector<ComparedSolve>> by_problem(const Comparison& comparison);
/// Returns the least cost of all solves, converged or not. Hard constraints must be satisfied to 1e-6. Nothing if no
/// solve qualifies.
std::optional<double> best_cost(const std::vector<ComparedSolve>& solves);

}  // namespace tandem

#pragma once

#include <string>
#include <vector>

#include <tandem/studies/comparison/compare.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// All solves of one comparison, in the order they were run: those of one problem stand together.
struct Comparison {
  std::string scenario;
  Mode mode = Mode::A;
  TargetConstraints constraints;
  double time_limit = 60;  ///< s
  std::vector<ComparedSolve> solves;
};

/// For a terminal: a table each problem, the fastest of those that reached its best cost marked.
std::string report(const Comparison& comparison);
/// One row a solve, numbers to the last digit.
std::string compare_csv(const Comparison& comparison);
/// scenario, keyframes, constraints, solver, seconds, cost, violation along each solve.
std::string progress_csv(const Comparison& comparison);
std::string compare_json(const Comparison& comparison);
/// The columns of both files, for documents.
std::vector<CsvDescription> compare_file_columns();

/// Consecutive solves of one problem.
std::vector<std::vector<ComparedSolve>> by_problem(const Comparison& comparison);
/// The least cost of those that hold the constraints when hard (to 1e-6), whether converged or not; none: nothing.
std::optional<double> best_cost(const std::vector<ComparedSolve>& solves);

}  // namespace tandem

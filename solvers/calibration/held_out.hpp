#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <tandem/problem/function_ref.hpp>
#include <tandem/solvers/calibration/cross_validation.hpp>

namespace tandem::detail {

inline constexpr const char* kHeldOutTask = "held-out measurements";  // name of the task for Stop

/// Holds out the measurements of a fold by multiplying their noise by 10⁵. Sets `noise` to their previous noise.
void hold_out(std::span<Problem* const> problems, const std::vector<HeldOutMeasurement>& fold,
              std::vector<Gaussian>& noise);

/// Return the measurements or the noise rows with handles of the same blocks in `problems`, which were built by the
/// same calls.
template <class T>
std::vector<T> counterparts(std::span<Problem* const> problems, std::vector<T> all) {
  for (T& m : all) m.block = problem_at(problems, m.problem).counterpart(m.block);
  return all;
}
inline std::vector<NoiseGroup> counterparts(std::span<Problem* const> problems, std::vector<NoiseGroup> groups) {
  for (NoiseGroup& group : groups) group.rows = counterparts(problems, std::move(group.rows));
  return groups;
}

/// Solves problems by solve(index). Returns the summary of the first one that cannot be solved. Throws Stopped.
std::optional<Summary> solve_all(std::size_t count, const Stop& stop, FunctionRef<Summary(std::size_t index)> solve);
/// Solves the problems by `options.solve` or the default solver.
std::optional<Summary> solve_all(std::span<Problem* const> problems, const CalibrationOptions& options);

/// Predicts the scored measurements of fold number f at the solution of the problems. `noise` is the noise of the
/// measurements before they were held out. Throws Stopped.
std::vector<HeldOutPrediction> predictions(std::span<Problem* const> problems,
                                           const std::vector<HeldOutMeasurement>& fold, std::size_t f,
                                           const std::vector<Gaussian>& noise, const Stop& stop);

/// Returns the log-likelihood of the predictions b minus the log-likelihood of the predictions a.
double log_likelihood_gain(const std::vector<HeldOutPrediction>& a, const std::vector<HeldOutPrediction>& b);

/// Returns the standard error of the sum of the gains, from their sample variance; 0 for fewer than two.
double standard_error_of_sum(const std::vector<double>& gains);

}  // namespace tandem::detail

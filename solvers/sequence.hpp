#pragma once

#include <algorithm>
#include <chrono>
#include <utility>

#include <tandem/solvers/summary.hpp>

namespace tandem::detail {

/// Combines several solves: remaining limits, and sums of iterations and times.
class Sequence {
 public:
  explicit Sequence(const SolverOptions& options) : options_(options) {}

  /// Returns the options of the next solve, with what remains of the limits.
  SolverOptions limits() const {
    SolverOptions left = options_;
    left.max_iterations = std::max(0, options_.max_iterations - sum_.iterations);
    left.time_limit = options_.time_limit - seconds();
    if (options_.progress)
      left.progress = [this, before = sum_.iterations](Progress p) {
        p.iteration += before;
        p.seconds = seconds();
        options_.progress(p);
      };
    return left;
  }
  /// Returns whether no further solve is allowed after one that ended as `last`.
  bool is_over(Status last) const {
    return last == Status::interrupted || last == Status::time_limit || last == Status::unsupported ||
           sum_.iterations >= options_.max_iterations;
  }
  /// Adds the summary of a solve and returns it with the sums so far.
  const Summary& add(Summary s, double initial_cost) {
    s.initial_cost = initial_cost;
    s.iterations += sum_.iterations;
    s.evaluations += sum_.evaluations;
    s.evaluation_seconds += sum_.evaluation_seconds;
    s.linear_solver_seconds += sum_.linear_solver_seconds;
    s.seconds = seconds();
    return sum_ = std::move(s);
  }
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  const SolverOptions& options_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  Summary sum_;
};

}  // namespace tandem::detail

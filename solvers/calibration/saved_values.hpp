#pragma once

#include <tandem/problem/problem_data.hpp>

namespace tandem::detail {

/// A copy of the values of all variables of a problem.
class SavedValues {
 public:
  explicit SavedValues(const Problem& problem) : values_(ProblemData::values(problem)) {}

  /// Sets the values of a problem with the same or similar variables; see ProblemData::set_values().
  void copy_to(Problem& problem) const { ProblemData::set_values(problem, values_); }

  /// Moves the values of such a problem as those of another one moved from `before` to these.
  void move(const SavedValues& before, Problem& problem) const {
    ProblemData::move_values(problem, before.values_, values_);
  }

 private:
  ProblemData::Values values_;
};

/// Copies values between problems with the same or similar variables, as SavedValues does.
inline void copy_values(const Problem& from, Problem& to) { SavedValues(from).copy_to(to); }

}  // namespace tandem::detail

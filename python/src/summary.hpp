#pragma once

#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem::python {

/// Summary of a solve, with all violated constraints.
struct PySummary : Summary {
  PySummary() = default;
  explicit PySummary(Summary summary) : Summary(std::move(summary)) {}

  std::vector<std::string> violated;  ///< descriptions, the worst first; empty if the solve converged
};

/// Adds the constraints that are violated at the values of the variables, unless the solve converged.
PySummary summary_of(Summary summary, const Problem& problem);
/// Returns the names of unobservable directions by variable.
pybind11::dict unobservable_names(const std::vector<UnobservableState>& states);
void bind_summary(pybind11::module_& m);

}  // namespace tandem::python

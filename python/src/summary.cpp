#include "summary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <pybind11/stl.h>

#include <tandem/problem/all_blocks.hpp>
#include <tandem/solvers/session.hpp>

#include "python_error.hpp"

namespace tandem::python {
namespace {

/// Returns the largest violation of a row of a block that exceeds the tolerance of solvers, 0 if none does.
double violation(const Problem& problem, const Block& block) {
  constexpr double kRowRounding = 1e-12;
  const Bounds<Eigen::Dynamic> bounds = problem.bounds(block);
  double worst = 0;
  try {
    const Eigen::VectorXd r = problem.linearization(block).residual;
    for (Eigen::Index k = 0; k < r.size(); ++k) {
      const double v = std::isfinite(r[k]) ? std::max(bounds.lower[k] - r[k], r[k] - bounds.upper[k])
                                           : std::numeric_limits<double>::infinity();
      if (v > std::max(detail::kConstraintTolerance, kRowRounding * std::abs(r[k]))) worst = std::max(worst, v);
    }
  } catch (const UndefinedResidualError&) {
    worst = std::numeric_limits<double>::infinity();
  }
  return worst;
}

void require_converged(const PySummary& summary) {
  if (summary.converged()) return;
  if (summary.status != Status::infeasible) raise("NumericalError", summary.solver + ": " + summary.message);
  const py::object type = exception_class("InfeasibleError");
  PyErr_SetObject(type.ptr(), type(summary.solver + ": " + summary.message, summary.violated).ptr());
  throw py::error_already_set();
}

}  // namespace

PySummary summary_of(Summary summary, const Problem& problem) {
  PySummary all(std::move(summary));
  if (all.converged()) return all;
  std::vector<std::pair<double, std::string>> violated;
  for (const Block& block : detail::hard_blocks(problem))
    if (const double size = violation(problem, block); size > 0) violated.emplace_back(size, problem.describe(block));
  std::stable_sort(violated.begin(), violated.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  for (auto& [size, description] : violated) all.violated.push_back(std::move(description));
  // The worst one by the measure of the solver, which knows the magnitudes of the terms within a row.
  const auto worst = std::find(all.violated.begin(), all.violated.end(), all.worst_constraint);
  if (worst != all.violated.end()) std::rotate(all.violated.begin(), worst, worst + 1);
  return all;
}

py::dict unobservable_names(const std::vector<UnobservableState>& states) {
  py::dict names;
  for (const UnobservableState& state : states)
    names[py::str(state.variable.empty() ? "others" : state.variable)] = state.directions;
  return names;
}

void bind_summary(py::module_& m) {
  py::class_<PySummary> s(m, "SolveSummary", "Result of a solve. The problem has the best point found.");
  s.def_readonly("solver", &Summary::solver, "Name of the solver.");
  s.def_property_readonly(
      "status", [](const PySummary& x) { return std::string(name(x.status)); },
      "\"converged\", or why the solve ended, for example \"max-iterations\" or \"infeasible\".");
  s.def_readonly("message", &Summary::message, "The status in words.");
  s.def_property_readonly("converged", &Summary::converged, "Whether the status is \"converged\".");
  s.def_readonly("initial_cost", &Summary::initial_cost, "Cost at the initial values.");
  s.def_readonly("cost", &Summary::cost, "Cost at the best point found.");
  s.def_readonly("max_violation", &Summary::max_violation,
                 "Largest violation of a constraint row, in the units of the row.");
  s.def_readonly("worst_constraint", &Summary::worst_constraint,
                 "Constraint of this violation, with its variables; empty without one.");
  s.def_readonly("violated_constraints", &PySummary::violated,
                 "All violated constraints with their variables, the worst first; determined unless the solve "
                 "converged.");
  s.def_readonly("iterations", &Summary::iterations, "Number of iterations.");
  s.def_readonly("evaluations", &Summary::evaluations, "Number of evaluations of the residuals.");
  s.def_readonly("seconds", &Summary::seconds, "Duration of the solve [s].");
  s.def_property_readonly(
      "unobservable",
      [](const PySummary& x) { return unobservable_names(x.unobservable); },
      "Names of the unobservable directions by variable; \"others\" counts those that are not named.");
  s.def("require_converged", &require_converged,
        "require_converged()\n\nRaise InfeasibleError or NumericalError unless the solve converged.");
  s.def(py::pickle(
      [](const PySummary& x) {
        std::vector<std::pair<std::string, std::vector<std::string>>> unobservable;
        for (const UnobservableState& state : x.unobservable)
          unobservable.emplace_back(state.variable, state.directions);
        return py::make_tuple(x.solver, int(x.status), x.message, unobservable, x.initial_cost, x.cost, x.max_violation,
                              x.worst_constraint, x.iterations, x.evaluations, x.seconds, x.violated);
      },
      [](const py::tuple& t) {
        PySummary x;
        x.solver = t[0].cast<std::string>();
        x.status = Status(t[1].cast<int>());
        x.message = t[2].cast<std::string>();
        for (auto& [variable, directions] : t[3].cast<std::vector<std::pair<std::string, std::vector<std::string>>>>())
          x.unobservable.push_back({variable, directions});
        x.initial_cost = t[4].cast<double>();
        x.cost = t[5].cast<double>();
        x.max_violation = t[6].cast<double>();
        x.worst_constraint = t[7].cast<std::string>();
        x.iterations = t[8].cast<int>();
        x.evaluations = t[9].cast<int>();
        x.seconds = t[10].cast<double>();
        x.violated = t[11].cast<std::vector<std::string>>();
        return x;
      }));
  s.def("__repr__", [](const PySummary& x) {
    return "<" + x.solver + ": " + std::string(name(x.status)) + ", cost " + std::string(py::str(py::float_(x.cost))) +
           ", " + std::to_string(x.iterations) + " iterations" + (x.converged() ? "" : "; " + x.message) + ">";
  });
  s.def("_repr_html_", [](const PySummary& x) {
    const auto row = [](const std::string& key, const std::string& value) {
      return "<tr><td>" + key + "</td><td>" + value + "</td></tr>";
    };
    return "<table>" + row("solver", x.solver) + row("status", std::string(name(x.status))) +
           row("message", x.message) + row("cost", py::str(py::float_(x.cost))) +
           row("iterations", std::to_string(x.iterations)) + row("violation", py::str(py::float_(x.max_violation))) +
           "</table>";
  });
}

}  // namespace tandem::python

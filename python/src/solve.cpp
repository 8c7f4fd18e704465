#include <type_traits>

#include <pybind11/stl.h>

#include <tandem/solvers/graduated.hpp>
#include <tandem/solvers/option_fields.hpp>
#include <tandem/solvers/replanning/damped_sqp.hpp>

#include "options.hpp"
#include "problem_object.hpp"
#include "watched_solve.hpp"

namespace tandem::python {
namespace {

void check_limits(const std::string& name, int max_iterations, double time_limit) {
  if (max_iterations < 0 || !(time_limit >= 0))
    throw BadInputError(name + ": max_iterations and time_limit must not be negative");
}

/// Solves by compute(problem), and warns if the solve does not converge.
template <class Compute>
Summary run(PyProblem& self, const std::string& name, WatchedSolve& watched, bool multipliers, Compute compute) {
  PyProblem::Solve solving(self);
  Problem& problem = self.read();
  const std::string before = self.no_multipliers;
  self.set_solved(false, "it raised an exception");  // unless it ends
  Summary summary;
  try {
    summary = watched.run([&] { return compute(problem); });
  } catch (const BadInputError&) {  // the solver has refused its options and has changed nothing
    self.no_multipliers = before;
    throw;
  }
  self.set_solved(summary.converged(), summary.message);
  if (summary.converged() && !multipliers)
    self.no_multipliers = "multipliers: " + name + " computes none; use augmented-lagrangian or ipopt";
  if (!summary.converged()) {
    const py::object warning = exception_class("IncompleteWarning");
    const std::string text = name + ": " + std::string(tandem::name(summary.status)) + ": " + summary.message;
    // Level 2 skips the stack frame of _calls.py, so the warning names the line of the caller.
    if (PyErr_WarnEx(warning.ptr(), text.c_str(), 2) != 0) throw py::error_already_set();
  }
  return summary;
}

template <class Solver>
Summary run(PyProblem& self, Solver options, const std::string& name, const py::dict& given, const py::object& progress,
            bool graduated) {
  Options reader(name, given);
  visit_options(options, reader);
  reader.finish();
  check_limits(name, options.max_iterations, options.time_limit);
  WatchedSolve watched(progress);
  watched.watch(options);
  return run(self, name, watched, !std::is_same_v<Solver, NloptOptions>,
             [&](Problem& problem) { return graduated ? solve_graduated(problem, options) : solve(problem, options); });
}

Summary run_sqp(PyProblem& self, const py::dict& given, const py::object& progress, bool graduated) {
  const std::string name = "damped-sqp";
  if (!progress.is_none() || graduated) throw BadInputError(name + ": reports no progress and cannot be graduated");
  DampedSqp::Options o;
  Options reader(name, given);
  reader("feasible", o.feasible);
  reader("cost_tolerance", o.cost_tolerance);
  reader("patience", o.patience);
  reader("max_iterations", o.max_iterations);
  reader("time_limit", o.time_limit);
  reader("from_multipliers", o.from_multipliers);
  reader.finish();
  check_limits(name, o.max_iterations, o.time_limit);
  if (!(o.feasible > 0) || !(o.cost_tolerance > 0) || o.patience < 0)
    throw BadInputError(name + ": feasible and cost_tolerance must be positive, and patience not negative");
  WatchedSolve watched;
  return run(self, name, watched, true, [&](Problem& problem) { return DampedSqp(problem).solve(o); });
}

Summary solve_by(PyProblem& self, std::string solver, const py::object& progress, bool graduated,
                 const py::kwargs& given) {
  if (solver == "auto") solver = self.read().num_hard_blocks() > 0 ? "augmented-lagrangian" : "gauss-newton";
  if (solver == "gauss-newton") return run(self, GaussNewtonOptions{}, solver, given, progress, graduated);
  if (solver == "augmented-lagrangian")
    return run(self, AugmentedLagrangianOptions{}, solver, given, progress, graduated);
  if (solver == "damped-sqp") return run_sqp(self, given, progress, graduated);
  if (solver == "ipopt") return run(self, IpoptOptions{}, solver, given, progress, graduated);
  if (solver.rfind("nlopt:", 0) == 0) {
    NloptOptions options;
    options.algorithm = solver.substr(6);
    return run(self, options, solver, given, progress, graduated);
  }
  throw BadInputError(
      "solve: the solver is auto, gauss-newton, augmented-lagrangian, damped-sqp, ipopt or "
      "nlopt:ALGORITHM, not " +
      solver);
}

void require_converged(const Summary& summary) {
  if (summary.converged()) return;
  if (summary.status != Status::infeasible) raise("NumericalError", summary.solver + ": " + summary.message);
  const py::object type = exception_class("InfeasibleError");
  const py::object constraints =
      summary.worst_constraint.empty() ? py::tuple() : py::make_tuple(summary.worst_constraint);
  PyErr_SetObject(type.ptr(), type(summary.solver + ": " + summary.message, constraints).ptr());
  throw py::error_already_set();
}

}  // namespace

void bind_solve(py::module_& m, py::class_<PyProblem, std::shared_ptr<PyProblem>>& c) {
  py::class_<Summary> s(m, "SolveSummary", "Result of a solve. The problem has the best point found.");
  s.def_readonly("solver", &Summary::solver, "Name of the solver.");
  s.def_property_readonly(
      "status", [](const Summary& x) { return std::string(name(x.status)); },
      "\"converged\", or why the solve ended, for example \"max-iterations\" or \"infeasible\".");
  s.def_readonly("message", &Summary::message, "The status in words.");
  s.def_property_readonly("converged", &Summary::converged, "Whether the status is \"converged\".");
  s.def_readonly("initial_cost", &Summary::initial_cost, "Cost at the initial values.");
  s.def_readonly("cost", &Summary::cost, "Cost at the best point found.");
  s.def_readonly("max_violation", &Summary::max_violation,
                 "Largest violation of a constraint row, in the units of the row.");
  s.def_readonly("worst_constraint", &Summary::worst_constraint,
                 "Constraint of this violation, with its variables; empty without one.");
  s.def_readonly("iterations", &Summary::iterations, "Number of iterations.");
  s.def_readonly("evaluations", &Summary::evaluations, "Number of evaluations of the residuals.");
  s.def_readonly("seconds", &Summary::seconds, "Duration of the solve [s].");
  s.def_property_readonly(
      "unobservable",
      [](const Summary& x) {
        py::dict states;
        for (const UnobservableState& state : x.unobservable) states[py::str(state.variable)] = state.directions;
        return states;
      },
      "Names of the unobservable directions by variable.");
  s.def("require_converged", &require_converged,
        "require_converged()\n\nRaise InfeasibleError or NumericalError unless the solve converged.");
  s.def(py::pickle(
      [](const Summary& x) {
        std::vector<std::pair<std::string, std::vector<std::string>>> unobservable;
        for (const UnobservableState& state : x.unobservable)
          unobservable.emplace_back(state.variable, state.directions);
        return py::make_tuple(x.solver, int(x.status), x.message, unobservable, x.initial_cost, x.cost, x.max_violation,
                              x.worst_constraint, x.iterations, x.evaluations, x.seconds);
      },
      [](const py::tuple& t) {
        Summary x;
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
        return x;
      }));
  s.def("__repr__", [](const Summary& x) {
    return "<" + x.solver + ": " + std::string(name(x.status)) + ", cost " + std::string(py::str(py::float_(x.cost))) +
           ", " + std::to_string(x.iterations) + " iterations" + (x.converged() ? "" : "; " + x.message) + ">";
  });
  s.def("_repr_html_", [](const Summary& x) {
    const auto row = [](const std::string& key, const std::string& value) {
      return "<tr><td>" + key + "</td><td>" + value + "</td></tr>";
    };
    return "<table>" + row("solver", x.solver) + row("status", std::string(name(x.status))) +
           row("message", x.message) + row("cost", py::str(py::float_(x.cost))) +
           row("iterations", std::to_string(x.iterations)) + row("violation", py::str(py::float_(x.max_violation))) +
           "</table>";
  });
  c.def(
      "solve", &solve_by, py::arg("solver") = "auto", py::kw_only(), py::arg("progress") = py::none(),
      py::arg("graduated") = false,
      "solve(solver='auto', *, progress=None, graduated=False, **options)\n\nSolve the problem; its variables get the "
      "best point found. Solvers: gauss-newton, augmented-lagrangian, damped-sqp (from near a solution), ipopt, "
      "nlopt:ALGORITHM; auto is gauss-newton, or "
      "augmented-lagrangian with constraints. Options are those of the C++ structs of the same solver, for example "
      "max_iterations, time_limit, threads, cost_tolerance. progress(dict) is called once per iteration. Ctrl-C ends "
      "the solve with status 'interrupted'. A solve that does not converge gives an IncompleteWarning.");
}

}  // namespace tandem::python

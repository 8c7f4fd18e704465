#include <limits>
#include <type_traits>

#include <pybind11/stl.h>

#include <tandem/solvers/graduated.hpp>
#include <tandem/solvers/option_fields.hpp>
#include <tandem/solvers/replanning/damped_sqp_option_fields.hpp>

#include "options.hpp"
#include "problem_object.hpp"
#include "summary.hpp"
#include "watched_solve.hpp"

namespace tandem::python {
namespace {

void check_limits(const std::string& name, int max_iterations, double time_limit) {
  if (max_iterations < 0 || !(time_limit >= 0))
    throw BadInputError(name + ": max_iterations and time_limit must not be negative");
}

/// Solves by compute(problem), and warns if the solve does not converge.
template <class Compute>
PySummary run(PyProblem& self, const std::string& name, WatchedSolve& watched, bool multipliers, Compute compute) {
  PyProblem::Solve solving(self);
  Problem& problem = self.read();
  const std::string before = self.no_multipliers;
  self.set_solved(false, "it raised an exception");  // unless it ends
  PySummary summary;
  try {
    summary = watched.run([&] { return summary_of(compute(problem), problem); });
  } catch (const BadInputError&) {  // the solver has refused its options and has changed nothing
    self.no_multipliers = before;
    throw;
  } catch (const UndefinedResidualError& error) {  // a function of Python that is undefined where it was defined before
    summary.solver = name;
    summary.message = error.what();
    summary.cost = summary.max_violation = std::numeric_limits<double>::quiet_NaN();
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

void check_tolerances(const std::string&, const SolverOptions&) {}  // the solver checks them
void check_tolerances(const std::string& name, const DampedSqp::Options& o) {
  if (!(o.feasible > 0) || !(o.cost_tolerance > 0) || o.patience < 0)
    throw BadInputError(name + ": feasible and cost_tolerance must be positive, and patience not negative");
}

Summary solve(Problem& problem, const DampedSqp::Options& options) { return DampedSqp(problem).solve(options); }
Summary solve_graduated(Problem&, const DampedSqp::Options&) {
  throw BadInputError("damped-sqp: cannot be graduated; use augmented-lagrangian or ipopt");
}

template <class Solver>
PySummary run(PyProblem& self, Solver options, const std::string& name, const py::dict& given,
              const py::object& progress, bool graduated) {
  Options reader(name, given);
  visit_options(options, reader);
  reader.finish();
  check_limits(name, options.max_iterations, options.time_limit);
  check_tolerances(name, options);
  WatchedSolve watched(progress);
  watched.watch(options);
  return run(self, name, watched, !std::is_same_v<Solver, NloptOptions>,
             [&](Problem& problem) { return graduated ? solve_graduated(problem, options) : solve(problem, options); });
}

PySummary solve_by(PyProblem& self, std::string solver, const py::object& progress, bool graduated,
                   const py::kwargs& given) {
  if (solver == "auto") solver = self.read().num_hard_blocks() > 0 ? "augmented-lagrangian" : "gauss-newton";
  if (solver == "gauss-newton") return run(self, GaussNewtonOptions{}, solver, given, progress, graduated);
  if (solver == "augmented-lagrangian")
    return run(self, AugmentedLagrangianOptions{}, solver, given, progress, graduated);
  if (solver == "damped-sqp") return run(self, DampedSqp::Options{}, solver, given, progress, graduated);
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

/// Collects the options of a solver by name, with their defaults.
struct Described {
  py::dict defaults{};

  template <class T>
  void operator()(const char* name, const T& value) {
    defaults[name] = py::cast(value);
  }
  template <class T, class Values>
  void operator()(const char* name, const T& value, const Values& values) {
    for (const auto& choice : values)
      if (choice.value == value) defaults[name] = choice.name;
  }
};

template <class Options>
py::dict described(Options options) {
  Described all;
  visit_options(options, all);
  return all.defaults;
}

}  // namespace

void bind_solve(py::module_& m, py::class_<PyProblem, std::shared_ptr<PyProblem>>& c) {
  bind_summary(m);
  m.def(
      "_solver_options",
      [] {
        return py::dict(py::arg("gauss-newton") = described(GaussNewtonOptions{}),
                        py::arg("augmented-lagrangian") = described(AugmentedLagrangianOptions{}),
                        py::arg("damped-sqp") = described(DampedSqp::Options{}),
                        py::arg("ipopt") = described(IpoptOptions{}),
                        py::arg("nlopt:ALGORITHM") = described(NloptOptions{}));
      },
      "Return the options of each solver with their defaults.");
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

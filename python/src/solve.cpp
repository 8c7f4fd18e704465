#include <atomic>

#include <pybind11/stl.h>

#include <tandem/problem/parallel_tasks.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/graduated.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>

#include "interrupt.hpp"
#include "problem_object.hpp"
#include "python_error.hpp"

namespace tandem::python {
namespace {

/// Sets options from keyword arguments and names those that are left.
class Options {
 public:
  Options(std::string solver, const py::dict& given) : solver_(std::move(solver)), given_(given) {}

  template <class T>
  void set(const char* name, T& value) {
    known_ += (known_.empty() ? "" : ", ") + std::string(name);
    if (!given_.contains(name)) return;
    const py::object given = given_[name];
    ++used_;
    try {
      value = given.cast<T>();
    } catch (const py::cast_error&) {
      throw py::type_error(solver_ + ": option " + name + " has the wrong type: " + std::string(py::repr(given)));
    }
  }
  template <class T>
  void choose(const char* name, T& value, std::initializer_list<std::pair<const char*, T>> choices) {
    std::string text;
    set(name, text);
    if (text.empty()) return;
    std::string all;
    for (const auto& [choice, meaning] : choices) {
      if (text == choice) {
        value = meaning;
        return;
      }
      all += (all.empty() ? "" : ", ") + std::string(choice);
    }
    throw BadInputError(solver_ + ": option " + name + " is one of " + all + ", not " + text);
  }
  void finish() const {
    if (used_ == py::len(given_)) return;
    for (const auto& [key, value] : given_)
      if ((", " + known_ + ",").find(", " + key.cast<std::string>() + ",") == std::string::npos)
        throw py::type_error(solver_ + ": unknown option " + key.cast<std::string>() + "; the options are " + known_);
  }

 private:
  std::string solver_, known_;
  const py::dict& given_;
  std::size_t used_ = 0;
};

void read_common(Options& given, SolverOptions& o) {
  given.set("max_iterations", o.max_iterations);
  given.set("time_limit", o.time_limit);
  given.set("threads", o.threads);
  given.set("observability", o.observability);
  given.set("from_multipliers", o.from_multipliers);
}

void read(Options& given, LevenbergMarquardtOptions& o) {
  given.set("cost_tolerance", o.cost_tolerance);
  given.set("gradient_tolerance", o.gradient_tolerance);
  given.set("step_tolerance", o.step_tolerance);
  given.set("initial_damping", o.initial_damping);
  given.set("secant_pairs", o.secant_pairs);
}
void read(Options& given, AugmentedLagrangianOptions& o) {
  read(given, static_cast<LevenbergMarquardtOptions&>(o));
  given.set("initial_penalty", o.initial_penalty);
}
void read(Options& given, IpoptOptions& o) {
  given.set("tolerance", o.tolerance);
  given.choose("hessian", o.hessian,
               {{"automatic", Hessian::automatic},
                {"gauss-newton", Hessian::gauss_newton},
                {"exact", Hessian::exact},
                {"limited-memory", Hessian::limited_memory}});
  given.choose("linear_solver", o.linear_solver,
               {{"automatic", IpoptLinearSolver::automatic},
                {"block-cholesky", IpoptLinearSolver::block_cholesky},
                {"mumps", IpoptLinearSolver::mumps}});
  given.set("options", o.options);
}
void read(Options& given, NloptOptions& o) {
  given.set("cost_tolerance", o.cost_tolerance);
  given.set("constraint_tolerance", o.constraint_tolerance);
  given.set("precondition", o.precondition);
}

/// Runs f without the interpreter's lock. Between iterations it checks for Ctrl-C, which ends the solve at its best
/// point, and calls `progress`.
template <class Solver>
Summary run(PyProblem& self, Solver options, const std::string& name, const py::dict& given, const py::object& progress,
            bool graduated) {
  Options reader(name, given);
  read_common(reader, options);
  read(reader, options);
  reader.finish();
  PyProblem::Solve solving(self);
  Problem& problem = self.read();
  std::atomic<bool> stop = false;
  const SolveStop of_this_thread(stop);
  options.stop = &stop;
  options.progress = [&](const Progress& p) {
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) {
      const py::error_already_set signal;
      if (!signal.matches(PyExc_KeyboardInterrupt)) throw PythonError("signal", signal);
      stop = true;
      return;
    }
    if (progress.is_none()) return;
    try {
      progress(py::dict(py::arg("iteration") = p.iteration, py::arg("cost") = p.cost, py::arg("step") = p.step,
                        py::arg("violation") = p.violation, py::arg("seconds") = p.seconds));
    } catch (const py::error_already_set& error) {
      if (!error.matches(PyExc_KeyboardInterrupt)) throw PythonError("progress", error);
      stop = true;
    }
  };
  const py::gil_scoped_release unlocked;
  return graduated ? solve_graduated(problem, options) : solve(problem, options);
}

Summary solve_by(PyProblem& self, std::string solver, const py::object& progress, bool graduated,
                 const py::kwargs& given) {
  if (solver == "auto") solver = self.read().num_hard_blocks() > 0 ? "augmented-lagrangian" : "gauss-newton";
  if (solver == "gauss-newton") return run(self, GaussNewtonOptions{}, solver, given, progress, graduated);
  if (solver == "augmented-lagrangian")
    return run(self, AugmentedLagrangianOptions{}, solver, given, progress, graduated);
  if (solver == "ipopt") return run(self, IpoptOptions{}, solver, given, progress, graduated);
  if (solver.rfind("nlopt:", 0) == 0) {
    NloptOptions options;
    options.algorithm = solver.substr(6);
    return run(self, options, solver, given, progress, graduated);
  }
  throw BadInputError("solve: the solver is auto, gauss-newton, augmented-lagrangian, ipopt or nlopt:ALGORITHM, not " +
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
  s.def_readonly("solver", &Summary::solver);
  s.def_property_readonly("status", [](const Summary& x) { return std::string(name(x.status)); });
  s.def_readonly("message", &Summary::message);
  s.def_property_readonly("converged", &Summary::converged);
  s.def_readonly("initial_cost", &Summary::initial_cost).def_readonly("cost", &Summary::cost);
  s.def_readonly("max_violation", &Summary::max_violation).def_readonly("worst_constraint", &Summary::worst_constraint);
  s.def_readonly("iterations", &Summary::iterations).def_readonly("evaluations", &Summary::evaluations);
  s.def_readonly("seconds", &Summary::seconds);
  s.def_property_readonly("unobservable", [](const Summary& x) {
    py::dict states;
    for (const UnobservableState& state : x.unobservable) states[py::str(state.variable)] = state.directions;
    return states;
  });
  s.def("require_converged", &require_converged,
        "require_converged()\n\nRaise InfeasibleError or NumericalError unless the solve converged.");
  s.def("__repr__", [](const Summary& x) {
    return "<" + x.solver + ": " + std::string(name(x.status)) + ", cost " + std::string(py::str(py::float_(x.cost))) +
           ", " + std::to_string(x.iterations) + " iterations>";
  });
  s.def("_repr_html_", [](const Summary& x) {
    const auto row = [](const std::string& key, const std::string& value) {
      return "<tr><td>" + key + "</td><td>" + value + "</td></tr>";
    };
    return "<table>" + row("solver", x.solver) + row("status", std::string(name(x.status))) +
           row("cost", py::str(py::float_(x.cost))) + row("iterations", std::to_string(x.iterations)) +
           row("violation", py::str(py::float_(x.max_violation))) + "</table>";
  });
  c.def(
      "solve", &solve_by, py::arg("solver") = "auto", py::kw_only(), py::arg("progress") = py::none(),
      py::arg("graduated") = false,
      "solve(solver='auto', *, progress=None, graduated=False, **options)\n\nSolve the problem; its variables get the "
      "best point found. Solvers: gauss-newton, augmented-lagrangian, ipopt, nlopt:ALGORITHM; auto is gauss-newton, or "
      "augmented-lagrangian with constraints. Options are those of the C++ structs of the same solver, for example "
      "max_iterations, time_limit, threads, cost_tolerance. progress(dict) is called once per iteration. Ctrl-C ends "
      "the solve with status 'interrupted'.");
}

}  // namespace tandem::python

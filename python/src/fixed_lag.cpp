#include <tandem/solvers/fixed_lag/fixed_lag.hpp>

#include "bind_covariances.hpp"
#include "options.hpp"
#include "summary.hpp"
#include "watched_solve.hpp"

namespace tandem::python {
namespace {

/// A fixed-lag smoother with the Python object of its problem.
struct PyFixedLag {
  std::unique_ptr<WatchedSolve> watched;
  std::shared_ptr<FixedLag> lag;
  std::shared_ptr<PyProblem> problem;
};

}  // namespace

void bind_fixed_lag(py::module_& m) {
  py::class_<PyFixedLag> c(m, "FixedLag",
                           "Fixed-lag smoother: a problem whose old variables are marginalized.\n\n"
                           "Costs and hard constraints are those of the attribute `problem`. Constraints that are "
                           "active when a variable leaves count as equalities from then on. Covariances are those of "
                           "the constrained window at the present values, or at the last linearisation if variables or "
                           "blocks have been added or removed since.\n\n"
                           ">>> import tandem\n>>> lag = tandem.FixedLag(window=5.0)\n"
                           ">>> x = lag.add(0.0, tandem.R1([0.0]), 'x0')\n"
                           ">>> b = lag.problem.minimize(tandem.Prior(tandem.R1([1.0])), 1.0, x)\n"
                           ">>> lag.update().status\n'converged'\n");
  c.def(py::init([](const py::kwargs& given) {
    FixedLagOptions o;
    Options read("FixedLag", given);
    read("window", o.window);
    read("max_keyframes", o.max_keyframes);
    read("patience", o.patience);
    read("initial_damping", o.initial_damping);
    read("cost_tolerance", o.cost_tolerance);
    read("step_tolerance", o.step_tolerance);
    read("max_iterations", o.max_iterations);
    read("time_limit", o.time_limit);
    read("threads", o.threads);
    read.finish();
    auto watched = std::make_unique<WatchedSolve>();
    watched->watch(o);
    auto lag = std::make_shared<FixedLag>(std::move(o));
    auto problem = std::make_shared<PyProblem>(std::shared_ptr<Problem>(lag, &lag->problem()));
    problem->no_multipliers = "multipliers: the window has not been solved; call update() first";
    return PyFixedLag{std::move(watched), std::move(lag), std::move(problem)};
  }));
  c.def_readonly("problem", &PyFixedLag::problem, "The problem of the window, for costs and hard constraints.");
  c.def(
      "add",
      [](PyFixedLag& self, double t, py::handle initial, const std::string& name) {
        if (const auto why = self.lag->why_too_late(t)) throw BadInputError("fixed-lag: " + *why);
        const py::object x = py::cast(self.problem).attr("add")(initial, name);
        const BlockVariables added = block_variables(x, "add");
        for (std::size_t i = 0; i < added.count; ++i)
          self.lag->track(t, Variable<R3>(added.at(0, i)));  // the group of the variable is not used
        return x;
      },
      py::arg("t"), py::arg("initial"), py::arg("name") = "",
      "add(t, initial, name='')\n\nAdd a variable, or an array of them, at a time [s].");
  c.def(
      "update",
      [](PyFixedLag& self) {
        const PySummary summary = [&] {
          PyProblem::Solve solving(*self.problem);
          self.problem->set_solved(false, "it raised an exception");  // unless it ends
          return self.watched->run([&] { return summary_of(self.lag->update(), self.lag->problem()); });
        }();
        self.problem->set_solved(summary.converged(), summary.message);
        self.problem->drop_removed();
        return summary;
      },
      "update()\n\nSolve the window, then marginalize the variables that have left it.");
  bind_covariances(c, [](const PyFixedLag& self, const std::vector<VariableHandle>& x, const std::vector<int>& dofs) {
    return self.lag->covariance(ids_of(*self.problem, x), dofs);
  });
  c.def_property_readonly(
      "oldest", [](const PyFixedLag& self) { return self.lag->oldest(); },
      "Earliest time of the variables in the window [s]; -inf if there are none.");
  c.def_property_readonly(
      "newest", [](const PyFixedLag& self) { return self.lag->newest(); },
      "Latest time of the variables in the window [s]; -inf if there are none.");
  c.def("__repr__", [](const PyFixedLag& self) {
    return "<FixedLag: " + std::to_string(self.lag->problem().num_variables()) + " variables>";
  });
}

}  // namespace tandem::python

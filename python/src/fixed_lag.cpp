#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <tandem/solvers/fixed_lag/fixed_lag.hpp>

#include "problem_object.hpp"

namespace tandem::python {
namespace {

/// A fixed-lag smoother with the Python object of its problem.
struct PyFixedLag {
  std::shared_ptr<FixedLag> lag;
  std::shared_ptr<PyProblem> problem;
};

}  // namespace

void bind_fixed_lag(py::module_& m) {
  py::class_<PyFixedLag> c(m, "FixedLag",
                           "Fixed-lag smoother: a problem whose old variables are marginalized.\n\n"
                           ">>> import tandem\n>>> lag = tandem.FixedLag(window=5.0)\n"
                           ">>> x = lag.add(0.0, tandem.R1([0.0]), 'x0')\n"
                           ">>> b = lag.problem.minimize(tandem.Prior(tandem.R1([1.0])), 1.0, x)\n"
                           ">>> lag.update().status\n'converged'\n");
  c.def(py::init([](double window, int max_keyframes, double patience, int max_iterations, double cost_tolerance,
                    double step_tolerance, int threads) {
          FixedLagOptions o;
          o.window = window;
          o.max_keyframes = max_keyframes;
          o.patience = patience;
          o.max_iterations = max_iterations;
          o.cost_tolerance = cost_tolerance;
          o.step_tolerance = step_tolerance;
          o.threads = threads;
          auto lag = std::make_shared<FixedLag>(o);
          auto problem = std::make_shared<PyProblem>(std::shared_ptr<Problem>(lag, &lag->problem()));
          return PyFixedLag{std::move(lag), std::move(problem)};
        }),
        py::kw_only(), py::arg("window") = 60.0, py::arg("max_keyframes") = 0, py::arg("patience") = 0.5,
        py::arg("max_iterations") = 5, py::arg("cost_tolerance") = 1e-6, py::arg("step_tolerance") = 1e-9,
        py::arg("threads") = 0);
  c.def_readonly("problem", &PyFixedLag::problem, "The problem of the window, for costs.");
  c.def(
      "add",
      [](PyFixedLag& self, double t, py::handle initial, const std::string& name) {
        if (const auto why = self.lag->why_too_late(t)) throw BadInputError(*why);
        const py::object x = py::cast(self.problem).attr("add")(initial, name);
        const PyVariable variable = x.cast<PyVariable>();
        try {
          self.lag->track(t, Variable<R3>(variable.handle));  // uses the handle only
        } catch (...) {
          self.problem->change().remove(variable.handle);
          throw;
        }
        return x;
      },
      py::arg("t"), py::arg("initial"), py::arg("name") = "",
      "add(t, initial, name='')\n\nAdd a variable at a time [s].");
  c.def(
      "update",
      [](PyFixedLag& self) {
        PyProblem::Solve solving(*self.problem);
        const py::gil_scoped_release unlocked;
        return self.lag->update();
      },
      "update()\n\nSolve the window, then marginalize the variables that have left it.");
  c.def(
      "covariance",
      [](const PyFixedLag& self, const PyVariable& x) {
        return self.lag->covariance({self.problem->read().id(x.handle)}, {x.group->dof});
      },
      py::arg("x"), "covariance(x)\n\nReturn the covariance of a variable after the last update.");
  c.def_property_readonly("oldest", [](const PyFixedLag& self) { return self.lag->oldest(); });
  c.def_property_readonly("newest", [](const PyFixedLag& self) { return self.lag->newest(); });
  c.def("__repr__", [](const PyFixedLag& self) {
    return "<FixedLag: " + std::to_string(self.lag->problem().num_variables()) + " variables>";
  });
}

}  // namespace tandem::python

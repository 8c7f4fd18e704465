#include <chrono>
#include <future>
#include <optional>

#include <pybind11/stl.h>

#include <tandem/solvers/marginals.hpp>

#include "bind_covariances.hpp"
#include "problem_object.hpp"
#include "summary.hpp"

namespace tandem::python {
namespace {

/// Marginal covariances, and the IDs that the variables had when the covariances were computed.
struct PyMarginals {
  std::unique_ptr<Marginals> marginals;
  std::shared_ptr<PyProblem> problem;
};

/// Computes in another thread, while this one looks for Ctrl-C, which ends the computation.
std::unique_ptr<Marginals> compute(Problem& problem, PyProblem::Solve& solving) {
  std::unique_ptr<Marginals> marginals;
  std::optional<py::error_already_set> interrupt;
  {
    const py::gil_scoped_release unlocked;
    auto task = std::async(std::launch::async, [&] {
      solving.continue_here();
      return std::make_unique<Marginals>(problem, std::span<const Marginals::Pair>(), Stop(&solving.stop()));
    });
    while (task.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
      const py::gil_scoped_acquire lock;
      if (!interrupt && PyErr_CheckSignals() != 0) {
        interrupt.emplace();
        solving.stop() = true;
      }
    }
    try {
      marginals = task.get();
    } catch (const Stopped&) {
      if (!interrupt) throw;
    }
  }
  if (interrupt) throw py::error_already_set(*interrupt);
  return marginals;
}

}  // namespace

void bind_marginals(py::module_& m) {
  py::class_<PyMarginals> c(m, "Marginals",
                            "Marginal covariances of the variables of a solved problem, by right perturbations. Hard "
                            "equalities restrict them; unobservable directions are infinite.\n\n"
                            ">>> import tandem\n>>> p = tandem.Problem()\n>>> x = p.add(tandem.R1([0.0]), 'x')\n"
                            ">>> cost = p.minimize(tandem.Prior(tandem.R1([2.0])), 0.5, x)\n"
                            ">>> tandem.Marginals(p).covariance(x)\narray([[0.25]])\n");
  c.def(py::init([](std::shared_ptr<PyProblem> problem) {
          PyProblem::Solve solving(*problem);
          Problem& of = problem->read();
          return PyMarginals{compute(of, solving), std::move(problem)};
        }),
        py::arg("problem").none(false));
  bind_covariances(c, [](const PyMarginals& self, const std::vector<VariableHandle>& x, const std::vector<int>& dofs) {
    return self.marginals->joint(ids_of(*self.problem, x), dofs);
  });
  c.def(
      "require_regular", [](const PyMarginals& self) { self.marginals->require_regular(); },
      "require_regular()\n\nRaise NotObservableError, which names state and direction, if a direction is "
      "unobservable.");
  c.def_property_readonly(
      "unobservable",
      [](const PyMarginals& self) { return unobservable_names(self.marginals->unobservable()); },
      "Names of the unobservable directions by variable.");
  c.def_property_readonly(
      "log_determinant", [](const PyMarginals& self) { return self.marginals->log_determinant(); },
      "Logarithm of the determinant of the information matrix H; -inf if it is singular.");
  c.def("__repr__", [](const PyMarginals& self) {
    return "<Marginals: " + std::to_string(self.marginals->unobservable().size()) + " unobservable states>";
  });
}

}  // namespace tandem::python

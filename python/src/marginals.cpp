#include <numeric>

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <tandem/solvers/marginals.hpp>

#include "bind_group.hpp"
#include "problem_object.hpp"

namespace tandem::python {
namespace {

/// Marginal covariances, with the problem's IDs of the variables when they were computed.
struct PyMarginals {
  std::unique_ptr<Marginals> marginals;
  std::shared_ptr<PyProblem> problem;

  int id(const VariableHandle& x) const { return problem->read().id(x); }
  Eigen::MatrixXd joint(const std::vector<VariableHandle>& handles, const std::vector<int>& dofs) const {
    std::vector<int> ids;
    for (const VariableHandle& handle : handles) ids.push_back(id(handle));
    return marginals->joint(ids, dofs);
  }
};

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
          std::unique_ptr<Marginals> marginals;
          {
            const py::gil_scoped_release unlocked;
            marginals = std::make_unique<Marginals>(of);
          }
          return PyMarginals{std::move(marginals), std::move(problem)};
        }),
        py::arg("problem").none(false));
  c.def(
      "covariance",
      [](const PyMarginals& self, py::handle x) -> py::object {
        const BlockVariables variables = block_variables(x, "covariance");
        if (variables.states.size() != 1) throw py::type_error("covariance: expected one variable, or use joint");
        const int dof = variables.groups[0]->dof;
        Numbers result = new_array(variables.count, variables.single, {dof, dof});
        double* to = result.mutable_data();
        for (std::size_t i = 0; i < variables.count; ++i) {
          const Eigen::MatrixXd S = self.joint({variables.at(0, i)}, {dof});
          to = std::copy(S.data(), S.data() + S.size(), to);
        }
        return std::move(result);
      },
      py::arg("x"), "covariance(x)\n\nReturn the covariance, shape (dof, dof), or (n, dof, dof) of an array.");
  c.def(
      "joint",
      [](const PyMarginals& self, const py::list& x) {
        const BlockVariables variables = block_variables(x, "joint");
        std::vector<VariableHandle> handles;
        std::vector<int> dofs;
        for (std::size_t s = 0; s < variables.states.size(); ++s)
          for (const VariableHandle& handle : variables.states[s].handles) {
            handles.push_back(handle);
            dofs.push_back(variables.groups[s]->dof);
          }
        return self.joint(handles, dofs);
      },
      py::arg("x"), "joint(x)\n\nReturn the joint covariance of a list of variables, in their order.");
  c.def(
      "require_regular", [](const PyMarginals& self) { self.marginals->require_regular(); },
      "require_regular()\n\nRaise NotObservableError, which names state and direction, if a direction is "
      "unobservable.");
  c.def_property_readonly("unobservable", [](const PyMarginals& self) {
    py::dict states;
    for (const UnobservableState& state : self.marginals->unobservable())
      states[py::str(state.variable)] = state.directions;
    return states;
  });
  c.def_property_readonly("log_determinant", [](const PyMarginals& self) { return self.marginals->log_determinant(); });
  c.def("__repr__", [](const PyMarginals& self) {
    return "<Marginals: " + std::to_string(self.marginals->unobservable().size()) + " unobservable states>";
  });
}

}  // namespace tandem::python

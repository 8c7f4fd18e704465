#pragma once

#include <algorithm>

#include <pybind11/eigen.h>

#include "bind_group.hpp"
#include "problem_object.hpp"

namespace tandem::python {

/// Returns the IDs of variables. Throws StaleHandleError if one is not in the problem.
inline std::vector<int> ids_of(const PyProblem& problem, const std::vector<VariableHandle>& x) {
  std::vector<int> ids;
  for (const VariableHandle& handle : x) ids.push_back(problem.read().id(handle));
  return ids;
}

/// Binds covariance() and joint() to a class. `joint(self, variables, dofs)` returns a joint covariance.
template <class Class, class Joint>
void bind_covariances(Class& c, Joint joint) {
  using Self = typename Class::type;
  c.def(
      "covariance",
      [joint](const Self& self, py::handle x) -> py::object {
        const PyVariables variables = variables_of(x, "covariance");
        const int dof = variables.group->dof;
        Numbers result = new_array(variables.handles.size(), py::isinstance<PyVariable>(x), {dof, dof});
        double* to = result.mutable_data();
        for (const VariableHandle& handle : variables.handles) {
          const Eigen::MatrixXd S = joint(self, {handle}, {dof});
          to = std::copy(S.data(), S.data() + S.size(), to);
        }
        return result;
      },
      py::arg("x"),
      "covariance(x)\n\nReturn the covariance, shape (dof, dof), or (n, dof, dof) of an array or a list.");
  c.def(
      "joint",
      [joint](const Self& self, py::handle x) {
        std::vector<VariableHandle> handles;
        std::vector<int> dofs;
        for (const PyVariable& variable : all_variables(x, "joint")) {
          handles.push_back(variable.handle);
          dofs.push_back(variable.group->dof);
        }
        return joint(self, handles, dofs);
      },
      py::arg("x"), "joint(x)\n\nReturn the joint covariance of a list of variables, in their order.");
}

}  // namespace tandem::python

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
        const BlockVariables variables = block_variables(x, "covariance");
        if (variables.states.size() != 1) throw py::type_error("covariance: expected one variable, or use joint");
        const int dof = variables.groups[0]->dof;
        Numbers result = new_array(variables.count, variables.single, {dof, dof});
        double* to = result.mutable_data();
        for (std::size_t i = 0; i < variables.count; ++i) {
          const Eigen::MatrixXd S = joint(self, {variables.at(0, i)}, {dof});
          to = std::copy(S.data(), S.data() + S.size(), to);
        }
        return std::move(result);
      },
      py::arg("x"), "covariance(x)\n\nReturn the covariance, shape (dof, dof), or (n, dof, dof) of an array.");
  c.def(
      "joint",
      [joint](const Self& self, py::handle x) {
        const BlockVariables variables = block_variables(x, "joint");
        std::vector<VariableHandle> handles;
        std::vector<int> dofs;
        for (std::size_t s = 0; s < variables.states.size(); ++s)
          for (const VariableHandle& handle : variables.states[s].handles) {
            handles.push_back(handle);
            dofs.push_back(variables.groups[s]->dof);
          }
        return joint(self, handles, dofs);
      },
      py::arg("x"), "joint(x)\n\nReturn the joint covariance of a list of variables, in their order.");
}

}  // namespace tandem::python

#pragma once

#include <tandem/problem/problem.hpp>

#include "elements.hpp"

namespace tandem::python {

/// Functions for the variables of a group, without its C++ type.
struct VariableFunctions {
  VariableHandle (*add)(Problem& problem, const void* initial, std::string name);
  const void* (*value)(const Problem& problem, const VariableHandle& x);
  void (*set_value)(Problem& problem, const VariableHandle& x, const void* value);
  std::vector<VariableHandle> (*all)(const Problem& problem);
  const detail::GroupType* type;
};
const VariableFunctions& variable_functions(const Group& group);

/// One variable of a problem.
struct PyVariable {
  VariableHandle handle;
  const Group* group;
};
/// Variables of one group.
struct PyVariables {
  std::vector<VariableHandle> handles;
  const Group* group;
};

/// Variables of n blocks that read `arity` states: state s of block i is at(s, i).
struct BlockVariables {
  struct State {
    std::vector<VariableHandle> handles;
    bool single;
  };
  std::vector<State> states;
  std::vector<const Group*> groups;
  std::size_t count = 1;
  bool single = true;

  const VariableHandle& at(std::size_t s, std::size_t i) const { return states[s].handles[states[s].single ? 0 : i]; }
};
bool is_list(py::handle value);
/// Returns the variables of one group in a variable, an array of variables, or a list of both.
PyVariables variables_of(py::handle value, const std::string& what);
/// Returns the variables of any groups in a variable, an array of variables, or a list of both.
std::vector<PyVariable> all_variables(py::handle value, const std::string& what);
/// Converts a variable, or a sequence with one item for each state: a variable, an array or a list of variables. Throws
/// ValueError if the lengths differ.
BlockVariables block_variables(py::handle value, const std::string& what);

void bind_variables(py::module_& m);

/// Makes copies of a handle refer to the same thing, and refuses to pickle it.
template <class Class>
void refuse_pickle(Class& c, const char* remedy) {
  c.def("__copy__", [](const py::object& self) { return self; });
  c.def("__deepcopy__", [](const py::object& self, const py::dict&) { return self; });
  c.def("__reduce__", [remedy](const py::object& self) -> py::object {
    throw py::type_error("a handle of the class " + std::string(py::str(py::type::of(self).attr("__name__"))) +
                         " cannot be pickled, because it belongs to a problem of this process; pickle the Problem: " +
                         remedy);
  });
}

}  // namespace tandem::python

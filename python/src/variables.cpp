#include "variables.hpp"

#include <map>

#include "bind_group.hpp"

namespace tandem::python {
namespace {

template <LieGroup G>
VariableFunctions functions_of() {
  VariableFunctions f{};
  f.add = [](Problem& problem, const void* initial, std::string name) -> VariableHandle {
    return problem.add(*static_cast<const G*>(initial), std::move(name));
  };
  f.value = [](const Problem& problem, const VariableHandle& x) -> const void* {
    return &problem.value(Variable<G>(x));
  };
  f.set_value = [](Problem& problem, const VariableHandle& x, const void* value) {
    problem.set_value(Variable<G>(x), *static_cast<const G*>(value));
  };
  f.all = [](const Problem& problem) {
    std::vector<VariableHandle> handles;
    for (const Variable<G>& x : problem.variables<G>()) handles.push_back(x);
    return handles;
  };
  for (const detail::GroupType* type : detail::group_types())
    if (type->type == typeid(G)) f.type = type;
  return f;
}

template <LieGroup... Gs>
std::map<std::string, VariableFunctions> functions_by_type() {
  return {{typeid(Gs).name(), functions_of<Gs>()}...};
}

}  // namespace

const VariableFunctions& variable_functions(const Group& group) {
  static const auto all =
      functions_by_type<SO2, SE2, SO3, SE3, SE23, Rn<1>, Rn<2>, Rn<3>, Rn<4>, Rn<5>, Rn<6>, Rn<8>, Rn<9>, Rn<12>,
                        Bundle<SE3, R3>, Bundle<SE3, Rn<6>>, Bundle<SE3, SE3>, Bundle<SE2, R3>>();
  return all.at(group.type->name());
}

namespace {

/// Appends variables of one group: a variable, an array of variables, or a list of them.
void append(py::handle item, PyVariables& to, const std::string& what) {
  const Group* group = nullptr;
  if (py::isinstance<PyVariable>(item)) {
    const auto& x = item.cast<const PyVariable&>();
    to.handles.push_back(x.handle);
    group = x.group;
  } else if (py::isinstance<PyVariables>(item)) {
    const auto& x = item.cast<const PyVariables&>();
    to.handles.insert(to.handles.end(), x.handles.begin(), x.handles.end());
    group = x.group;
  } else if (is_list(item)) {
    for (const py::handle part : item) append(part, to, what);
    return;
  } else {
    throw py::type_error(what + ": expected variables as returned by Problem.add, not " +
                         std::string(py::str(py::type::of(item).attr("__name__"))));
  }
  if (to.group && to.group != group)
    throw py::type_error(what + ": a list of variables has variables of one group, not of " + to.group->name + " and " +
                         group->name);
  to.group = group;
}

}  // namespace

bool is_list(py::handle value) { return py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value); }

PyVariables variables_of(py::handle value, const std::string& what) {
  PyVariables all{{}, nullptr};
  append(value, all, what);
  if (!all.group) throw py::value_error(what + ": the list of variables is empty");
  return all;
}

std::vector<PyVariable> all_variables(py::handle value, const std::string& what) {
  if (is_list(value)) {
    std::vector<PyVariable> all;
    for (const py::handle item : value)
      for (const PyVariable& x : all_variables(item, what)) all.push_back(x);
    return all;
  }
  const PyVariables part = variables_of(value, what);
  std::vector<PyVariable> all;
  for (const VariableHandle& x : part.handles) all.push_back({x, part.group});
  return all;
}

BlockVariables block_variables(py::handle value, const std::string& what) {
  BlockVariables result;
  const auto add = [&](py::handle item) {
    PyVariables all = variables_of(item, what);
    BlockVariables::State state{std::move(all.handles), py::isinstance<PyVariable>(item)};
    result.count = common_size(result.count, result.single, state.handles.size(), state.single, what);
    result.single = result.single && state.single;
    result.states.push_back(std::move(state));
    result.groups.push_back(all.group);
  };
  if (is_list(value))
    for (const py::handle item : value) add(item);
  else
    add(value);
  return result;
}

void bind_variables(py::module_& m) {
  py::class_<PyVariable> c(m, "Variable", "A variable of a problem, as returned by Problem.add.");
  c.def_property_readonly(
      "name", [](const PyVariable& x) { return *x.handle.name; }, "Name as given to Problem.add.");
  c.def_property_readonly(
      "group", [](const PyVariable& x) { return x.group->name; }, "Name of the variable's group, for example \"SE3\".");
  c.def("__repr__", [](const PyVariable& x) { return "<Variable " + *x.handle.name + ": " + x.group->name + ">"; });
  c.def("__hash__", [](const PyVariable& x) {
    return std::hash<std::uint64_t>()(x.handle.problem * 1000003u + std::uint64_t(x.handle.slot));
  });
  c.def("__eq__", [](const PyVariable& a, py::handle other) {
    if (!py::isinstance<PyVariable>(other)) return false;
    const auto& b = other.cast<const PyVariable&>();
    return a.handle.problem == b.handle.problem && a.handle.slot == b.handle.slot &&
           a.handle.generation == b.handle.generation;
  });
  refuse_pickle(c, "Problem.__getitem__ finds a variable by its name");
  py::class_<PyVariables> a(m, "Variables", "An array of variables of one group, as returned by Problem.add.");
  a.def("__len__", [](const PyVariables& x) { return x.handles.size(); });
  a.def("__getitem__", [](const PyVariables& x, py::handle index) -> py::object {
    const Selection chosen = selection(index, x.handles.size(), "variables");
    if (chosen.single) return py::cast(PyVariable{x.handles[chosen.elements[0]], x.group});
    PyVariables part{{}, x.group};
    for (const std::size_t i : chosen.elements) part.handles.push_back(x.handles[i]);
    return py::cast(std::move(part));
  });
  a.def("__repr__", [](const PyVariables& x) {
    return "<" + std::to_string(x.handles.size()) + " variables: " + x.group->name + ">";
  });
  refuse_pickle(a, "Problem.variables lists them again");
  // Type annotations may name the group: Variable[SE3].
  const py::object generic =
      py::module_::import("builtins").attr("classmethod")(py::module_::import("types").attr("GenericAlias"));
  c.attr("__class_getitem__") = generic;
  a.attr("__class_getitem__") = generic;
}

}  // namespace tandem::python

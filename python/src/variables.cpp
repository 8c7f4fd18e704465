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
      functions_by_type<SO2, SE2, SO3, SE3, SE23, Rn<1>, Rn<2>, Rn<3>, Rn<4>, Rn<5>, Rn<6>, Rn<9>, Rn<12>,
                        Bundle<SE3, R3>, Bundle<SE3, Rn<6>>, Bundle<SE3, SE3>, Bundle<SE2, R3>>();
  return all.at(group.type->name());
}

BlockVariables block_variables(py::handle value, const std::string& what) {
  BlockVariables result;
  const auto add = [&](py::handle item) {
    BlockVariables::State state;
    const Group* group = nullptr;
    if (py::isinstance<PyVariable>(item)) {
      const auto& x = item.cast<const PyVariable&>();
      state = {{x.handle}, true};
      group = x.group;
    } else if (py::isinstance<PyVariables>(item)) {
      const auto& x = item.cast<const PyVariables&>();
      state = {x.handles, false};
      group = x.group;
    } else {
      throw py::type_error(what + ": expected variables as returned by Problem.add, not " +
                           std::string(py::str(py::type::of(item).attr("__name__"))));
    }
    result.count = common_size(result.count, result.single, state.handles.size(), state.single, what);
    result.single = result.single && state.single;
    result.states.push_back(std::move(state));
    result.groups.push_back(group);
  };
  if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value))
    for (const py::handle item : value) add(item);
  else
    add(value);
  return result;
}

void bind_variables(py::module_& m) {
  py::class_<PyVariable> c(m, "Variable", "A variable of a problem, as returned by Problem.add.");
  c.def_property_readonly("name", [](const PyVariable& x) { return *x.handle.name; });
  c.def_property_readonly("group", [](const PyVariable& x) { return x.group->name; });
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
  py::class_<PyVariables> a(m, "Variables", "An array of variables of one group, as returned by Problem.add.");
  a.def("__len__", [](const PyVariables& x) { return x.handles.size(); });
  a.def("__getitem__", [](const PyVariables& x, py::ssize_t i) {
    const auto count = py::ssize_t(x.handles.size());
    if (i < -count || i >= count)
      throw py::index_error("index " + std::to_string(i) + " is outside the " + std::to_string(count) + " variables");
    return PyVariable{x.handles[std::size_t(i < 0 ? i + count : i)], x.group};
  });
  a.def("__getitem__", [](const PyVariables& x, const py::slice& slice) {
    std::size_t start, stop, step, length;
    if (!slice.compute(x.handles.size(), &start, &stop, &step, &length)) throw py::error_already_set();
    PyVariables part{{}, x.group};
    for (std::size_t i = 0; i < length; ++i) part.handles.push_back(x.handles[start + i * step]);
    return part;
  });
  a.def("__getitem__", [](const PyVariables& x, py::handle selection) {
    PyVariables part{{}, x.group};
    for (const std::size_t i : indices(selection, x.handles.size())) part.handles.push_back(x.handles[i]);
    return part;
  });
  a.def("__repr__", [](const PyVariables& x) {
    return "<" + std::to_string(x.handles.size()) + " variables: " + x.group->name + ">";
  });
}

}  // namespace tandem::python

#include <algorithm>
#include <array>

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <tandem/problem/nlp_evaluator.hpp>

#include "bind_group.hpp"
#include "problem_object.hpp"
#include "python_error.hpp"

namespace tandem::python {
namespace {

using Class = py::class_<PyProblem, std::shared_ptr<PyProblem>>;

py::object add_variables(PyProblem& self, py::handle initial, const std::string& name) {
  Problem& problem = self.change();
  const Group* group = group_of(initial);
  if (!group)
    throw py::type_error("add: expected a group element such as SE3 or R3(vector), not " +
                         std::string(py::str(py::type::of(initial).attr("__name__"))));
  const VariableFunctions& functions = variable_functions(*group);
  const auto [count, single] = group->count(initial);
  if (single) return py::cast(PyVariable{functions.add(problem, group->element(initial, 0), name), group});
  PyVariables variables{{}, group};
  variables.handles.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    variables.handles.push_back(functions.add(problem, group->element(initial, i),
                                              name.empty() ? std::string() : name + " " + std::to_string(i)));
  return py::cast(std::move(variables));
}

py::object value_of(const PyProblem& self, py::handle x) {
  const Problem& problem = self.read();
  const PyVariables variables = variables_of(x, "value");
  const VariableFunctions& functions = variable_functions(*variables.group);
  std::vector<const void*> values;
  for (const VariableHandle& handle : variables.handles) values.push_back(functions.value(problem, handle));
  return variables.group->make(values.data(), values.size(), py::isinstance<PyVariable>(x));
}

void set_value(PyProblem& self, py::handle x, py::handle value) {
  Problem& problem = self.change();
  const PyVariables variables = variables_of(x, "set_value");
  const Group* group = group_of(value);
  if (group != variables.group) throw py::type_error("set_value: expected a value of " + variables.group->name);
  const auto [count, single] = group->count(value);
  if (!single && count != variables.handles.size())
    throw py::value_error("set_value: expected " + std::to_string(variables.handles.size()) + " values, not " +
                          std::to_string(count));
  for (std::size_t i = 0; i < variables.handles.size(); ++i)
    variable_functions(*group).set_value(problem, variables.handles[i], group->element(value, single ? 0 : i));
}

/// Removes blocks or variables. If one of them is not in the problem, or a block still reads it, removes none.
void remove(Problem& problem, py::handle what) {
  if (py::isinstance<PyBlocks>(what)) {
    const auto& blocks = what.cast<const PyBlocks&>().blocks;
    for (std::size_t i = 0; i < blocks.size(); ++i)
      if (!problem.has(blocks[i]))
        raise("StaleHandleError", "remove: block " + std::to_string(i) + " of the " + std::to_string(blocks.size()) +
                                      " is not in the problem; nothing was removed");
    for (const Block& block : blocks)
      if (problem.has(block)) problem.remove(block);  // a block may be named twice
    return;
  }
  const std::vector<PyVariable> variables = all_variables(what, "remove");
  std::vector<int> ids;
  for (const PyVariable& x : variables) ids.push_back(problem.id(x.handle));
  const auto is_read = [&](int id) {
    const std::array<int, 1> one{id};
    return !problem.soft_blocks_reading(one).empty() || !problem.hard_blocks_reading(one).empty();
  };
  // If a block reads one of the variables, remove() throws the error here, before anything has been removed.
  if (!problem.soft_blocks_reading(ids).empty() || !problem.hard_blocks_reading(ids).empty())
    problem.remove(variables[std::size_t(std::find_if(ids.begin(), ids.end(), is_read) - ids.begin())].handle);
  for (const PyVariable& x : variables)
    if (problem.has(x.handle)) problem.remove(x.handle);
}

py::object variable_named(const PyProblem& self, py::handle given) {
  const Problem& problem = self.read();
  if (!py::isinstance<py::str>(given))
    throw py::type_error("Problem[name]: expected the name of a variable, not " +
                         std::string(py::str(py::type::of(given).attr("__name__"))));
  const auto name = given.cast<std::string>();
  std::vector<PyVariable> found;
  for (const Group* group : python::groups())
    for (const VariableHandle& x : variable_functions(*group).all(problem))
      if (*x.name == name) found.push_back({x, group});
  if (found.empty()) throw py::key_error("no variable has the name " + name);
  if (found.size() > 1) throw py::key_error(std::to_string(found.size()) + " variables have the name " + name);
  return py::cast(found[0]);
}

}  // namespace

std::vector<PyVariable> variables_of(const Problem& problem) {
  std::vector<std::pair<long long, PyVariable>> all;
  for (const Group* group : groups())
    for (const VariableHandle& x : variable_functions(*group).all(problem))
      all.emplace_back(problem.sequence_number(x.slot), PyVariable{x, group});
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<PyVariable> variables;
  for (auto& [number, variable] : all) variables.push_back(std::move(variable));
  return variables;
}

namespace {

/// Returns the free and fixed variables, and the blocks of each residual and role.
py::dict statistics(const PyProblem& self) {
  const Problem& problem = self.read();
  py::dict types, groups;
  for (const Block& block : problem.blocks()) {
    const std::string name(block.residual);
    types[py::str(name)] = (types.contains(name) ? types[py::str(name)].cast<int>() : 0) + 1;
  }
  for (const Group* group : python::groups())
    if (const std::size_t n = variable_functions(*group).all(problem).size()) groups[py::str(group->name)] = n;
  const Problem::Size size = problem.size();
  return py::dict(py::arg("variables") = problem.num_variables(), py::arg("groups") = groups,
                  py::arg("costs") = problem.num_soft_blocks(), py::arg("constraints") = problem.num_hard_blocks(),
                  py::arg("residuals") = types, py::arg("unknowns") = size.unknowns,
                  py::arg("equalities") = size.equalities, py::arg("inequalities") = size.inequalities);
}

py::list block_variables_of(const PyProblem& self) {
  const Problem& problem = self.read();
  py::list list;
  for (const Block& block : problem.blocks()) list.append(problem.variable_ids(block));
  return list;
}

}  // namespace

void bind_problem(py::module_& m) {
  Class c(m, "Problem", py::custom_type_setup(&collect_garbage),
          "Nonlinear least squares with hard constraints, over variables on Lie groups.\n\n"
          ">>> import tandem\n>>> p = tandem.Problem()\n>>> x = p.add(tandem.R1([0.0]), 'x')\n"
          ">>> cost = p.minimize(tandem.Prior(tandem.R1([2.0])), 1.0, x)\n"
          ">>> bound = p.subject_to(tandem.Prior(tandem.R1([0.0])), tandem.at_most(1.5), x)\n"
          ">>> p.solve().status\n'converged'\n>>> p.value(x).vector.round(6), p.multipliers(bound).round(6)\n"
          "(array([1.5]), array([0.5]))\n");
  c.def(py::init<>());
  c.def(
      "add", &add_variables, py::arg("initial"), py::arg("name") = "",
      "add(initial, name='')\n\nAdd a variable, or one for each element of an array. Return a Variable or Variables.");
  c.def("value", &value_of, py::arg("x"), "value(x)\n\nReturn the value of a variable, or the values of an array.");
  c.def("set_value", &set_value, py::arg("x"), py::arg("value"), "set_value(x, value)\n\nReplace values.");
  c.def(
      "fix",
      [](PyProblem& self, py::handle x, bool fixed) {
        for (const PyVariable& variable : all_variables(x, "fix")) self.change().fix(variable.handle, fixed);
        self.outdate_multipliers("the problem");
      },
      py::arg("x"), py::arg("fixed") = true, "fix(x, fixed=True)\n\nHold variables at their values, or free them.");
  c.def(
      "remove",
      [](PyProblem& self, py::handle what) {
        remove(self.change(), what);
        self.outdate_multipliers("the problem");
        self.drop_removed();
      },
      py::arg("what"),
      "remove(what)\n\nRemove blocks, or variables that no block reads: all of them, or none if there is an error.");
  c.def(
      "has",
      [](const PyProblem& self, py::handle what) {
        const Problem& problem = self.read();
        if (py::isinstance<PyBlocks>(what)) {
          const auto& blocks = what.cast<const PyBlocks&>().blocks;
          return std::all_of(blocks.begin(), blocks.end(), [&](const Block& block) { return problem.has(block); });
        }
        const std::vector<PyVariable> variables = all_variables(what, "has");
        return std::all_of(variables.begin(), variables.end(),
                           [&](const PyVariable& x) { return problem.has(x.handle); });
      },
      py::arg("what"), "has(what)\n\nReturn whether variables or blocks are in the problem, all of them.");
  c.def("__getitem__", &variable_named, py::arg("name"), "Return the variable of this name.");
  c.def(
      "cost",
      [](PyProblem& self) {
        const PyProblem::Solve solving(self);
        Problem& problem = self.read();
        const py::gil_scoped_release unlocked;
        return NlpEvaluator(problem).cost();
      },
      "cost()\n\nReturn the cost at the current values of the variables.");
  c.def("copy", &PyProblem::copy,
        "copy()\n\nReturn an independent copy. Blocks are valid in both; see counterpart() for variables.");
  c.def("__copy__", &PyProblem::copy);
  c.def("__deepcopy__", [](const PyProblem& self, const py::dict&) { return self.copy(); });
  c.def(
      "counterpart",
      [](const PyProblem& self, py::handle x) -> py::object {
        if (py::isinstance<PyVariable>(x)) {
          const auto& variable = x.cast<const PyVariable&>();
          return py::cast(PyVariable{self.read().counterpart(Variable<R3>(variable.handle)), variable.group});
        }
        if (!py::isinstance<PyVariables>(x))
          throw py::type_error("counterpart: expected a variable or an array of them");
        PyVariables result{{}, x.cast<const PyVariables&>().group};
        for (const VariableHandle& handle : x.cast<const PyVariables&>().handles)
          result.handles.push_back(self.read().counterpart(Variable<R3>(handle)));
        return py::cast(std::move(result));
      },
      py::arg("x"), "counterpart(x)\n\nReturn the handle, in this problem, of a variable of a copy.");
  c.def_property_readonly(
      "variables",
      [](const PyProblem& self) {
        py::list list;
        for (PyVariable& variable : variables_of(self.read())) list.append(std::move(variable));
        return list;
      },
      "All variables in the order in which they were added.");
  c.def_property_readonly("statistics", &statistics, "Counts of variables, blocks, unknowns and constraints.");
  c.def("_block_variables", &block_variables_of);
  c.def("__repr__", [](const PyProblem& self) {
    const Problem& problem = self.read();
    const Problem::Size size = problem.size();
    return "<Problem: " + std::to_string(problem.num_variables()) + " variables, " +
           std::to_string(problem.num_soft_blocks()) + " costs, " + std::to_string(problem.num_hard_blocks()) +
           " constraints, " + std::to_string(size.unknowns) + " unknowns>";
  });
  bind_blocks(m, c);
  bind_problem_files(c);
  bind_solve(m, c);
}

}  // namespace tandem::python

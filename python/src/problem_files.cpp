#include <map>

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <tandem/problem/file/problem_file.hpp>

#include "noise.hpp"
#include "problem_object.hpp"
#include "python_error.hpp"
#include "python_residual.hpp"

namespace tandem::python {
namespace {

std::string path_of(const py::object& path) { return py::str(py::module_::import("os").attr("fspath")(path)); }

/// Returns the text of the problem without its Python residuals, a list of these residuals, and the reason why there
/// are no multipliers. An entry of the list has the residual, the row of its data, the indices of its variables, and
/// (noise, loss) or (lower, upper, multipliers).
py::tuple pickled(const PyProblem& self) {
  const std::vector<PythonBlock> blocks = self.python_blocks();
  const Problem& problem = self.read();
  if (blocks.empty()) return py::make_tuple(problem_text(problem), py::list(), self.no_multipliers);
  std::map<int, std::size_t> position;  // index of a variable, by its slot
  for (const PyVariable& x : variables_of(problem)) position.emplace(x.handle.slot, position.size());
  Problem rest = problem.copy();
  py::list list;
  for (const PythonBlock& b : blocks) {
    std::vector<std::size_t> variables;
    for (const VariableHandle& x : b.variables) variables.push_back(position.at(x.slot));
    py::tuple role;
    if (b.hard) {
      const Bounds<Eigen::Dynamic> bounds = problem.bounds(b.block);
      role = py::make_tuple(bounds.lower, bounds.upper, problem.multipliers(b.block));
    } else {
      role = py::make_tuple(Noises{{problem.noise(b.block)}}, problem.loss(b.block));
    }
    list.append(py::make_tuple(b.callable, b.row, variables, role));
    rest.remove(b.block);
  }
  return py::make_tuple(problem_text(rest), list, self.no_multipliers);
}

std::shared_ptr<PyProblem> unpickled(const py::tuple& state) {
  auto self =
      std::make_shared<PyProblem>(std::make_shared<Problem>(parse_problem(state[0].cast<std::string>(), "pickle")));
  self->no_multipliers = state[2].cast<std::string>();
  Problem& problem = self->change();
  const std::vector<PyVariable> all = variables_of(problem);
  for (const py::handle item : state[1].cast<py::list>()) {
    const auto entry = py::reinterpret_borrow<py::tuple>(item);
    const auto callable = entry[0].cast<std::shared_ptr<Callable>>();
    const auto row = entry[1].cast<std::size_t>();
    const py::tuple role = entry[3];
    std::vector<VariableHandle> x;
    std::vector<const Group*> groups;
    for (const std::size_t i : entry[2].cast<std::vector<std::size_t>>()) {
      x.push_back(all.at(i).handle);
      groups.push_back(all.at(i).group);
    }
    const bool hard = role.size() == 3;
    const PythonResidualType type = python_residual_type(*callable, groups, hard);
    const PythonResidual object(callable, row, &type.groups);
    Block block;
    if (hard) {
      const auto lower = role[0].cast<std::vector<double>>(), upper = role[1].cast<std::vector<double>>();
      block = problem.subject_to(type.type, &object, x, lower, upper);
      problem.set_multipliers(block, role[2].cast<Eigen::VectorXd>());
    } else {
      block = problem.minimize(type.type, &object, x, role[0].cast<const Noises&>()[0], role[1].cast<Loss>());
    }
    self->remember({block, callable, row, hard, x});
  }
  return self;
}

}  // namespace

void bind_problem_files(py::class_<PyProblem, std::shared_ptr<PyProblem>>& c) {
  c.def(
      "write",
      [](const PyProblem& self, const py::object& path) {
        if (const auto blocks = self.python_blocks(); !blocks.empty())
          throw BadInputError("write: a problem file cannot hold residuals that are written in Python, such as " +
                              self.read().describe(blocks[0].block) + "; pickle the problem instead");
        write_problem(self.read(), path_of(path));
      },
      py::arg("path"), "write(path)\n\nWrite a problem file. Residuals of your own cannot be written, only pickled.");
  c.def_static(
      "read",
      [](const py::object& path) {
        const std::string file = path_of(path);
        return std::make_shared<PyProblem>(
            checked_input([&] { return std::make_shared<Problem>(read_problem(file)); }));
      },
      py::arg("path"), "read(path)\n\nRead a problem file.");
  c.def(py::pickle(&pickled, &unpickled));
}

}  // namespace tandem::python

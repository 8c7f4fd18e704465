#include <algorithm>

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <tandem/problem/problem_data.hpp>

#include "bind_group.hpp"
#include "noise.hpp"
#include "problem_object.hpp"
#include "python_error.hpp"
#include "python_residual.hpp"
#include "residual_family.hpp"

namespace tandem::python {
namespace {

/// Returns whether each block has a row of data.
bool has_rows(const Callable& callable) { return py::len(callable.data) > 0 || callable.numbers_each > 0; }

/// Adds one block, or one for each element of the arrays. add(i, x, type, object) adds block i.
template <class Add>
PyBlocks add_blocks(PyProblem& self, py::handle residual, const BlockVariables& x, bool hard, Add add) {
  std::vector<VariableHandle> handles(x.states.size());
  const auto variables = [&](std::size_t i) {
    for (std::size_t s = 0; s < handles.size(); ++s) handles[s] = x.at(s, i);
    return std::span<const VariableHandle>(handles);
  };
  if (py::isinstance<FamilyResidual>(residual)) {
    const BoundResidual bound(residual.cast<const FamilyResidual&>(), x.groups);
    const std::string& name = residual.cast<const FamilyResidual&>().family->name;
    const std::size_t count = common_size(x.count, x.single, bound.count(), bound.single(), name);
    const bool single = x.single && bound.single();
    const detail::ResidualType& type = hard ? *bound.instance().hard : *bound.instance().soft;
    PyBlocks blocks{{}, single};
    blocks.blocks.reserve(count);
    auto prepared = add(bound.dim(), count, name);
    self.outdate_multipliers("the problem");
    for (std::size_t i = 0; i < count; ++i)
      bound.make(i, [&](const void* object) { blocks.blocks.push_back(prepared(i, type, object, variables(i))); });
    return blocks;
  }
  if (!py::isinstance<Callable>(residual))
    throw py::type_error("expected a residual such as Prior(z), or one made by tandem.residual, not " +
                         std::string(py::str(py::type::of(residual).attr("__name__"))));
  const auto callable = residual.cast<std::shared_ptr<Callable>>();
  const bool rows = has_rows(*callable);
  const std::size_t count = common_size(x.count, x.single, callable->count, !rows, callable->name);
  const PythonResidualType type = python_residual_type(*callable, x.groups, hard);
  PyBlocks blocks{{}, x.single && !rows};
  auto prepared = add(callable->dim, count, callable->name);
  self.outdate_multipliers("the problem");
  for (std::size_t i = 0; i < count; ++i) {
    const PythonResidual object(callable, rows ? i : 0, &type.groups);
    blocks.blocks.push_back(prepared(i, type.type, &object, variables(i)));
    self.remember({blocks.blocks.back(), callable, rows ? i : 0, hard, handles});
  }
  return blocks;
}

const Block& only(const PyBlocks& blocks, const char* function) {
  if (blocks.blocks.size() != 1)
    throw py::value_error(std::string(function) + ": expected one block, not " + std::to_string(blocks.blocks.size()));
  return blocks.blocks[0];
}

/// Returns the number of rows of blocks, which all have one residual; 0 for no blocks. Throws if one of them is not in
/// the problem, or in another role.
template <class RowsOf>
int rows_of_all(const PyBlocks& blocks, RowsOf rows_of) {
  int dim = 0;
  for (const Block& block : blocks.blocks) dim = rows_of(block);
  return dim;
}

void set_noise(PyProblem& self, const PyBlocks& blocks, py::handle noise) {
  Problem& problem = self.change();
  const int dim = rows_of_all(blocks, [&](const Block& block) { return int(problem.noise(block).dim()); });
  if (blocks.blocks.empty()) return;
  const Noises all = noises(noise, dim, blocks.blocks.size(), "set_noise");
  for (std::size_t i = 0; i < blocks.blocks.size(); ++i) problem.set_noise(blocks.blocks[i], all[i]);
  self.outdate_multipliers("the noise");
}

void set_loss(PyProblem& self, const PyBlocks& blocks, py::handle loss) {
  Problem& problem = self.change();
  const Loss rho = loss_of(loss);
  for (const Block& block : blocks.blocks) problem.loss(block);  // throws, before anything has changed
  for (const Block& block : blocks.blocks) problem.set_loss(block, rho);
  self.outdate_multipliers("the loss");
}

void set_bounds(PyProblem& self, const PyBlocks& blocks, py::handle bounds) {
  Problem& problem = self.change();
  const PyBounds limits = bounds_of(bounds, "set_bounds");
  const int dim = rows_of_all(blocks, [&](const Block& block) { return int(problem.bounds(block).lower.size()); });
  if (blocks.blocks.empty()) return;
  limits.check(dim, blocks.blocks.size(), "set_bounds");
  for (std::size_t i = 0; i < blocks.blocks.size(); ++i)
    detail::ProblemData::set_bounds(problem, blocks.blocks[i], PyBounds::rows(limits.lower, i, dim),
                                    PyBounds::rows(limits.upper, i, dim));
  self.outdate_multipliers("a bound");
}

/// Replaces residuals in Python or compiled ones by others of the same name, rows and states.
void set_own_residual(PyProblem& self, const PyBlocks& blocks, const std::shared_ptr<Callable>& callable) {
  Problem& problem = self.change();
  const auto refuse = [&](const Block& block) {
    throw BadInputError("set_residual: the block is " + problem.describe(block) + ", not a residual " + callable->name +
                        " with " + std::to_string(callable->dim) +
                        " rows; use the same `name`, `dim` and kind of function, or remove the block and add another");
  };
  const detail::ResidualType* const present = detail::ProblemData::type_of(problem, blocks.blocks[0]);
  if (!present || !present->made_at_run_time) refuse(blocks.blocks[0]);
  std::vector<const Group*> groups;
  for (const detail::GroupType* state : static_cast<const detail::RunTimeResidualType*>(present)->states)
    groups.push_back(find_group(state->type));
  const PythonResidualType type = python_residual_type(*callable, groups, present->hard);
  for (const Block& block : blocks.blocks)
    if (detail::ProblemData::type_of(problem, block) != &type.type) refuse(block);
  const bool rows = has_rows(*callable);
  if (rows && callable->count != blocks.blocks.size())
    throw py::value_error("set_residual: there are " + std::to_string(callable->count) + " rows of data for " +
                          std::to_string(blocks.blocks.size()) + " blocks");
  for (std::size_t i = 0; i < blocks.blocks.size(); ++i) {
    const PythonResidual object(callable, rows ? i : 0, &type.groups);
    detail::ProblemData::set_residual(problem, blocks.blocks[i], type.type.functions, &object);
  }
  self.replace(blocks.blocks, callable, rows);
  self.outdate_multipliers("a residual");
}

void set_residual(PyProblem& self, const PyBlocks& blocks, py::handle residual) {
  Problem& problem = self.change();
  if (!py::isinstance<FamilyResidual>(residual) && !py::isinstance<Callable>(residual))
    throw py::type_error("set_residual: expected a residual such as Prior(z), or one made by tandem.residual, not " +
                         std::string(py::str(py::type::of(residual).attr("__name__"))));
  for (const Block& block : blocks.blocks) problem.describe(block);  // throws, before anything has changed
  if (blocks.blocks.empty()) return;
  if (py::isinstance<Callable>(residual))
    return set_own_residual(self, blocks, residual.cast<std::shared_ptr<Callable>>());
  const auto& given = residual.cast<const FamilyResidual&>();
  const detail::ResidualType* const present = detail::ProblemData::type_of(problem, blocks.blocks[0]);
  const Family& family = *given.family;
  const auto same = std::find_if(family.instances.begin(), family.instances.end(), [&](const Instance& instance) {
    return present && (instance.soft == present || instance.hard == present);
  });
  if (same == family.instances.end())
    throw BadInputError("set_residual: the block is " + problem.describe(blocks.blocks[0]) + ", not a residual " +
                        family.name);
  std::vector<const Group*> groups;
  for (const std::type_info* state : same->states) groups.push_back(find_group(*state));
  const BoundResidual bound(given, groups);
  if (!bound.single() && bound.count() != blocks.blocks.size())
    throw py::value_error("set_residual: there are " + std::to_string(bound.count()) + " residuals for " +
                          std::to_string(blocks.blocks.size()) + " blocks");
  for (std::size_t i = 0; i < blocks.blocks.size(); ++i)  // throws for wrong members, before anything has changed
    bound.make(i, [](const void*) {});
  for (std::size_t i = 0; i < blocks.blocks.size(); ++i)
    bound.make(i, [&](const void* object) {
      detail::ProblemData::set_residual(problem, blocks.blocks[i], present->functions, object);
    });
  self.outdate_multipliers("a residual");
}

Noises noise_of(const PyProblem& self, const PyBlocks& blocks) {
  Noises all{{}, blocks.single};
  for (const Block& block : blocks.blocks) all.noises.push_back(self.read().noise(block));
  return all;
}

py::object losses_of(const PyProblem& self, const PyBlocks& blocks) {
  py::list list;
  for (const Block& block : blocks.blocks) {
    const Loss loss = self.read().loss(block);
    list.append(loss.kind == Loss{}.kind ? py::object(py::none()) : py::cast(loss));
  }
  return blocks.single ? py::object(list[0]) : py::object(list);
}

PyBounds bounds_of_blocks(const PyProblem& self, const PyBlocks& blocks) {
  PyBounds all{{{}, 1, blocks.single}, {{}, 1, blocks.single}};
  for (const Block& block : blocks.blocks) {
    const Bounds<Eigen::Dynamic> bounds = self.read().bounds(block);
    all.lower.each = all.upper.each = std::size_t(bounds.lower.size());
    all.lower.numbers.insert(all.lower.numbers.end(), bounds.lower.begin(), bounds.lower.end());
    all.upper.numbers.insert(all.upper.numbers.end(), bounds.upper.begin(), bounds.upper.end());
  }
  return all;
}

void bind_class(py::module_& m) {
  py::class_<PyBlocks> b(m, "Blocks", "Blocks of a problem, as returned by Problem.minimize and subject_to.");
  b.def("__len__", [](const PyBlocks& blocks) { return blocks.blocks.size(); });
  b.def("__getitem__", [](const PyBlocks& blocks, py::handle index) {
    const Selection chosen = selection(index, blocks.blocks.size(), "blocks");
    PyBlocks part{{}, chosen.single};
    for (const std::size_t i : chosen.elements) part.blocks.push_back(blocks.blocks[i]);
    return part;
  });
  b.def("__repr__", [](const PyBlocks& blocks) {
    const std::size_t n = blocks.blocks.size();
    return "<" + std::to_string(n) + (n == 1 ? " block: " : " blocks: ") +
           (n ? std::string(blocks.blocks[0].residual) : std::string("none")) + ">";
  });
  refuse_pickle(b, "Problem.blocks lists them again");
}

}  // namespace

void bind_blocks(py::module_& m, py::class_<PyProblem, std::shared_ptr<PyProblem>>& c) {
  bind_class(m);
  c.def(
      "minimize",
      [](PyProblem& self, py::handle residual, py::handle noise, py::handle x, py::handle loss) {
        Problem& problem = self.change();
        const Loss rho = loss_of(loss);
        return add_blocks(self, residual, block_variables(x, "minimize"), false,
                          [&](int dim, std::size_t count, const std::string& name) {
                            return [&, all = noises(noise, dim, count, name)](
                                       std::size_t i, const detail::ResidualType& type, const void* object,
                                       std::span<const VariableHandle> handles) {
                              return problem.minimize(type, object, handles, all[i], rho);
                            };
                          });
      },
      py::arg("residual"), py::arg("noise"), py::arg("x"), py::arg("loss") = py::none(),
      "minimize(residual, noise, x, loss=None)\n\nAdd the cost rho(r' S^-1 r) / 2. `noise` is a Gaussian, a list of "
      "them, or standard deviations of shape (), (dim,) or (n, dim); `x` one variable, or a list of variables and "
      "arrays of variables: one block for each element.");
  c.def(
      "subject_to",
      [](PyProblem& self, py::handle residual, py::handle bounds, py::handle x) {
        Problem& problem = self.change();
        const PyBounds limits = bounds_of(bounds, "subject_to");
        return add_blocks(self, residual, block_variables(x, "subject_to"), true,
                          [&](int dim, std::size_t count, const std::string& name) {
                            limits.check(dim, count, name);
                            return [&, dim, lower = std::vector<double>(), upper = std::vector<double>()](
                                       std::size_t i, const detail::ResidualType& type, const void* object,
                                       std::span<const VariableHandle> handles) mutable {
                              if (i == 0 || !limits.single()) {
                                lower = PyBounds::rows(limits.lower, i, dim);
                                upper = PyBounds::rows(limits.upper, i, dim);
                              }
                              return problem.subject_to(type, object, handles, lower, upper);
                            };
                          });
      },
      py::arg("residual"), py::arg("bounds"), py::arg("x"),
      "subject_to(residual, bounds, x)\n\nAdd the constraint lower <= r <= upper; arrays of shape (n, "
      "dim) bound each of n blocks.");
  c.def(
      "multipliers",
      [](const PyProblem& self, const PyBlocks& blocks) -> py::object {
        const Problem& problem = self.read();
        for (const Block& block : blocks.blocks) problem.multipliers(block);  // throws for costs and other problems
        if (!self.no_multipliers.empty() && !blocks.blocks.empty()) raise("NumericalError", self.no_multipliers);
        if (blocks.single) return py::cast(problem.multipliers(only(blocks, "multipliers")));
        const int dim = blocks.blocks.empty() ? 0 : int(problem.multipliers(blocks.blocks[0]).size());
        Numbers result = new_array(blocks.blocks.size(), false, {dim});
        double* to = result.mutable_data();
        for (const Block& block : blocks.blocks) {
          const Eigen::VectorXd y = problem.multipliers(block);
          to = std::copy(y.begin(), y.end(), to);
        }
        return result;
      },
      py::arg("blocks"),
      "multipliers(blocks)\n\nReturn the Lagrange multipliers of the rows: the decrease of the minimal cost per unit "
      "by which the active bound is raised. Raise NumericalError unless the last solve converged.");
  c.def(
      "weight", [](const PyProblem& self, const PyBlocks& b) { return self.read().weight(only(b, "weight")); },
      py::arg("block"), "weight(block)\n\nReturn the weight that the robust loss gives a cost.");
  c.def(
      "linearization",
      [](const PyProblem& self, const PyBlocks& b) {
        self.forget_evaluations();
        const Problem::Linearization at = self.read().linearization(only(b, "linearization"));
        return py::make_tuple(at.residual, at.jacobian);
      },
      py::arg("block"), "linearization(block)\n\nReturn the rows and the Jacobian by all states side by side.");
  c.def("set_noise", &set_noise, py::arg("blocks"), py::arg("noise"),
        "set_noise(blocks, noise)\n\nReplace the noise of costs; `noise` is as in minimize().\n\n"
        ">>> import tandem\n>>> p = tandem.Problem()\n>>> x = p.add(tandem.R1([[0.0], [1.0]]))\n"
        ">>> blocks = p.minimize(tandem.Prior(tandem.R1([2.0])), 1.0, x)\n>>> p.set_noise(blocks, [[0.5], [2.0]])\n"
        ">>> p.noise(blocks).sigmas.ravel()\narray([0.5, 2. ])\n");
  c.def("set_loss", &set_loss, py::arg("blocks"), py::arg("loss"),
        "set_loss(blocks, loss)\n\nReplace the robust loss of costs; None removes it.");
  c.def("set_bounds", &set_bounds, py::arg("blocks"), py::arg("bounds"),
        "set_bounds(blocks, bounds)\n\nReplace the bounds of constraints; `bounds` are as in subject_to().");
  c.def("set_residual", &set_residual, py::arg("blocks"), py::arg("residual"),
        "set_residual(blocks, residual)\n\nReplace the measurements and parameters of costs or constraints. `residual` "
        "is of the same type, one for all blocks or an array. A residual of your own has the same name, number of rows "
        "and kind of function (Python or compiled).\n\n"
        ">>> import tandem\n>>> p = tandem.Problem()\n>>> x = p.add(tandem.R1([0.0]))\n"
        ">>> block = p.minimize(tandem.Prior(tandem.R1([2.0])), 1.0, x)\n"
        ">>> p.set_residual(block, tandem.Prior(tandem.R1([3.0])))\n>>> p.cost()\n4.5\n");
  c.def("noise", &noise_of, py::arg("blocks"), "noise(blocks)\n\nReturn the noise of costs as a Gaussian.");
  c.def("loss", &losses_of, py::arg("blocks"),
        "loss(blocks)\n\nReturn the robust loss of a cost, None if it has none; a list for an array of blocks.");
  c.def("bounds", &bounds_of_blocks, py::arg("blocks"), "bounds(blocks)\n\nReturn the bounds of constraints.");
  c.def_property_readonly(
      "blocks",
      [](const PyProblem& self) {
        py::list list;
        for (const Block& block : self.read().blocks()) list.append(PyBlocks{{block}, true});
        return list;
      },
      "All blocks, grouped by residual type and role.");
  c.def(
      "describe", [](const PyProblem& self, const PyBlocks& b) { return self.read().describe(only(b, "describe")); },
      py::arg("block"), "describe(block)\n\nReturn the residual and its variables, for messages.");
}

}  // namespace tandem::python

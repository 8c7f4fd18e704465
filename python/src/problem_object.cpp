#include "problem_object.hpp"

#include "callable.hpp"
#include "python_error.hpp"

namespace tandem::python {

Problem& PyProblem::read() const {
  if (solving_ && solver_.load() != std::this_thread::get_id())
    raise("BusyError", "the problem is being solved by another thread; wait, or use a copy");
  return *problem_;
}

Problem& PyProblem::change() {
  if (solving_) raise("BusyError", "the problem is being solved and cannot be changed; wait, or change a copy");
  return *problem_;
}

std::shared_ptr<PyProblem> PyProblem::copy() const {
  auto other = std::make_shared<PyProblem>(std::make_shared<Problem>(read().copy()));
  for (PythonBlock block : python_blocks()) {
    for (VariableHandle& x : block.variables) x = other->read().counterpart(Variable<R3>(x));  // the group is not used
    other->remember(std::move(block));
  }
  other->no_multipliers = no_multipliers;
  return other;
}

void PyProblem::remember(PythonBlock block) {
  if (callables_.empty() || callables_.back() != block.callable) callables_.push_back(block.callable);
  python_blocks_.push_back(std::move(block));
}

void PyProblem::forget_evaluations() const {
  for (const auto& callable : callables_) ++callable->computation;
}

std::vector<PythonBlock> PyProblem::python_blocks() const {
  std::vector<PythonBlock> present;
  for (const PythonBlock& block : python_blocks_)
    if (read().has(block.block)) present.push_back(block);
  return present;
}

PyProblem::Solve::Solve(PyProblem& problem) : problem_(problem) {
  if (problem.solving_.exchange(true)) raise("BusyError", "the problem is already being solved; solve a copy, or wait");
  problem.solver_ = std::this_thread::get_id();
  problem.forget_evaluations();
}

PyProblem::Solve::~Solve() {
  problem_.solver_ = std::thread::id();
  problem_.solving_ = false;
}

}  // namespace tandem::python

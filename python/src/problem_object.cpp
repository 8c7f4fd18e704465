#include "problem_object.hpp"

#include <map>
#include <tuple>
#include <utility>

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

void PyProblem::replace(const std::vector<Block>& blocks, const std::shared_ptr<Callable>& callable, bool rows) {
  const auto key = [](const Block& block) { return std::tuple(block.pool, block.id, block.generation); };
  std::map<std::tuple<int, int, unsigned>, std::size_t> row;
  for (std::size_t i = 0; i < blocks.size(); ++i) row[key(blocks[i])] = rows ? i : 0;
  std::vector<PythonBlock> present = python_blocks();
  python_blocks_.clear();
  callables_.clear();
  for (PythonBlock& block : present) {
    if (const auto at = row.find(key(block.block)); at != row.end()) {
      block.callable = callable;
      block.row = at->second;
    }
    remember(std::move(block));
  }
}

void PyProblem::drop_removed() {
  std::vector<PythonBlock> present = python_blocks();
  if (present.size() == python_blocks_.size()) return;
  const auto blocks = std::exchange(python_blocks_, {});  // destroyed last, because destructors may run any code
  const auto callables = std::exchange(callables_, {});
  for (PythonBlock& block : present) remember(std::move(block));
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

std::vector<std::shared_ptr<Callable>> PyProblem::own_callables() const {
  if (solving_) return {};  // the solver may copy or remove blocks
  // A problem has one pointer for each entry of its two lists, and one in each block that is still present.
  std::map<const Callable*, long> pointers;
  for (const auto& callable : callables_) ++pointers[callable.get()];
  for (const PythonBlock& b : python_blocks_) pointers[b.callable.get()] += problem_->has(b.block) ? 2 : 1;
  std::vector<std::shared_ptr<Callable>> own;
  for (const PythonBlock& b : python_blocks_)
    if (const auto at = pointers.find(b.callable.get()); at != pointers.end()) {
      if (b.callable.use_count() == at->second) own.push_back(b.callable);
      pointers.erase(at);
    }
  return own;
}

int PyProblem::traverse(visitproc visit, void* argument) const {
  for (const auto& f : own_callables())
    for (const py::handle object : {py::handle(f->function), py::handle(f->data), py::handle(f->owner)})
      if (object)
        if (const int result = visit(object.ptr(), argument)) return result;
  return 0;
}

void PyProblem::clear() {
  std::vector<py::object> garbage;  // destroyed last, because destructors may run any code
  for (const auto& f : own_callables()) {
    garbage.insert(garbage.end(), {f->function, f->data, f->owner});
    f->function = py::none();
    f->data = py::tuple();
    f->owner = py::none();
  }
}

namespace {

/// Returns the problem of an object, or null before its __init__() has ended.
PyProblem* find(PyObject* self) {
  const auto instance = reinterpret_cast<py::detail::instance*>(self)->get_value_and_holder();
  return instance.holder_constructed() ? instance.value_ptr<PyProblem>() : nullptr;
}

}  // namespace

void collect_garbage(PyHeapTypeObject* heap_type) {
  PyTypeObject& type = heap_type->ht_type;
  type.tp_flags |= Py_TPFLAGS_HAVE_GC;
  type.tp_traverse = [](PyObject* self, visitproc visit, void* arg) {
    Py_VISIT(Py_TYPE(self));
    const PyProblem* problem = find(self);
    return problem ? problem->traverse(visit, arg) : 0;
  };
  type.tp_clear = [](PyObject* self) {
    if (PyProblem* problem = find(self)) problem->clear();
    return 0;
  };
  type.tp_dealloc = [](PyObject* self) {
    PyObject_GC_UnTrack(self);
    py::detail::pybind11_object_dealloc(self);
  };
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

#pragma once

#include <atomic>
#include <memory>
#include <thread>

#include "variables.hpp"

namespace tandem::python {

/// A problem of the library with a guard against concurrent use. All functions but solves hold the interpreter's lock,
/// so a problem is used concurrently only while a solve has released it.
class PyProblem {
 public:
  PyProblem() : PyProblem(std::make_shared<Problem>()) {}
  explicit PyProblem(std::shared_ptr<Problem> problem) : problem_(std::move(problem)) {}

  /// Returns the problem for reading. Throws BusyError if another thread solves it.
  Problem& read() const;
  /// Returns the problem for changes. Throws BusyError if it is being solved, also from the solve's own callbacks.
  Problem& change();

  /// Marks the problem as being solved by this thread. Throws BusyError if it already is.
  class Solve {
   public:
    explicit Solve(PyProblem& problem);
    ~Solve();
    Solve(const Solve&) = delete;
    Solve& operator=(const Solve&) = delete;

   private:
    PyProblem& problem_;
  };

 private:
  std::shared_ptr<Problem> problem_;
  std::atomic<bool> solving_ = false;
  std::atomic<std::thread::id> solver_{};
};

/// Blocks that one call has added.
struct PyBlocks {
  std::vector<Block> blocks;
  bool single;
};

void bind_problem(py::module_& m);
void bind_solve(py::module_& m, py::class_<PyProblem, std::shared_ptr<PyProblem>>& c);
void bind_marginals(py::module_& m);
void bind_fixed_lag(py::module_& m);

}  // namespace tandem::python

#pragma once

#include <atomic>
#include <memory>
#include <thread>

#include "interrupt.hpp"
#include "variables.hpp"

namespace tandem::python {

struct Callable;

/// A block whose residual is written in Python or compiled, with what a pickle needs to add it again.
struct PythonBlock {
  Block block;
  std::shared_ptr<Callable> callable;
  std::size_t row;  ///< row of the data of the callable
  bool hard;
  std::vector<VariableHandle> variables;
};

/// A problem of the library with a guard against concurrent use. All functions but solves hold the interpreter's lock,
/// so a problem is used concurrently only while a solve has released it.
class PyProblem {
 public:
  PyProblem() : PyProblem(std::make_shared<Problem>()) {
    no_multipliers = "multipliers: the problem has not been solved; call solve() first";
  }
  explicit PyProblem(std::shared_ptr<Problem> problem) : problem_(std::move(problem)) {}

  /// Returns the problem for reading. Throws BusyError if another thread solves it.
  Problem& read() const;
  /// Returns the problem for changes. Throws BusyError if it is being solved, also from the solve's own callbacks.
  Problem& change();

  /// Returns an independent copy.
  std::shared_ptr<PyProblem> copy() const;
  /// Remembers a block that problem files cannot hold.
  void remember(PythonBlock block);
  /// Remembers that blocks have another residual in Python. Row i of the data belongs to block i if `rows` is true.
  void replace(const std::vector<Block>& blocks, const std::shared_ptr<Callable>& callable, bool rows);
  /// Releases the residuals in Python of blocks that have been removed.
  void drop_removed();
  /// Makes the next computation call all Python residuals again, since these may read data that have changed.
  void forget_evaluations() const;
  /// Shows Python's garbage collector the objects that only this problem keeps alive: those of residuals in Python. A
  /// function may refer to the problem itself, as a method of the object that holds it does.
  int traverse(visitproc visit, void* argument) const;
  /// Releases these objects. The problem is garbage.
  void clear();
  /// Returns those blocks that are still in the problem.
  std::vector<PythonBlock> python_blocks() const;

  /// Reason why the problem has no multipliers of a solution; empty if it has. Only the interpreter's lock guards it.
  std::string no_multipliers;
  /// Sets the reason after a solve.
  void set_solved(bool converged, const std::string& message) {
    no_multipliers = converged ? "" : "multipliers: the last solve did not converge: " + message;
  }
  /// Sets the reason after a change of `what`.
  void outdate_multipliers(const std::string& what) {
    if (no_multipliers.empty())
      no_multipliers = "multipliers: " + what + " has changed since the last solve; call solve() again";
  }

  /// Marks the problem as being solved by this thread. The constructor throws BusyError if the problem is already being
  /// solved. The caller holds the interpreter's lock during construction and destruction. At its exit, the interpreter
  /// sets the stop flags of all solves and waits until none is left.
  class Solve {
   public:
    explicit Solve(PyProblem& problem);
    ~Solve();
    Solve(const Solve&) = delete;
    Solve& operator=(const Solve&) = delete;

    std::atomic<bool>& stop() { return stop_; }
    /// Continues in this thread: residuals that it calls may read the problem.
    void continue_here() { problem_.solver_ = std::this_thread::get_id(); }

   private:
    std::atomic<bool> stop_ = false;
    RunningSolve running_{stop_};
    PyProblem& problem_;
  };

 private:
  /// Returns the callables that only this problem owns; none during a solve.
  std::vector<std::shared_ptr<Callable>> own_callables() const;

  std::shared_ptr<Problem> problem_;
  std::vector<PythonBlock> python_blocks_;
  std::vector<std::shared_ptr<const Callable>> callables_;  // of the blocks
  std::atomic<bool> solving_ = false;
  std::atomic<std::thread::id> solver_{};
};

/// Blocks that one call has added.
struct PyBlocks {
  std::vector<Block> blocks;
  bool single;
};

/// Returns all variables of a problem in the order in which they were added.
std::vector<PyVariable> variables_of(const Problem& problem);

/// Makes Python's garbage collector follow references from a class of PyProblem.
void collect_garbage(PyHeapTypeObject* type);
void bind_problem(py::module_& m);
/// Binds the class Blocks and the functions of a problem that add, read or change blocks.
void bind_blocks(py::module_& m, py::class_<PyProblem, std::shared_ptr<PyProblem>>& c);
void bind_problem_files(py::class_<PyProblem, std::shared_ptr<PyProblem>>& c);
void bind_solve(py::module_& m, py::class_<PyProblem, std::shared_ptr<PyProblem>>& c);
void bind_marginals(py::module_& m);
void bind_fit_report(py::module_& m);
void bind_fixed_lag(py::module_& m);
void bind_calibration(py::module_& m);
void bind_planner(py::module_& m);
void bind_online(py::module_& m);

}  // namespace tandem::python

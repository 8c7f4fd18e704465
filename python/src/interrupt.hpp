#pragma once

#include <atomic>

#include <pybind11/pybind11.h>

namespace tandem::python {

/// A computation that may run without the interpreter's lock. At the exit of the interpreter, all are asked to stop and
/// waited for, because a thread that takes the lock afterwards ends the process. Created and destroyed with the lock.
class RunningSolve {
 public:
  /// `stop` ends the computation and must outlive the object. Throws Stopped if the interpreter exits.
  explicit RunningSolve(std::atomic<bool>& stop);
  ~RunningSolve();
  RunningSolve(const RunningSolve&) = delete;
  RunningSolve& operator=(const RunningSolve&) = delete;

 private:
  std::atomic<bool>& stop_;
};
void bind_interrupt(pybind11::module_& m);

/// Returns f(), computed without the interpreter's lock. `stop` ends the computation, also at the exit of the interpreter.
template <class F>
auto run_unlocked(std::atomic<bool>& stop, F f) {
  const RunningSolve running(stop);
  const pybind11::gil_scoped_release unlocked;
  return f();
}

/// The stop flag of the solve that this thread runs, during the lifetime of the object. An interrupt (Ctrl-C) within a
/// Python residual sets it, so that the solve ends at its best point.
class SolveStop {
 public:
  explicit SolveStop(std::atomic<bool>& stop) : outer_(current()) { current() = &stop; }
  ~SolveStop() { current() = outer_; }
  SolveStop(const SolveStop&) = delete;
  SolveStop& operator=(const SolveStop&) = delete;

  /// Stops the solve of this thread. Returns false if there is none, or if it has been stopped before.
  static bool request() { return current() && !current()->exchange(true); }

 private:
  static std::atomic<bool>*& current() {
    static thread_local std::atomic<bool>* stop = nullptr;
    return stop;
  }
  std::atomic<bool>* outer_;
};

}  // namespace tandem::python

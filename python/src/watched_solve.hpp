#pragma once

#include <atomic>

#include <tandem/solvers/summary.hpp>

#include "interrupt.hpp"
#include "python_error.hpp"

namespace tandem::python {

/// A computation without the interpreter's lock. Between its iterations, Ctrl-C ends it at its best point, and a Python
/// function may receive its progress. The exit of the interpreter ends it, too.
class WatchedSolve {
 public:
  /// `progress` is a function or None.
  explicit WatchedSolve(py::object progress = py::none()) : progress_(std::move(progress)) {
    if (!progress_.is_none() && !PyCallable_Check(progress_.ptr()))
      throw py::type_error("progress: expected a function or None, not " + std::string(py::repr(progress_)));
  }
  WatchedSolve(const WatchedSolve&) = delete;

  const std::atomic<bool>& stop() { return stop_; }
  /// Adds the stop flag and the progress function to the options of a solve. The object must outlive the solve.
  template <class Options>
  void watch(Options& options) {
    options.stop = &stop();
    options.progress = [this](const Progress& p) {
      report([&] {
        return py::dict(py::arg("iteration") = p.iteration, py::arg("cost") = p.cost, py::arg("step") = p.step,
                        py::arg("violation") = p.violation, py::arg("seconds") = p.seconds);
      });
    };
  }
  /// Checks for Ctrl-C.
  void poll() {
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) stop_or_throw("signal: the handler", py::error_already_set());
  }
  /// Checks for Ctrl-C, and calls `progress` with the dictionary that values() returns.
  template <class Values>
  void report(Values values) {
    const py::gil_scoped_acquire lock;
    poll();
    if (progress_.is_none() || stop()) return;
    try {
      progress_(values());
    } catch (const py::error_already_set& error) {
      stop_or_throw("progress: the function", error);
    }
  }
  /// Returns f(), computed without the lock.
  template <class F>
  auto run(F f) {
    stop_ = false;
    const SolveStop of_this_thread(stop_);
    return run_unlocked(stop_, std::move(f));
  }

 private:
  void stop_or_throw(const char* source, const py::error_already_set& error) {
    if (!error.matches(PyExc_KeyboardInterrupt)) throw PythonError(source, error);
    stop_ = true;
  }

  std::atomic<bool> stop_ = false;
  py::object progress_;
};

}  // namespace tandem::python

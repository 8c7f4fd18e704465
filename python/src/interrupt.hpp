#pragma once

#include <atomic>

namespace tandem::python {

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

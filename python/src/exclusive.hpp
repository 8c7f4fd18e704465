#pragma once

#include <atomic>
#include <string>

#include "python_error.hpp"

namespace tandem::python {

/// Guards an object against concurrent use by threads while one of them has released the interpreter's lock.
class Exclusive {
 public:
  /// `what` is the object in messages, for example "planner".
  explicit Exclusive(std::string what) : what_(std::move(what)) {}

  /// Returns f(). Throws BusyError if another thread is within run().
  template <class F>
  auto run(F f) {
    if (busy_.exchange(true))
      raise("BusyError", "the " + what_ + " is used by another thread; wait, or make one for each thread");
    struct Done {
      std::atomic<bool>& busy;
      ~Done() { busy = false; }
    } const done{busy_};
    return f();
  }

 private:
  std::string what_;
  std::atomic<bool> busy_ = false;
};

}  // namespace tandem::python

#include "interrupt.hpp"

#include <chrono>
#include <thread>
#include <vector>

#include <tandem/problem/stop.hpp>

namespace tandem::python {
namespace {

namespace py = pybind11;

// Guarded by the interpreter's lock.
std::vector<std::atomic<bool>*> running;
bool exiting = false;

/// Stops all computations and waits until they have ended. Ctrl-C ends the waiting.
void stop_all() {
  exiting = true;
  while (!running.empty()) {
    for (std::atomic<bool>* stop : running) stop->store(true);
    {
      const py::gil_scoped_release unlocked;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
}

}  // namespace

RunningSolve::RunningSolve(std::atomic<bool>& stop) : stop_(stop) {
  if (exiting) throw Stopped("the solve was not started, because Python exits");
  running.push_back(&stop_);
}
RunningSolve::~RunningSolve() { std::erase(running, &stop_); }

void bind_interrupt(py::module_&) {
  // Runs after the interpreter has joined all threads but daemons.
  py::module_::import("atexit").attr("register")(py::cpp_function(&stop_all));
  // After a fork, the child process has only the thread that forked.
  const py::module_ os = py::module_::import("os");
  if (py::hasattr(os, "register_at_fork"))
    os.attr("register_at_fork")(py::arg("after_in_child") = py::cpp_function([] { running.clear(); }));
}

}  // namespace tandem::python

#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "arrays.hpp"

namespace tandem::python {

/// Source of the Jacobians of a Python residual.
enum class Jacobians { given, complex_step, differences };

/// The function of a residual: written in Python, or compiled by numba or C and given as a pointer.
struct Callable {
  /// `data` is a row of the data; x the plain numbers of all states; r the rows; J the Jacobians by right perturbations
  /// of all states side by side, row-major, to be set if `jacobians` is not 0. A result other than 0 means "undefined".
  using Pointer = int (*)(const double* data, const double* x, double* r, double* J, int jacobians);

  py::object function;        ///< null if compiled
  Pointer pointer = nullptr;  ///< null if in Python
  std::string name;
  int dim = 0;
  Jacobians jacobians = Jacobians::differences;
  bool batched = false;  ///< one call evaluates all blocks
  py::tuple data;        ///< arrays with one row for each block, which a batched function gets after the states
  std::size_t count = 1;
  std::vector<double> numbers;  ///< data of a compiled function, count × numbers_each
  std::size_t numbers_each = 0;
  py::object owner;  ///< keeps the code of a compiled function alive
  /// Number of evaluations whose complex steps are still to be compared with differences.
  mutable int complex_checks = 3;
  /// Increases at each begin of a solve or another computation. Results of earlier evaluations are then outdated, since
  /// a function may read data that have changed.
  mutable std::atomic<unsigned> computation = 0;

  Callable() = default;
  Callable(const Callable&) = delete;
  Callable& operator=(const Callable&) = delete;
  ~Callable();
};

/// Binds Callable as PythonResidual.
void bind_callable(py::module_& m);

}  // namespace tandem::python

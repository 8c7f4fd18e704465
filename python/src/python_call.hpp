#pragma once

#include <vector>

#include "python_residual.hpp"

namespace tandem::python {

/// One call of a Python function for several blocks, at given points. The caller holds the interpreter's lock.
class PythonCall {
 public:
  /// All residuals have the same callable, which reads `x`: one pointer for each state of each block.
  PythonCall(const PythonResidual* const* residuals, const void* const* x, std::size_t count);

  /// Evaluates rows and, if `jacobians`, Jacobians, and stores them in the residuals.
  void evaluate(bool jacobians);

 private:
  /// Returns the rows of the data that belong to the blocks.
  py::list data_of_blocks() const;
  py::object call(const py::dict& keywords = {}) const;
  /// Returns the numbers of a result, of `columns` columns; 0 for rows. Throws ResidualError if the shape is wrong.
  Numbers checked(const py::object& value, int columns, const char* what) const;
  /// Returns the rows with tangent entry k of state s increased by `step`.
  Numbers moved_rows(std::size_t s, int k, double step);

  void evaluate_given();
  /// Stores Jacobians by differences or complex steps.
  void differentiate(const Numbers& rows);
  /// Returns whether the column by a complex step could be compared with differences.
  bool add_complex_step(std::size_t s, int k, std::size_t first, const Numbers& rows);
  void store_rows(const Numbers& rows) const;
  /// Sets, or adds to, the column of the Jacobians at entry `first`.
  void store_column(std::size_t first, const Numbers& values, double factor, bool add) const;
  void store_points(bool jacobians) const;

  const PythonResidual* const* residuals_;
  const void* const* x_;
  std::size_t count_;
  const Callable& f_;
  const std::vector<const Group*>& groups_;
  std::size_t dim_;
  std::vector<py::object> arguments_;  ///< states of all blocks
  py::list data_;
};

}  // namespace tandem::python

#pragma once

#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

namespace tandem::python {

namespace py = pybind11;

/// Numbers of an array in C order: float64, any strides, integers and booleans accepted.
using Numbers = py::array_t<double, py::array::c_style>;

/// Returns the numbers of an array or of nested lists. Throws ValueError with the name `what` if an entry is not a real
/// number.
Numbers numbers(py::handle value, const std::string& what);
/// Throws ValueError with the name `what` if a number is NaN.
void reject_nan(const double* begin, std::size_t count, const std::string& what);

/// Returns "(3,)" or "(10, 4)".
std::string shape_text(const py::array& array);
/// Returns "(3, 3) or (n, 3, 3)": the shapes of one element and of n elements.
std::string wanted_shapes(const std::vector<py::ssize_t>& element);

/// Numbers of one element or of n elements that have the same shape.
struct Batch {
  Numbers array;
  std::size_t count;  ///< number of elements
  bool single;        ///< the array has the shape of one element

  const double* data() const { return array.data(); }
};
/// Returns the elements of this shape. Throws ValueError that names the shapes wanted, also for NaN and, if `finite`,
/// for infinity.
Batch batch(py::handle value, const std::vector<py::ssize_t>& element, const std::string& what, bool finite = true);

/// Returns a new array of elements with this shape; without the first axis if `single`.
Numbers new_array(std::size_t count, bool single, const std::vector<py::ssize_t>& element);

}  // namespace tandem::python

#pragma once

#include <tandem/residuals/bounds.hpp>
#include <tandem/residuals/gaussian.hpp>
#include <tandem/residuals/loss.hpp>

#include "arrays.hpp"

namespace tandem::python {

/// Noise of one block for all, or of each of n blocks. The Python class Gaussian holds it.
struct Noises {
  std::vector<Gaussian> noises;
  bool single = true;

  const Gaussian& operator[](std::size_t i) const { return noises[single ? 0 : i]; }
};
/// Converts a Gaussian or a list of them, a standard deviation for all rows, standard deviations of the rows (dim,), or
/// of the rows of n blocks (n, dim). Throws ValueError that names the shapes wanted.
Noises noises(py::handle value, int dim, std::size_t count, const std::string& what);

/// Bounds on one side of the rows of one block or of n blocks.
struct RowBounds {
  std::vector<double> numbers;
  std::size_t each = 1;  ///< numbers of a block: one for all of its rows, or one for each
  bool single = true;

  std::size_t count() const { return single ? 1 : numbers.size() / each; }
  double at(std::size_t block, std::size_t row) const {
    return numbers[(single ? 0 : block * each) + (each == 1 ? 0 : row)];
  }
};
/// Bounds of one block for all, or of each of n blocks.
struct PyBounds {
  RowBounds lower, upper;

  bool single() const { return lower.single && upper.single; }
  std::size_t count() const { return lower.single ? upper.count() : lower.count(); }
  /// Throws ValueError unless the bounds suit n blocks with this number of rows.
  void check(int dim, std::size_t n, const std::string& what) const;
  /// Returns the bounds on one side of all rows of a block.
  static std::vector<double> rows(const RowBounds& side, std::size_t block, int dim);
};
/// Converts bounds: a PyBounds or a list of them, a number (equality), or a pair (lower, upper).
PyBounds bounds_of(py::handle value, const std::string& what);
/// Converts None or a Loss.
Loss loss_of(py::handle value);

void bind_noise(py::module_& m);

}  // namespace tandem::python

#pragma once

#include <tandem/residuals/bounds.hpp>
#include <tandem/residuals/gaussian.hpp>
#include <tandem/residuals/loss.hpp>

#include "arrays.hpp"

namespace tandem::python {

/// Noises of n blocks: one for all, or standard deviations in rows.
struct Noises {
  std::vector<Gaussian> noises;

  const Gaussian& operator[](std::size_t i) const { return noises.size() == 1 ? noises[0] : noises[i]; }
};
/// Converts a Gaussian, a standard deviation for all rows, standard deviations of the rows (dim,), or of the rows of n
/// blocks (n, dim). Throws ValueError that names the shapes wanted.
Noises noises(py::handle value, int dim, std::size_t count, const std::string& what);

/// Bounds of all rows of a block.
struct PyBounds {
  std::vector<double> lower, upper;  ///< one entry for all rows, or one for each

  std::vector<double> expanded(const std::vector<double>& side, int dim, const std::string& what) const;
};
/// Converts bounds: a PyBounds, a number (equality), or a pair (lower, upper).
PyBounds bounds_of(py::handle value, const std::string& what);
/// Converts None or a Loss.
Loss loss_of(py::handle value);

void bind_noise(py::module_& m);

}  // namespace tandem::python

#pragma once

#include <string>
#include <vector>

#include "arrays.hpp"

namespace tandem::python {

/// Elements that an index chooses from an array.
struct Selection {
  std::vector<std::size_t> elements;
  bool single;  ///< the index is an integer
};
/// Returns the elements of an integer, a slice, a boolean mask or a list of integers, with the rules of NumPy for one
/// axis. Throws IndexError if one of them is outside the `count` elements, TypeError for other indices.
Selection selection(py::handle index, std::size_t count, const std::string& what);

}  // namespace tandem::python

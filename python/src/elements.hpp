#pragma once

#include <memory>
#include <string>
#include <typeinfo>
#include <vector>

#include <tandem/residuals/fields.hpp>

#include "arrays.hpp"

namespace tandem::python {

/// One element of a group, or an array of them. The Python classes SE3, SO2, … hold it.
template <LieGroup G>
struct Elements {
  std::vector<G> x;
  bool single = true;

  std::size_t size() const { return x.size(); }
  /// Returns element i, or the only element if there is a single one.
  const G& operator[](std::size_t i) const { return x[single ? 0 : i]; }
};

/// A group that Python knows, without its C++ type.
struct Group {
  std::string name;  ///< name of the Python class
  const std::type_info* type;
  int dof;
  std::size_t size;  ///< size of an element [bytes]
  int parameters;    ///< number of plain numbers of an element, see pack()

  /// Returns whether an object holds elements of this group.
  bool (*holds)(py::handle value);
  /// Returns the number of elements of an object, and whether it is a single element rather than an array.
  std::pair<std::size_t, bool> (*count)(py::handle value);
  const void* (*element)(py::handle value, std::size_t i);
  /// Returns a Python object with copies of these elements.
  py::object (*make)(const void* const* elements, std::size_t count, bool single);
  /// Writes the plain numbers of an element: [vector], [angle], [quaternion xyzw], or [translation, …, rotation].
  void (*pack)(const void* element, double* numbers);

  /// Passes the internal numbers of an element, as in problem files.
  void (*fields)(const void* element, Fields& fields);
};

/// All groups, in the order of their binding.
std::vector<const Group*>& groups();
/// Returns the group of a type, or null.
const Group* find_group(const std::type_info& type);
/// Returns the group of the elements that an object holds, or null.
const Group* group_of(py::handle value);

}  // namespace tandem::python

#include "selection.hpp"

namespace tandem::python {
namespace {

std::size_t checked(py::ssize_t i, std::size_t count, const std::string& what) {
  const auto n = py::ssize_t(count);
  if (i < -n || i >= n)
    throw py::index_error(what + ": index " + std::to_string(i) + " is outside the " + std::to_string(n) + " elements");
  return std::size_t(i < 0 ? i + n : i);
}

[[noreturn]] void refuse(py::handle index, const std::string& what) {
  throw py::type_error(what + ": an index is an integer, a slice, a boolean mask or a list of integers, not " +
                       std::string(py::repr(index)).substr(0, 60));
}

}  // namespace

Selection selection(py::handle index, std::size_t count, const std::string& what) {
  Selection result{{}, false};
  if (PySlice_Check(index.ptr())) {
    std::size_t start, stop, step, length;
    if (!py::reinterpret_borrow<py::slice>(index).compute(count, &start, &stop, &step, &length))
      throw py::error_already_set();
    for (std::size_t i = 0; i < length; ++i) result.elements.push_back(start + i * step);
    return result;
  }
  const bool is_list = py::isinstance<py::list>(index);
  if (!is_list && !py::isinstance<py::array>(index)) {
    if (PyBool_Check(index.ptr()) || !PyIndex_Check(index.ptr())) refuse(index, what);
    const py::ssize_t i = PyNumber_AsSsize_t(index.ptr(), PyExc_IndexError);
    if (i == -1 && PyErr_Occurred()) throw py::error_already_set();
    return {{checked(i, count, what)}, true};
  }
  const py::array all = py::array::ensure(index);
  if (!all) {
    PyErr_Clear();
    refuse(index, what);
  }
  const char kind = all.dtype().kind();
  if (is_list && all.size() == 0 && all.ndim() == 1) return result;
  if (all.ndim() > 1 || (kind != 'b' && kind != 'i' && kind != 'u')) refuse(index, what);
  if (kind == 'b') {
    if (all.ndim() != 1 || std::size_t(all.size()) != count)
      throw py::index_error(what + ": the mask has shape " + shape_text(all) + ", but there are " +
                            std::to_string(count) + " elements");
    const auto mask = py::array_t<bool, py::array::forcecast>::ensure(all);
    for (std::size_t i = 0; i < count; ++i)
      if (mask.data(py::ssize_t(i))[0]) result.elements.push_back(i);
    return result;
  }
  const auto indices = py::array_t<py::ssize_t, py::array::c_style | py::array::forcecast>::ensure(all);
  for (py::ssize_t k = 0; k < indices.size(); ++k) result.elements.push_back(checked(indices.data()[k], count, what));
  result.single = all.ndim() == 0;
  return result;
}

}  // namespace tandem::python

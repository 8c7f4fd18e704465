#include "arrays.hpp"

#include <algorithm>
#include <cmath>

#include "elements.hpp"

namespace tandem::python {
namespace {

std::string tuple_text(const std::vector<py::ssize_t>& shape, bool many) {
  std::string text = many ? "(n" : "(";
  for (std::size_t i = 0; i < shape.size(); ++i) text += (i || many ? ", " : "") + std::to_string(shape[i]);
  return text + (shape.size() + many == 1 ? ",)" : ")");
}

/// Returns the numbers of a value. The message names the shapes wanted if `element`, the shape of one element, is given.
Numbers real_numbers(py::handle value, const std::string& what, const std::vector<py::ssize_t>* element) {
  const bool plain = Py_TYPE(value.ptr()) == py::detail::npy_api::get().PyArray_Type_;
  if (plain && py::isinstance<Numbers>(value)) return py::reinterpret_borrow<Numbers>(value);
  const auto refuse = [&](const std::string& given) {
    throw py::value_error(what + ": expected real numbers" + (element ? " of shape " + wanted_shapes(*element) : "") +
                          ", not " + given);
  };
  const auto type = [&] { return std::string(py::str(py::type::of(value).attr("__name__"))); };
  if (group_of(value)) refuse(type());  // NumPy would iterate over its elements
  const py::array any = py::array::ensure(value);
  if (!any) {
    PyErr_Clear();
    refuse(type());
  }
  if (!plain && py::hasattr(value, "mask") && py::module_::import("numpy").attr("ma").attr("is_masked")(value).cast<bool>())
    refuse("an array with masked entries");
  const char kind = any.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b')
    refuse(any.ndim() == 0 ? type() : "entries of type " + std::string(py::str(any.dtype())));
  return py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(any);
}

}  // namespace

Numbers numbers(py::handle value, const std::string& what) { return real_numbers(value, what, nullptr); }

void reject_nan(const double* begin, std::size_t count, const std::string& what) {
  if (std::any_of(begin, begin + count, [](double x) { return std::isnan(x); }))
    throw py::value_error(what + ": the array contains NaN");
}

std::string shape_text(const py::array& array) {
  return tuple_text({array.shape(), array.shape() + array.ndim()}, false);
}

std::string wanted_shapes(const std::vector<py::ssize_t>& element) {
  return tuple_text(element, false) + " or " + tuple_text(element, true);
}

Batch batch(py::handle value, const std::vector<py::ssize_t>& element, const std::string& what, bool finite) {
  const Numbers array = real_numbers(value, what, &element);
  const auto rank = py::ssize_t(element.size());
  const py::ssize_t more = array.ndim() - rank;
  if ((more != 0 && more != 1) || !std::equal(element.begin(), element.end(), array.shape() + more))
    throw py::value_error(what + ": expected an array of shape " + wanted_shapes(element) + ", not " +
                          (array.ndim() == 0 ? "a single number" : shape_text(array)));
  reject_nan(array.data(), std::size_t(array.size()), what);
  if (finite && std::any_of(array.data(), array.data() + array.size(), [](double x) { return std::isinf(x); }))
    throw py::value_error(what + ": the array contains infinity");
  return {array, more ? std::size_t(array.shape(0)) : 1, more == 0};
}

Numbers new_array(std::size_t count, bool single, const std::vector<py::ssize_t>& element) {
  std::vector<py::ssize_t> shape;
  if (!single) shape.push_back(py::ssize_t(count));
  shape.insert(shape.end(), element.begin(), element.end());
  return Numbers(shape);
}

}  // namespace tandem::python

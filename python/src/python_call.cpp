#include "python_call.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstring>
#include <limits>

#include <pybind11/complex.h>

#include "complex_step.hpp"
#include "python_error.hpp"

namespace tandem::python {
namespace {

bool is_vector(const Group& group) { return group.name[0] == 'R'; }

/// Returns the argument of a Python function: an array for vectors, otherwise group elements.
py::object argument(const Group& group, const void* const* elements, std::size_t count, bool single) {
  if (!is_vector(group)) return group.make(elements, count, single);
  Numbers x = new_array(count, single, {group.dof});
  for (std::size_t i = 0; i < count; ++i)
    std::memcpy(x.mutable_data() + i * std::size_t(group.dof), elements[i], std::size_t(group.dof) * sizeof(double));
  return x;
}

/// Returns the argument with tangent entry k increased by `step`, which is complex for a complex step.
py::object perturbed(const py::object& x, const Group& group, int k, const py::object& step) {
  Numbers unit(group.dof);
  std::fill_n(unit.mutable_data(), group.dof, 0.0);
  unit.mutable_data()[k] = 1.0;
  const py::object by = unit.attr("__mul__")(step);
  return is_vector(group) ? x.attr("__add__")(by) : x.attr("plus")(by);
}

}  // namespace

PythonCall::PythonCall(const PythonResidual* const* residuals, const void* const* x, std::size_t count)
    : residuals_(residuals),
      x_(x),
      count_(count),
      f_(*residuals[0]->callable_),
      groups_(*residuals[0]->groups_),
      dim_(std::size_t(f_.dim)) {
  std::vector<const void*> of_state(count);
  for (std::size_t s = 0; s < groups_.size(); ++s) {
    for (std::size_t i = 0; i < count; ++i) of_state[i] = x[i * groups_.size() + s];
    arguments_.push_back(argument(*groups_[s], of_state.data(), count, !f_.batched));
  }
  data_ = data_of_blocks();
}

py::list PythonCall::data_of_blocks() const {
  py::list data;
  if (!f_.batched || py::len(f_.data) == 0) return data;
  bool all = count_ == f_.count;
  for (std::size_t i = 0; i < count_ && all; ++i) all = residuals_[i]->row_ == i;
  py::array_t<py::ssize_t> rows(all ? 0 : py::ssize_t(count_));
  for (std::size_t i = 0; i < count_ && !all; ++i) rows.mutable_data()[i] = py::ssize_t(residuals_[i]->row_);
  for (const py::handle item : f_.data)
    data.append(all ? py::reinterpret_borrow<py::object>(item) : py::object(item.attr("__getitem__")(rows)));
  return data;
}

py::object PythonCall::call(const py::dict& keywords) const {
  py::list list;
  // A function that changes an array in place gets a copy, because differences start from the original.
  for (std::size_t s = 0; s < arguments_.size(); ++s)
    list.append(is_vector(*groups_[s]) ? arguments_[s].attr("copy")() : arguments_[s]);
  for (const py::handle item : data_) list.append(item);
  return f_.function(*py::tuple(list), **keywords);
}

Numbers PythonCall::checked(const py::object& value, int columns, const char* what) const {
  std::vector<py::ssize_t> shape;
  if (f_.batched) shape.push_back(py::ssize_t(count_));
  shape.push_back(f_.dim);
  if (columns) shape.push_back(columns);
  Numbers array = numbers(value, f_.name + ": " + what);
  const py::ssize_t wanted = py::ssize_t(count_) * f_.dim * std::max(columns, 1);
  // A residual with one row may omit the axis of its rows.
  const bool scalar = f_.dim == 1 && array.size() == wanted && array.ndim() + 1 == py::ssize_t(shape.size());
  if (!scalar && !std::equal(shape.begin(), shape.end(), array.shape(), array.shape() + array.ndim())) {
    std::string text;
    for (const py::ssize_t n : shape) text += (text.empty() ? "" : ", ") + std::to_string(n);
    raise("ResidualError", f_.name + ": the residual returned " + what + " of shape " + shape_text(array) +
                               "; expected (" + text + (shape.size() == 1 ? ",)" : ")"));
  }
  return array;
}

Numbers PythonCall::moved_rows(std::size_t s, int k, double step) {
  const py::object x = arguments_[s];
  arguments_[s] = perturbed(x, *groups_[s], k, py::float_(step));
  Numbers rows = checked(call(), 0, "rows");
  arguments_[s] = x;
  return rows;
}

void PythonCall::store_rows(const Numbers& rows) const {
  for (std::size_t i = 0; i < count_; ++i) {
    residuals_[i]->allocate();
    std::copy_n(rows.data() + i * dim_, dim_, residuals_[i]->rows_.data());
  }
}

void PythonCall::store_column(std::size_t first, const Numbers& values, double factor, bool add) const {
  for (std::size_t i = 0; i < count_; ++i) {
    double* to = residuals_[i]->J_.data() + first;
    for (std::size_t row = 0; row < dim_; ++row)
      to[row] = (add ? to[row] : 0.0) + factor * values.data()[i * dim_ + row];
  }
}

void PythonCall::store_points(bool jacobians) const {
  for (std::size_t i = 0; i < count_; ++i) {
    std::byte* to = residuals_[i]->x_.data();
    for (std::size_t s = 0; s < groups_.size(); to += groups_[s]->size, ++s)
      std::memcpy(to, x_[i * groups_.size() + s], groups_[s]->size);
    residuals_[i]->has_rows_ = true;
    residuals_[i]->has_jacobians_ = jacobians;
  }
}

void PythonCall::evaluate_given() {
  const py::object result = call(py::dict(py::arg("jacobians") = true));
  if (!py::isinstance<py::tuple>(result) || py::len(result) != 2)
    raise("ResidualError", f_.name + ": with jacobians=True the residual must return (rows, [Jacobian of each state])");
  const auto pair = py::reinterpret_borrow<py::tuple>(result);
  store_rows(checked(pair[0], 0, "rows"));
  const py::sequence list = pair[1];
  if (list.size() != groups_.size())
    raise("ResidualError", f_.name + ": the residual returned " + std::to_string(list.size()) + " Jacobians for " +
                               std::to_string(groups_.size()) + " states");
  std::size_t first = 0;
  for (std::size_t s = 0; s < groups_.size(); ++s) {
    const auto dofs = std::size_t(groups_[s]->dof);
    const Numbers J = checked(list[s], groups_[s]->dof, "a Jacobian");
    const double* from = J.data();
    for (std::size_t i = 0; i < count_; ++i, from += dim_ * dofs) {
      double* to = residuals_[i]->J_.data() + first;
      for (std::size_t row = 0; row < dim_; ++row)
        for (std::size_t k = 0; k < dofs; ++k) to[k * dim_ + row] = from[row * dofs + k];
    }
    first += dim_ * dofs;
  }
}

bool PythonCall::add_complex_step(std::size_t s, int k, std::size_t first, const Numbers& rows) {
  const py::object x = arguments_[s];
  arguments_[s] = perturbed(x, *groups_[s], k, py::cast(std::complex<double>(0, kComplexStep)));
  const py::object value = py::module_::import("numpy").attr("asarray")(call());
  arguments_[s] = x;
  Numbers step = checked(value.attr("imag").attr("copy")(), 0, "rows");
  const Numbers real = checked(value.attr("real"), 0, "rows");
  for (py::ssize_t i = 0; i < step.size(); ++i)  // an undefined row may have no imaginary part
    if (!std::isfinite(real.data()[i])) step.mutable_data()[i] = std::numeric_limits<double>::quiet_NaN();
  store_column(first, step, 1 / kComplexStep, false);
  return f_.complex_checks == 0 || compare_complex_step(f_.name, s, k, step, rows, moved_rows(s, k, kDifferenceStep),
                                                        moved_rows(s, k, -kDifferenceStep));
}

void PythonCall::differentiate(const Numbers& rows) {
  const bool complex = f_.jacobians == Jacobians::complex_step;
  bool compared = true;
  std::size_t first = 0;
  for (std::size_t s = 0; s < groups_.size(); ++s)
    for (int k = 0; k < groups_[s]->dof; ++k, first += dim_) {
      if (complex) {
        compared &= add_complex_step(s, k, first, rows);
        continue;
      }
      for (const double sign : {1.0, -1.0})
        store_column(first, moved_rows(s, k, sign * kDifferenceStep), sign / (2 * kDifferenceStep), sign < 0);
    }
  if (complex && f_.complex_checks > 0) f_.complex_checks = compared ? 0 : f_.complex_checks - 1;
}

void PythonCall::evaluate(bool jacobians) {
  if (jacobians && f_.jacobians == Jacobians::given) {
    evaluate_given();
  } else {
    const py::dict keywords = f_.jacobians == Jacobians::given ? py::dict(py::arg("jacobians") = false) : py::dict();
    const Numbers rows = checked(call(keywords), 0, "rows");
    store_rows(rows);
    if (jacobians) differentiate(rows);
  }
  store_points(jacobians);
}

}  // namespace tandem::python

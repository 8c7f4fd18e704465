#include "python_residual.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstring>
#include <map>
#include <mutex>

#include <pybind11/complex.h>

#include <tandem/problem/stop.hpp>

#include "complex_step.hpp"
#include "interrupt.hpp"
#include "python_error.hpp"

namespace tandem::python {
namespace {

constexpr std::size_t kMaxParameters = std::size_t(detail::kMaxStates) * 16;

/// A residual type with its tables, which problems refer to.
struct RunTimeType {
  std::string name;
  std::vector<const Group*> groups;
  std::vector<int> dofs;
  detail::ResidualFunctions functions{};
  std::unique_ptr<detail::RunTimeResidualType> type;
};

const PythonResidual& cast(const void* residual) { return *static_cast<const PythonResidual*>(residual); }

bool is_vector(const Group& group) { return group.name[0] == 'R'; }

/// Returns the argument of a Python function: an array for vectors, otherwise group elements.
py::object argument(const Group& group, const void* const* elements, std::size_t count, bool single) {
  if (!is_vector(group)) return group.make(elements, count, single);
  Numbers x = new_array(count, single, {group.dof});
  for (std::size_t i = 0; i < count; ++i)
    std::memcpy(x.mutable_data() + i * std::size_t(group.dof), elements[i], std::size_t(group.dof) * sizeof(double));
  return std::move(x);
}

/// Returns the argument with tangent entry k increased by `step`, which is complex for a complex step.
py::object perturbed(const py::object& x, const Group& group, int k, const py::object& step) {
  Numbers unit(group.dof);
  std::fill_n(unit.mutable_data(), group.dof, 0.0);
  unit.mutable_data()[k] = 1.0;
  const py::object by = unit.attr("__mul__")(step);
  return is_vector(group) ? x.attr("__add__")(by) : x.attr("plus")(by);
}

std::shared_ptr<Callable> make_callable(py::object function, std::uintptr_t pointer, const std::string& name, int dim,
                                        const std::string& jacobian, bool batched, const py::tuple& data,
                                        std::size_t count, const Numbers& numbers, py::object owner) {
  auto f = std::make_shared<Callable>();
  f->function = std::move(function);
  f->pointer = reinterpret_cast<Callable::Pointer>(pointer);
  f->name = name;
  f->dim = dim;
  f->jacobians = jacobian == "given"     ? Jacobians::given
                 : jacobian == "complex" ? Jacobians::complex_step
                                         : Jacobians::differences;
  f->batched = batched;
  f->data = data;
  f->count = count;
  f->numbers.assign(numbers.data(), numbers.data() + numbers.size());
  f->numbers_each = count ? f->numbers.size() / count : 0;
  f->owner = std::move(owner);
  return f;
}

}  // namespace

Callable::~Callable() {
  if (!Py_IsInitialized()) {  // the problem outlives the interpreter
    function.release();
    data.release();
    owner.release();
    return;
  }
  const py::gil_scoped_acquire lock;
  function = py::object();
  data = py::tuple();
  owner = py::object();
}

PythonResidualType python_residual_type(const Callable& callable, const std::vector<const Group*>& groups, bool hard) {
  using Key = std::tuple<std::string, int, std::vector<const Group*>, bool, bool>;
  static std::map<Key, RunTimeType> types;  // guarded by the interpreter's lock
  const bool compiled = callable.pointer != nullptr;
  RunTimeType& t = types[{callable.name, callable.dim, groups, hard, compiled}];
  if (t.type) return {*t.type, t.groups};
  if (callable.dim < 1 || callable.dim > detail::kMaxRows || groups.empty() ||
      groups.size() > std::size_t(detail::kMaxStates))
    throw BadInputError(callable.name + ": a residual has 1 to " + std::to_string(detail::kMaxRows) +
                        " rows and reads 1 to " + std::to_string(detail::kMaxStates) + " variables");
  t.name = callable.name;
  t.groups = groups;
  std::vector<const detail::GroupType*> states;
  for (const Group* group : groups) {
    t.dofs.push_back(group->dof);
    states.push_back(variable_functions(*group).type);
  }
  detail::ResidualFunctions& f = t.functions;
  f.name = t.name;
  f.type = &typeid(PythonResidual);
  f.dim = callable.dim;
  f.arity = int(groups.size());
  f.dofs = t.dofs.data();
  f.size = sizeof(PythonResidual);
  f.alignment = alignof(PythonResidual);
  f.copy = [](const void* from, void* to) { ::new (to) PythonResidual(cast(from)); };
  f.relocate = [](void* from, void* to) {
    auto* source = static_cast<PythonResidual*>(from);
    ::new (to) PythonResidual(std::move(*source));
    source->~PythonResidual();
  };
  f.destroy = [](void* residual) { static_cast<PythonResidual*>(residual)->~PythonResidual(); };
  f.evaluate = [](const void* residual, const void* const* x, double* r) { cast(residual).evaluate(x, r); };
  f.linearize = [](const void* residual, const void* const* x, const int* offset, double* r, double* const* J) {
    cast(residual).linearize(x, offset, r, J);
  };
  t.type =
      std::make_unique<detail::RunTimeResidualType>(f, hard, states, compiled ? nullptr : &PythonResidual::prepare);
  return {*t.type, t.groups};
}

bool PythonResidual::is_known(const void* const* x, bool jacobians) const {
  if (!has_rows_ || (jacobians && !has_jacobians_)) return false;
  const std::byte* known = x_.data();
  for (std::size_t s = 0; s < groups_->size(); known += (*groups_)[s]->size, ++s)
    if (std::memcmp(known, x[s], (*groups_)[s]->size) != 0) return false;
  return true;
}

void PythonResidual::allocate() const {
  if (!rows_.empty()) return;
  std::size_t bytes = 0, columns = 0;
  for (const Group* group : *groups_) {
    bytes += group->size;
    columns += std::size_t(group->dof);
  }
  x_.resize(bytes);
  rows_.resize(std::size_t(callable_->dim));
  J_.resize(std::size_t(callable_->dim) * columns);
}

void PythonResidual::prepare(const detail::PoolBase& pool, bool jacobians) {
  const auto count = std::size_t(pool.size()), arity = std::size_t(pool.arity());
  std::vector<const PythonResidual*> residuals(count);
  std::vector<const void*> x(count * arity);
  bool known = true;
  for (std::size_t i = 0; i < count; ++i) {
    residuals[i] = &cast(pool.residual(int(i)));
    pool.points(int(i), &x[i * arity]);
    known = known && residuals[i]->is_known(&x[i * arity], jacobians);
  }
  if (known) return;
  const py::gil_scoped_acquire lock;
  for (std::size_t i = 0, end; i < count; i = end) {
    end = i + 1;
    if (residuals[i]->callable_->batched)
      while (end < count && residuals[end]->callable_ == residuals[i]->callable_) ++end;
    call(&residuals[i], &x[i * arity], end - i, jacobians);
  }
}

void PythonResidual::call(const PythonResidual* const* residuals, const void* const* x, std::size_t count,
                          bool jacobians) {
  for (std::size_t i = 0; i < count; ++i) residuals[i]->has_rows_ = residuals[i]->has_jacobians_ = false;
  const std::string& name = residuals[0]->callable_->name;
  try {
    try {
      call_locked(residuals, x, count, jacobians);
    } catch (const py::builtin_exception& error) {
      error.set_error();
      throw py::error_already_set();
    }
  } catch (const py::error_already_set& error) {
    if (error.matches(PyExc_KeyboardInterrupt)) {
      // The solver needs this evaluation to end at its best point.
      if (SolveStop::request()) return call(residuals, x, count, jacobians);
      throw Stopped(name + ": interrupted");
    }
    if (error.matches(exception_class("UndefinedResidualError")))
      throw UndefinedResidualError(std::string(py::str(error.value())));
    throw PythonError(name, error);
  }
}

void PythonResidual::call_locked(const PythonResidual* const* residuals, const void* const* x, std::size_t count,
                                 bool jacobians) {
  const Callable& f = *residuals[0]->callable_;
  const std::vector<const Group*>& groups = *residuals[0]->groups_;
  const std::size_t arity = groups.size(), dim = std::size_t(f.dim);
  const bool single = !f.batched;
  std::vector<py::object> arguments;
  std::vector<const void*> of_state(count);
  for (std::size_t s = 0; s < arity; ++s) {
    for (std::size_t i = 0; i < count; ++i) of_state[i] = x[i * arity + s];
    arguments.push_back(argument(*groups[s], of_state.data(), count, single));
  }
  // Rows of the data that belong to these blocks.
  py::list data;
  if (f.batched && py::len(f.data) > 0) {
    bool all = count == f.count;
    for (std::size_t i = 0; i < count && all; ++i) all = residuals[i]->row_ == i;
    py::array_t<py::ssize_t> rows(all ? 0 : py::ssize_t(count));
    for (std::size_t i = 0; i < count && !all; ++i) rows.mutable_data()[i] = py::ssize_t(residuals[i]->row_);
    for (const py::handle item : f.data)
      data.append(all ? py::reinterpret_borrow<py::object>(item) : py::object(item.attr("__getitem__")(rows)));
  }
  const auto call = [&](const py::dict& keywords) {
    py::list list;
    for (const py::object& argument : arguments) list.append(argument);
    for (const py::handle item : data) list.append(item);
    return py::object(f.function(*py::tuple(list), **keywords));
  };
  const auto checked = [&](const py::object& value, int columns, const char* what) {
    std::vector<py::ssize_t> shape;
    if (!single) shape.push_back(py::ssize_t(count));
    shape.push_back(f.dim);
    if (columns) shape.push_back(columns);
    Numbers array = numbers(value, f.name + ": " + what);
    const py::ssize_t wanted = py::ssize_t(count) * f.dim * std::max(columns, 1);
    // A scalar residual may omit the axis of its rows.
    const bool scalar = f.dim == 1 && array.size() == wanted && array.ndim() + 1 == py::ssize_t(shape.size());
    if (!scalar && !std::equal(shape.begin(), shape.end(), array.shape(), array.shape() + array.ndim())) {
      std::string text;
      for (const py::ssize_t n : shape) text += (text.empty() ? "" : ", ") + std::to_string(n);
      raise("ResidualError", f.name + ": the residual returned " + what + " of shape " + shape_text(array) +
                                 "; expected (" + text + (shape.size() == 1 ? ",)" : ")"));
    }
    return array;
  };
  const auto store_rows = [&](const Numbers& rows) {
    for (std::size_t i = 0; i < count; ++i) {
      residuals[i]->allocate();
      std::copy_n(rows.data() + i * dim, dim, residuals[i]->rows_.data());
    }
  };
  if (jacobians && f.jacobians == Jacobians::given) {
    const py::object result = call(py::dict(py::arg("jacobians") = true));
    if (!py::isinstance<py::tuple>(result) || py::len(result) != 2)
      raise("ResidualError",
            f.name + ": with jacobians=True the residual must return (rows, [Jacobian of each state])");
    const auto pair = py::reinterpret_borrow<py::tuple>(result);
    store_rows(checked(pair[0], 0, "rows"));
    const py::sequence list = pair[1];
    if (list.size() != arity)
      raise("ResidualError", f.name + ": the residual returned " + std::to_string(list.size()) + " Jacobians for " +
                                 std::to_string(arity) + " states");
    std::size_t first = 0;
    for (std::size_t s = 0; s < arity; ++s) {
      const auto dofs = std::size_t(groups[s]->dof);
      const Numbers J = checked(list[s], groups[s]->dof, "a Jacobian");
      const double* from = J.data();
      for (std::size_t i = 0; i < count; ++i, from += dim * dofs) {
        double* to = residuals[i]->J_.data() + first;
        for (std::size_t row = 0; row < dim; ++row)
          for (std::size_t k = 0; k < dofs; ++k) to[k * dim + row] = from[row * dofs + k];
      }
      first += dim * dofs;
    }
  } else {
    const py::dict none = f.jacobians == Jacobians::given ? py::dict(py::arg("jacobians") = false) : py::dict();
    const Numbers rows = checked(call(none), 0, "rows");
    store_rows(rows);
    bool compared = true;
    std::size_t first = 0;
    for (std::size_t s = 0; s < arity && jacobians; ++s)
      for (int k = 0; k < groups[s]->dof; ++k, first += dim) {
        const py::object x_s = arguments[s];
        const auto column = [&](const Numbers& values, double factor, bool add) {
          for (std::size_t i = 0; i < count; ++i) {
            double* to = residuals[i]->J_.data() + first;
            for (std::size_t row = 0; row < dim; ++row)
              to[row] = (add ? to[row] : 0.0) + factor * values.data()[i * dim + row];
          }
        };
        if (f.jacobians == Jacobians::complex_step) {
          arguments[s] = perturbed(x_s, *groups[s], k, py::cast(std::complex<double>(0, kComplexStep)));
          const py::object value = py::module_::import("numpy").attr("asarray")(call(none)).attr("imag");
          const Numbers step = checked(value, 0, "rows");
          column(step, 1 / kComplexStep, false);
          if (f.complex_checks > 0) {
            const auto moved = [&](double by) {
              arguments[s] = perturbed(x_s, *groups[s], k, py::float_(by));
              return checked(call(none), 0, "rows");
            };
            compared &= compare_complex_step(f.name, s, k, step, rows, moved(kDifferenceStep), moved(-kDifferenceStep));
          }
        } else {
          for (const double sign : {1.0, -1.0}) {
            arguments[s] = perturbed(x_s, *groups[s], k, py::float_(sign * kDifferenceStep));
            column(checked(call(none), 0, "rows"), sign / (2 * kDifferenceStep), sign < 0);
          }
        }
        arguments[s] = x_s;
      }
    if (jacobians && f.jacobians == Jacobians::complex_step && f.complex_checks > 0)
      f.complex_checks = compared ? 0 : f.complex_checks - 1;
  }
  for (std::size_t i = 0; i < count; ++i) {
    std::byte* to = residuals[i]->x_.data();
    for (std::size_t s = 0; s < arity; to += groups[s]->size, ++s) std::memcpy(to, x[i * arity + s], groups[s]->size);
    residuals[i]->has_rows_ = true;
    residuals[i]->has_jacobians_ = jacobians;
  }
}

void PythonResidual::check_finite(const double* values, int count) const {
  if (!std::all_of(values, values + count, [](double v) { return std::isfinite(v); }))
    throw UndefinedResidualError("the residual returned NaN or infinity");
}

void PythonResidual::evaluate(const void* const* x, double* r) const {
  if (callable_->pointer) return evaluate_compiled(x, r, nullptr, nullptr);
  if (!is_known(x, false)) {
    const py::gil_scoped_acquire lock;
    const PythonResidual* self = this;
    call(&self, x, 1, false);
  }
  check_finite(rows_.data(), callable_->dim);
  std::copy(rows_.begin(), rows_.end(), r);
}

void PythonResidual::linearize(const void* const* x, const int* offset, double* r, double* const* J) const {
  if (callable_->pointer) return evaluate_compiled(x, r, J, offset);
  if (!is_known(x, true)) {
    const py::gil_scoped_acquire lock;
    const PythonResidual* self = this;
    call(&self, x, 1, true);
  }
  check_finite(rows_.data(), callable_->dim);
  check_finite(J_.data(), int(J_.size()));
  std::copy(rows_.begin(), rows_.end(), r);
  const double* from = J_.data();
  for (std::size_t s = 0; s < groups_->size(); ++s) {
    const std::size_t entries = rows_.size() * std::size_t((*groups_)[s]->dof);
    if (offset[s] >= 0) std::copy_n(from, entries, J[s]);
    from += entries;
  }
}

void PythonResidual::evaluate_compiled(const void* const* x, double* r, double* const* J, const int* offset) const {
  std::array<double, kMaxParameters> numbers;
  std::array<double, std::size_t(detail::kMaxRows)> rows;
  double* to = numbers.data();
  std::size_t columns = 0;
  for (std::size_t s = 0; s < groups_->size(); ++s) {
    (*groups_)[s]->pack(x[s], to);
    to += (*groups_)[s]->parameters;
    columns += std::size_t((*groups_)[s]->dof);
  }
  const std::size_t dim = std::size_t(callable_->dim);
  std::array<double, 512> on_stack;
  std::vector<double> on_heap;
  if (dim * columns > on_stack.size()) on_heap.resize(dim * columns);
  double* const all = on_heap.empty() ? on_stack.data() : on_heap.data();
  if (J) std::fill_n(all, dim * columns, 0.0);
  const double* data = callable_->numbers.data() + row_ * callable_->numbers_each;
  if (callable_->pointer(data, numbers.data(), rows.data(), all, J ? 1 : 0) != 0)
    throw UndefinedResidualError("the compiled residual is undefined here");
  check_finite(rows.data(), int(dim));
  std::copy_n(rows.data(), dim, r);
  std::size_t first = 0;
  for (std::size_t s = 0; J && s < groups_->size(); ++s) {
    const auto dofs = std::size_t((*groups_)[s]->dof);
    for (std::size_t k = 0; k < dofs && offset[s] >= 0; ++k)
      for (std::size_t row = 0; row < dim; ++row) J[s][k * dim + row] = all[row * columns + first + k];
    first += dofs;
  }
}

void bind_python_residual(py::module_& m) {
  py::class_<Callable, std::shared_ptr<Callable>> c(
      m, "PythonResidual", "A residual of your own; made by tandem.residual and tandem.compiled_residual.");
  c.def(py::init(&make_callable), py::kw_only(), py::arg("function"), py::arg("pointer"), py::arg("name"),
        py::arg("dim"), py::arg("jacobian"), py::arg("batched"), py::arg("data"), py::arg("count"), py::arg("numbers"),
        py::arg("owner"));
  c.def_readonly("name", &Callable::name);
  c.def_readonly("dim", &Callable::dim);
  c.def_readonly("function", &Callable::function);
  c.def(py::pickle(
      [](const Callable& f) {
        const char* const jacobian = f.jacobians == Jacobians::given          ? "given"
                                     : f.jacobians == Jacobians::complex_step ? "complex"
                                                                              : "difference";
        const py::object reference = py::module_::import("tandem.own").attr("_reference")(f.name, f.function);
        return py::make_tuple(reference, f.name, f.dim, jacobian, f.batched, f.data, f.count);
      },
      [](const py::tuple& state) {
        const py::object function = py::module_::import("tandem.own").attr("_function")(state[0]);
        return make_callable(function, 0, state[1].cast<std::string>(), state[2].cast<int>(),
                             state[3].cast<std::string>(), state[4].cast<bool>(), state[5],
                             state[6].cast<std::size_t>(), Numbers(py::ssize_t(0)), function);
      }));
  c.def("__repr__", [](const Callable& f) {
    return "<residual " + f.name + ": " + std::to_string(f.dim) + " rows" +
           (f.pointer   ? ", compiled"
            : f.batched ? ", batched"
                        : "") +
           ">";
  });
}

}  // namespace tandem::python

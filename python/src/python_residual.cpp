#include "python_residual.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include <tandem/problem/stop.hpp>

#include "interrupt.hpp"
#include "python_call.hpp"
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

}  // namespace

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
  if (!has_rows_ || (jacobians && !has_jacobians_) || computation_ != callable_->computation) return false;
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
  for (std::size_t i = 0; i < count; ++i) {
    residuals[i]->has_rows_ = residuals[i]->has_jacobians_ = false;
    residuals[i]->computation_ = residuals[i]->callable_->computation;
  }
  const std::string& name = residuals[0]->callable_->name;
  try {
    try {
      PythonCall(residuals, x, count).evaluate(jacobians);
    } catch (const py::builtin_exception& error) {
      error.set_error();
      throw py::error_already_set();
    }
  } catch (const py::error_already_set& error) {
    if (error.matches(PyExc_KeyboardInterrupt)) {
      // The solver needs this evaluation to end at its best point.
      if (SolveStop::request()) return call(residuals, x, count, jacobians);
      throw Interrupted(name + ": interrupted");
    }
    if (error.matches(exception_class("UndefinedResidualError")))
      throw UndefinedResidualError(std::string(py::str(error.value())));
    throw PythonError(name + ": the residual", error);
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

}  // namespace tandem::python

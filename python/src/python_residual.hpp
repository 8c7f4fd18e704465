#pragma once

#include <memory>
#include <string>
#include <vector>

#include "callable.hpp"
#include "variables.hpp"

namespace tandem::python {

/// A residual type made at run time, with the groups of its states.
struct PythonResidualType {
  const detail::ResidualType& type;
  const std::vector<const Group*>& groups;
};
/// Returns the residual type of a callable that reads these groups. Types are made once and live as long as the process.
PythonResidualType python_residual_type(const Callable& callable, const std::vector<const Group*>& groups, bool hard);

/// The residual object of a block: a callable and the row of its data. Results of the last evaluation are kept, so that
/// solvers evaluate all blocks in one Python call and then read them from any thread.
class PythonResidual {
 public:
  PythonResidual(std::shared_ptr<const Callable> callable, std::size_t row, const std::vector<const Group*>* groups)
      : callable_(std::move(callable)), row_(row), groups_(groups) {}
  PythonResidual(const PythonResidual& other) : PythonResidual(other.callable_, other.row_, other.groups_) {}
  PythonResidual(PythonResidual&&) = default;
  PythonResidual& operator=(const PythonResidual&) = delete;

  static void prepare(const detail::PoolBase& pool, bool jacobians);
  void evaluate(const void* const* x, double* r) const;
  void linearize(const void* const* x, const int* offset, double* r, double* const* J) const;

 private:
  void evaluate_compiled(const void* const* x, double* r, double* const* J, const int* offset) const;
  friend class PythonCall;
  /// Evaluates residuals of one callable in one call, and converts exceptions. The caller holds the lock.
  static void call(const PythonResidual* const* residuals, const void* const* x, std::size_t count, bool jacobians);
  bool is_known(const void* const* x, bool jacobians) const;
  void allocate() const;
  void check_finite(const double* numbers, int count) const;

  std::shared_ptr<const Callable> callable_;
  std::size_t row_;
  const std::vector<const Group*>* groups_;
  mutable bool has_rows_ = false, has_jacobians_ = false;
  mutable unsigned computation_ = 0;      // Callable::computation of the last evaluation
  mutable std::vector<std::byte> x_;      // states of the last evaluation
  mutable std::vector<double> rows_, J_;  // J_: column-major, one state after the other
};

}  // namespace tandem::python

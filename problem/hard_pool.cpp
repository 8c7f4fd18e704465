#include <algorithm>

#include <tandem/problem/hard_pool.hpp>

namespace tandem::detail {

void HardPoolBase::add_bounds(const double* lower, const double* upper) {
  lower_.insert(lower_.end(), lower, lower + dim());
  upper_.insert(upper_.end(), upper, upper + dim());
  multipliers_.resize(multipliers_.size() + std::size_t(dim()), 0.0);
}

void HardPoolBase::add_copy(const PoolBase& from, int i, const int* slots) {
  add_residual(from.residual(i), slots);
  const auto& other = static_cast<const HardPoolBase&>(from);
  const auto first = std::ptrdiff_t(i) * dim();
  add_bounds(other.lower_.data() + first, other.upper_.data() + first);
  set_multipliers(size() - 1, other.multipliers_.data() + first);
}

void HardPoolBase::remove(int i) {
  remove_residual(i);
  for (auto* rows : {&lower_, &upper_, &multipliers_}) {
    std::copy_n(rows->end() - dim(), dim(), rows->begin() + std::ptrdiff_t(i) * dim());
    rows->resize(rows->size() - std::size_t(dim()));
  }
}

void HardPoolBase::set_bounds(int i, const double* lower, const double* upper) {
  std::copy_n(lower, dim(), lower_.begin() + std::ptrdiff_t(i) * dim());
  std::copy_n(upper, dim(), upper_.begin() + std::ptrdiff_t(i) * dim());
}

void HardPoolBase::set_multipliers(int i, const double* multipliers) {
  std::copy_n(multipliers, dim(), multipliers_.begin() + std::ptrdiff_t(i) * dim());
}

void HardPoolBase::add_stiffness(const PoolPlacement& place, const double* v, const double* row_weights, double& along,
                                 double& scale) const {
  const int rows = dim(), columns = BlockShape{rows, arity(), dofs(), nullptr}.first(arity());
  r_.resize(rows);
  J_.resize(rows * columns);
  root_.resize(rows);
  for (int i = 0; i < size(); ++i, row_weights += rows) {
    root_ = Eigen::Map<const Eigen::VectorXd>(row_weights, rows).cwiseSqrt();
    if (root_.isZero(0)) continue;
    const BlockShape shape{rows, arity(), dofs(), place.offset.data() + std::ptrdiff_t(i) * arity()};
    linearize_block(i, shape.offset, r_.data(), J_.data());
    whiten(rows, columns, root_.data(), nullptr, J_.data());
    add_block_stiffness(shape, J_.data(), v, 1.0, along, scale);
  }
}

}  // namespace tandem::detail

#include <algorithm>
#include <array>

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
  for (auto* rows : {&lower_, &upper_, &multipliers_}) {
    std::copy_n(rows->end() - dim(), dim(), rows->begin() + std::ptrdiff_t(i) * dim());
    rows->resize(rows->size() - std::size_t(dim()));
  }
  remove_residual(i);
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

std::unique_ptr<HardPoolBase> HardPool::new_empty(const StoreMapping& mapping) const {
  return std::make_unique<HardPool>(blocks_.functions(), blocks_.stores_of(mapping));
}

void HardPool::values(const PoolPlacement& place, int begin, int end, double* c) const {
  const int rows = dim();
  blocks_.read([&](ResidualBlocks::Reader& at) {
    for (int k = begin; k < end; ++k) {
      const int i = place.at(k);
      at.evaluate(std::size_t(i));
      std::copy_n(at.r, rows, c + std::ptrdiff_t(i) * rows);
    }
  });
}

void HardPool::jacobian(const PoolPlacement& place, int begin, int end, double* c, double* values) const {
  const int rows = dim(), states = arity();
  blocks_.read([&](ResidualBlocks::Reader& at) {
    for (int k = begin; k < end; ++k) {
      const int i = place.at(k);
      const int* offset = &place.offset[std::size_t(i) * std::size_t(states)];
      at.linearize(std::size_t(i), offset);
      if (c) std::copy_n(at.r, rows, c + std::ptrdiff_t(i) * rows);
      double* out = values + place.jacobian[std::size_t(i)];
      for (int s = 0; s < states; ++s)
        if (offset[s] >= 0) out = std::copy_n(at.jacobian[std::size_t(s)], rows * dofs()[s], out);
    }
  });
}

void HardPool::accumulate(const PoolPlacement& place, int begin, int end, const double* weights, const double* jacobian,
                          double* H) const {
  const int rows = dim(), states = arity(), pairs = states * (states + 1) / 2;
  blocks_.read([&](ResidualBlocks::Reader& at) {
    std::array<const double*, kMaxStates> columns{};  // as stored by jacobian()
    for (int k = begin; k < end; ++k) {
      const std::size_t i = std::size_t(place.at(k));
      const double* w = weights + std::ptrdiff_t(i) * rows;
      if (std::all_of(w, w + rows, [](double x) { return x == 0; })) continue;
      const BlockShape shape = blocks_.shape(&place.offset[i * std::size_t(states)]);
      const double* from = jacobian + place.jacobian[i];
      double* T = at.transposed;
      for (int s = 0; s < states; T += rows * shape.dofs[s], ++s) {
        if (shape.offset[s] < 0) continue;
        const int dof = shape.dofs[s];
        columns[std::size_t(s)] = from;
        for (int row = 0; row < rows; ++row)
          for (int j = 0; j < dof; ++j) T[row * dof + j] = w[row] * from[j * rows + row];
        from += rows * dof;
      }
      blocks_.kernels().add_products(shape, &place.hessian[i * std::size_t(pairs)], at.transposed, columns.data(), H);
    }
  });
}

void HardPool::add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature, double factor,
                                 const double* multipliers, double* gradient, double* H) const {
  if (blocks_.functions().linear) return;
  const int rows = dim(), states = arity(), pairs = states * (states + 1) / 2;
  blocks_.read([&](ResidualBlocks::Reader& at) {
    for (int k = begin; k < end; ++k) {
      const std::size_t i = std::size_t(place.at(k));
      const double* lambda = multipliers + std::ptrdiff_t(i) * rows;
      if (std::all_of(lambda, lambda + rows, [](double l) { return l == 0; })) continue;
      const auto dual = [&](const double*, double* w) {
        for (int row = 0; row < rows; ++row) w[row] = factor * lambda[row];
      };
      at.add_second_derivatives(i, &place.offset[i * std::size_t(states)], &place.hessian[i * std::size_t(pairs)], dual,
                                gradient, H);
    }
  });
}

}  // namespace tandem::detail

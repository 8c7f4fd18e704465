#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <tandem/problem/weighted_pool.hpp>

namespace tandem::detail {

void WeightedPool::add_weight(const Gaussian& noise, const Loss& loss) {
  diagonal_.resize(diagonal_.size() + std::size_t(dim()));
  full_.push_back(-1);
  losses_.push_back(loss);
  set_noise(size() - 1, noise);
}

void WeightedPool::add_copy(const PoolBase& from, int i, const int* slots) {
  add_residual(from.residual(i), slots);
  add_raw_weight(static_cast<const WeightedPool&>(from).raw_weight(i));
}

void WeightedPool::add_raw_weight(const Weight& weight) {
  const int rows = dim();
  diagonal_.insert(diagonal_.end(), weight.diagonal, weight.diagonal + rows);
  full_.push_back(-1);
  if (weight.full) {
    full_.back() = matrices_.add();
    matrices_.at(full_.back()).assign(weight.full, weight.full + rows * rows);
  }
  losses_.push_back(weight.loss);
}

void WeightedPool::remove(int i) {
  if (const int full = full_[std::size_t(i)]; full >= 0) matrices_.remove(full);
  remove_residual(i);
  std::copy_n(diagonal_.end() - dim(), dim(), diagonal_.begin() + std::ptrdiff_t(i) * dim());
  diagonal_.resize(diagonal_.size() - std::size_t(dim()));
  remove_from(full_, i);
  remove_from(losses_, i);
}

Gaussian WeightedPool::noise(int i) const {
  const int rows = dim();
  if (const double* W = full(std::size_t(i)))
    return Gaussian::square_root(Eigen::Map<const Eigen::MatrixXd>(W, rows, rows));
  const Eigen::Map<const Eigen::VectorXd> weights(diagonal_.data() + std::ptrdiff_t(i) * rows, rows);
  return Gaussian(Eigen::VectorXd(weights.cwiseInverse()));
}

void WeightedPool::set_noise(int i, const Gaussian& noise) {
  int& full = full_[std::size_t(i)];
  if (noise.is_diagonal()) {
    if (full >= 0) matrices_.remove(std::exchange(full, -1));
    std::copy_n(noise.diagonal().data(), dim(), diagonal_.begin() + std::ptrdiff_t(i) * dim());
    return;
  }
  const Eigen::MatrixXd W = noise.sqrt_information();
  if (full < 0) full = matrices_.add();
  matrices_.at(full).assign(W.data(), W.data() + W.size());
}

bool WeightedPool::is_plain() const {
  return std::all_of(full_.begin(), full_.end(), [](int full) { return full < 0; }) &&
         std::all_of(losses_.begin(), losses_.end(), [](const Loss& loss) { return loss.kind == Loss::Kind::none; });
}

double WeightedPool::squared_norm_at_point(int i) const {
  double r[kMaxRows];
  evaluate_block(i, r);
  whiten(dim(), 1, diagonal_.data() + std::ptrdiff_t(i) * dim(), full(std::size_t(i)), r);
  return std::inner_product(r, r + dim(), r, 0.0);
}

Loss::Value WeightedPool::loss_at_point(int i) const { return loss_of(std::size_t(i), squared_norm_at_point(i)); }

std::optional<double> WeightedPool::convex_loss_scale() const {
  std::optional<double> largest;
  for (int i = 0; i < size(); ++i) {
    const Loss& own = losses_[std::size_t(i)];
    if (own.kind == Loss::Kind::none) continue;
    const double norm = std::sqrt(squared_norm_at_point(i));
    largest = std::max(largest.value_or(0.0), norm / (own.scale * std::sqrt(own.convexity_limit())));
  }
  return largest;
}

void WeightedPool::add_stiffness(const PoolPlacement& place, const double* v, const double*, double& along,
                                 double& scale) const {
  const int rows = dim(), columns = BlockShape{rows, arity(), dofs(), nullptr}.first(arity());
  r_.resize(rows);
  J_.resize(rows * columns);
  for (int i = 0; i < size(); ++i) {
    const BlockShape shape{rows, arity(), dofs(), place.offset.data() + std::ptrdiff_t(i) * arity()};
    linearize_block(i, shape.offset, r_.data(), J_.data());
    const double *diagonal = diagonal_.data() + std::ptrdiff_t(i) * rows, *W = full(std::size_t(i));
    whiten(rows, 1, diagonal, W, r_.data());
    whiten(rows, columns, diagonal, W, J_.data());
    add_block_stiffness(shape, J_.data(), v, loss_of(std::size_t(i), r_.squaredNorm()).d1, along, scale);
  }
}

}  // namespace tandem::detail

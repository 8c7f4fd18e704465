#include <algorithm>

#include <tandem/problem/hard_pool.hpp>
#include <tandem/problem/soft_pool.hpp>

namespace tandem::detail {

std::unique_ptr<SoftPoolBase> SoftPool::new_empty(const StoreMapping& mapping) const {
  auto pool = std::make_unique<SoftPool>(blocks_.functions(), blocks_.stores_of(mapping));
  pool->loss_scale = loss_scale;
  return pool;
}

std::unique_ptr<HardPoolBase> SoftPool::bounded_rows() const {
  const ResidualFunctions& functions = blocks_.functions();
  if (!functions.bounded || !is_plain()) return {};
  auto rows = std::make_unique<HardPool>(*functions.bounded, blocks_.stores());
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const BoundedResidual bounded = functions.bounds(blocks_.residual(i));
    rows->add(bounded.residual, blocks_.slots(i), bounded.lower, bounded.upper);
  }
  return rows;
}

double SoftPool::cost(const PoolPlacement& place, int begin, int end) const {
  const auto block_cost = blocks_.kernels().soft_block_cost;
  double total = 0;
  blocks_.read([&](Reader& at) {
    int k = begin;
    if (at.batches())
      for (; end - k > 1; k += kBatch) {
        const Reader::Blocks blocks = at.batch(place, k, end);
        at.evaluate_batch();
        for (int b = 0; b < std::min(kBatch, end - k); ++b)
          total += block_cost(dim(), weight_of(blocks[std::size_t(b)]), at.r + b * dim());
      }
    for (; k < end; ++k) {
      const std::size_t i = std::size_t(place.at(k));
      at.evaluate(i);
      total += block_cost(dim(), weight_of(i), at.r);
    }
  });
  return total;
}

double SoftPool::accumulate(const PoolPlacement& place, int begin, int end, double* gradient, double* H) const {
  double total = 0;
  blocks_.read([&](Reader& at) {
    int k = begin;
    if (at.batches())
      for (; end - k > 1; k += kBatch) accumulate_batch(at, place, k, end, total, gradient, H);
    for (; k < end; ++k) {
      const std::size_t i = std::size_t(place.at(k));
      at.linearize(i, shape(place, i).offset);
      total += add(place, i, at.r, at.jacobian.data(), at.transposed, gradient, H);
    }
  });
  return total;
}

void SoftPool::add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature wanted, double factor,
                                 const double*, double* gradient, double* H) const {
  blocks_.read([&](Reader& at) {
    int k = begin;
    if (at.batches())
      for (; end - k > 1; k += kBatch) add_exact_hessian_of_batch(at, place, k, end, wanted, factor, gradient, H);
    for (; k < end; ++k) add_exact_hessian_of_block(at, place, std::size_t(place.at(k)), wanted, factor, gradient, H);
  });
}

double SoftPool::add(const PoolPlacement& place, std::size_t i, double* r, double* const* J, double* transposed,
                     double* gradient, double* H) const {
  return blocks_.kernels().add_soft_block(shape(place, i), hessian(place, i), weight_of(i), {r, J, transposed},
                                          gradient, H);
}

/// Accumulates one batch: blocks k … end − 1 in the order of evaluation, at most kBatch. Adds their costs to `total`
/// one by one, like cost(), for a bitwise equal sum.
void SoftPool::accumulate_batch(Reader& at, const PoolPlacement& place, int k, int end, double& total, double* gradient,
                                double* H) const {
  const Reader::Blocks blocks = at.batch(place, k, end);
  at.linearize_batch();
  for (int b = 0; b < std::min(kBatch, end - k); ++b) {
    const std::size_t i = blocks[std::size_t(b)];
    double* const* J = at.jacobians_of_batch(b).data();
    at.apply_charts(i, shape(place, i).offset, J);
    total += add(place, i, at.r + b * dim(), J, at.transposed, gradient, H);
  }
}

/// Adds the exact Hessian of one batch.
void SoftPool::add_exact_hessian_of_batch(Reader& at, const PoolPlacement& place, int k, int end, Curvature wanted,
                                          double factor, double* gradient, double* H) const {
  const Reader::Blocks blocks = at.batch(place, k, end);
  const int rows = dim(), columns = blocks_.shape(nullptr).first(arity());
  at.linearize_batch();
  for (int b = 0; b < kBatch; ++b)
    soft_block_dual(rows, weight_of(blocks[std::size_t(b)]), factor, at.r + b * rows, at.w + b * rows);
  at.curvature_batch();
  const double gauss_newton_factor = wanted == Curvature::all ? factor : 0.0;
  for (int b = 0; b < std::min(kBatch, end - k); ++b) {
    const std::size_t i = blocks[std::size_t(b)];
    const BlockWeight weight = weight_of(i);
    const BlockShape shape = this->shape(place, i);
    double* const* J = at.jacobians_of_batch(b).data();
    add_block_curvature(shape, hessian(place, i), J, at.charts(i), at.w + b * rows, at.C + b * columns * columns,
                        gradient, H);
    if (gauss_newton_factor == 0 && weight.loss.kind == Loss::Kind::none) continue;
    at.apply_charts(i, shape.offset, J);
    add_first_order(place, i, weight, gauss_newton_factor, factor, {at.r + b * rows, J, at.transposed}, H);
  }
}

void SoftPool::add_exact_hessian_of_block(Reader& at, const PoolPlacement& place, std::size_t i, Curvature wanted,
                                          double factor, double* gradient, double* H) const {
  const ResidualFunctions& functions = blocks_.functions();
  const int* offset = shape(place, i).offset;
  const BlockWeight weight = weight_of(i);
  double gauss_newton_factor = wanted == Curvature::all ? factor : 0.0, loss_factor = factor;
  const bool first_order = gauss_newton_factor != 0 || weight.loss.kind != Loss::Kind::none;
  if (functions.linear) {
    if (!first_order) return;
    at.linearize(i, offset);
  } else {
    const auto dual = [&](const double* r, double* w) { soft_block_dual(functions.dim, weight, factor, r, w); };
    at.add_second_derivatives(i, offset, hessian(place, i), dual, gradient, H);
    if (functions.curvature) {
      if (!first_order) return;
      at.apply_charts(i, offset, at.jacobian.data());
    } else {  // differences include all terms
      if (wanted == Curvature::all) return;
      at.linearize(i, offset);
      gauss_newton_factor = -factor;
      loss_factor = 0.0;
    }
  }
  add_first_order(place, i, weight, gauss_newton_factor, loss_factor, {at.r, at.jacobian.data(), at.transposed}, H);
}

void SoftPool::add_first_order(const PoolPlacement& place, std::size_t i, const BlockWeight& weight,
                               double gauss_newton_factor, double loss_factor, const LinearizedBlock& block,
                               double* H) const {
  blocks_.kernels().add_first_order(shape(place, i), hessian(place, i), weight, block, gauss_newton_factor, loss_factor,
                                    H);
}

}  // namespace tandem::detail

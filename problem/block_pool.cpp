#include <algorithm>
#include <memory>

#include <tandem/problem/block_pool.hpp>
#include <tandem/problem/hard_pool.hpp>
#include <tandem/problem/weighted_pool.hpp>

namespace tandem::detail {
namespace {

constexpr std::size_t aligned(std::size_t doubles) {
  constexpr std::size_t unit = kScratchAlignment / sizeof(double);
  return (doubles + unit - 1) / unit * unit;
}

template <std::size_t size>
[[gnu::noinline]] void call_with_stack(FunctionRef<void(double*)> f) {
  alignas(kScratchAlignment) double scratch[size];
  f(scratch);
}

/// Calls f with memory for `size` doubles, on the stack unless it is large.
void call_with_scratch(std::size_t size, FunctionRef<void(double*)> f) {
  if (size <= 256) return call_with_stack<256>(f);
  if (size <= 1024) return call_with_stack<1024>(f);
  if (size <= 4096) return call_with_stack<4096>(f);
  if (size <= 16384) return call_with_stack<16384>(f);
  const std::unique_ptr<double[]> memory(new double[size + kScratchAlignment / sizeof(double)]);
  void* begin = memory.get();
  std::size_t space = (size + kScratchAlignment / sizeof(double)) * sizeof(double);
  f(static_cast<double*>(std::align(kScratchAlignment, size * sizeof(double), begin, space)));
}

}  // namespace

ResidualBlocks::ResidualBlocks(const ResidualFunctions& functions, std::span<StateStoreBase* const> stores)
    : functions_(functions),
      kernels_(block_kernels(functions.dim)),
      arity_(std::size_t(functions.arity)),
      stores_(stores.begin(), stores.end()),
      residuals_(functions) {
  const std::size_t blocks = functions.batch.linearize ? std::size_t(kBatch) : 1, rows = std::size_t(functions.dim);
  std::size_t jacobians = 0;
  for (std::size_t s = 0; s < arity_; ++s) {
    first_of_jacobian_[s] = jacobians;
    jacobians += aligned(rows * std::size_t(functions.dofs[s]));
    columns_ += std::size_t(functions.dofs[s]);
  }
  first_w_ = aligned(blocks * rows);
  first_transposed_ = 2 * first_w_;
  first_J_ = first_transposed_ + aligned(rows * columns_);
  first_C_ = first_J_ + std::max(jacobians, aligned(blocks * rows * columns_));
  scratch_size_ = first_C_ + (functions.curvature ? aligned(blocks * columns_ * columns_) : 0);
}

std::vector<StateStoreBase*> ResidualBlocks::stores_of(const StoreMapping& mapping) const {
  std::vector<StateStoreBase*> result;
  for (const StateStoreBase* store : stores_) result.push_back(mapping(store));
  return result;
}

void ResidualBlocks::points(std::size_t i, const void** x) const {
  for (std::size_t s = 0; s < arity_; ++s) x[s] = stores_[s]->view().point(slots(i)[s]);
}

void ResidualBlocks::add(const void* residual, const int* slots) {
  residuals_.add(residual);
  slots_.insert(slots_.end(), slots, slots + arity_);
  for (std::size_t s = 0; s < arity_; ++s) ids_.push_back(stores_[s]->id[std::size_t(slots[s])]);
}

void ResidualBlocks::remove(std::size_t i) {
  residuals_.remove(i);
  for (std::vector<int>* entries : {&slots_, &ids_}) {
    std::copy_n(entries->end() - std::ptrdiff_t(arity_), arity_, entries->begin() + std::ptrdiff_t(i * arity_));
    entries->resize(entries->size() - arity_);
  }
}

void ResidualBlocks::read(FunctionRef<void(Reader&)> f) const {
  call_with_scratch(scratch_size_, [&](double* scratch) {
    Reader reader(*this, scratch);
    f(reader);
  });
}

ResidualBlocks::Reader::Reader(const ResidualBlocks& blocks, double* scratch) : blocks_(blocks) {
  r = scratch;
  w = scratch + blocks.first_w_;
  transposed = scratch + blocks.first_transposed_;
  J = scratch + blocks.first_J_;
  C = scratch + blocks.first_C_;
  for (std::size_t s = 0; s < blocks.arity_; ++s) {
    jacobian[s] = J + blocks.first_of_jacobian_[s];
    views_[s] = blocks.stores_[s]->view();
    charted_ = charted_ || views_[s].charts;
  }
}

void ResidualBlocks::Reader::add_second_derivatives(std::size_t i, const int* offset, const HessianPlace* place,
                                                    Dual dual, double* gradient, double* H) {
  if (!blocks_.functions_.curvature) return difference_gradient(i, offset, place, dual, H);
  linearize_at_point(i, offset);
  dual(r, w);
  named_errors(i, [&] { blocks_.functions_.curvature(blocks_.residual(i), x_.data(), w, C); });
  add_block_curvature(blocks_.shape(offset), place, jacobian.data(), charts(i), w, C, gradient, H);
}

void ResidualBlocks::Reader::difference_gradient(std::size_t i, const int* offset, const HessianPlace* place, Dual dual,
                                                 double* H) {
  const ResidualFunctions& functions = blocks_.functions_;
  const BlockShape shape = blocks_.shape(offset);
  const auto near = [&](int state, int k, double step, double* gradient) {
    points(i);
    charts(i);
    const std::size_t s = std::size_t(state);
    blocks_.stores_[s]->with_perturbed(blocks_.slots(i)[s], k, step, [&](const void* moved, const double* chart) {
      x_[s] = moved;
      charts_[s] = chart;
      named_errors(i, [&] { functions.linearize(blocks_.residual(i), x_.data(), offset, r, jacobian.data()); });
      dual(r, w);
      block_gradient(shape, jacobian.data(), charts_.data(), w, gradient);
    });
  };
  add_difference_hessian(shape, place, near, H);
}

ResidualBlocks::Reader::Blocks ResidualBlocks::Reader::batch(const PoolPlacement& place, int k, int end) {
  Blocks blocks;
  for (int b = 0; b < kBatch; ++b) {
    const std::size_t i = std::size_t(place.at(std::min(k + b, end - 1)));
    blocks[std::size_t(b)] = i;
    residuals_[std::size_t(b)] = blocks_.residual(i);
    const int* slots = blocks_.slots(i);
    for (std::size_t s = 0; s < blocks_.arity_; ++s)
      batch_x_[s * std::size_t(kBatch) + std::size_t(b)] = views_[s].point(slots[s]);
  }
  return blocks;
}

void ResidualBlocks::Reader::linearize_batch() {
  double* first = J;
  for (std::size_t s = 0; s < blocks_.arity_; ++s) {
    batch_jacobian_[s] = first;
    first += kBatch * blocks_.functions_.dim * blocks_.functions_.dofs[s];
  }
  blocks_.functions_.batch.linearize(residuals_.data(), batch_x_.data(), r, batch_jacobian_.data());
}

const std::array<double*, kMaxStates>& ResidualBlocks::Reader::jacobians_of_batch(int b) {
  double* first = J;
  for (std::size_t s = 0; s < blocks_.arity_; ++s) {
    const int entries = blocks_.functions_.dim * blocks_.functions_.dofs[s];
    batch_jacobian_[s] = first + b * entries;
    first += kBatch * entries;
  }
  return batch_jacobian_;
}

template <class Base>
void BlockPool<Base>::evaluate_block(int i, double* r) const {
  blocks_.read([&](auto& at) {
    at.evaluate(std::size_t(i));
    std::copy_n(at.r, dim(), r);
  });
}

template <class Base>
void BlockPool<Base>::linearize_block(int i, const int* offset, double* r, double* J) const {
  static constexpr std::array<int, kMaxStates> all{};
  if (!offset) offset = all.data();
  blocks_.read([&](auto& at) {
    at.linearize(std::size_t(i), offset);
    std::copy_n(at.r, dim(), r);
    for (int s = 0; s < arity(); ++s) {
      const int entries = dim() * dofs()[s];
      if (offset[s] < 0)
        std::fill_n(J, entries, 0.0);
      else
        std::copy_n(at.jacobian[std::size_t(s)], entries, J);
      J += entries;
    }
  });
}

template class BlockPool<WeightedPool>;
template class BlockPool<HardPoolBase>;

}  // namespace tandem::detail

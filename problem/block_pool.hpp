#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/problem/function_ref.hpp>
#include <tandem/problem/pool.hpp>
#include <tandem/problem/residual_array.hpp>

namespace tandem::detail {

/// Blocks of one residual type: residuals, states and their evaluation at the point.
class ResidualBlocks {
 public:
  /// Computes the weights w of the rows r of a block; see add_second_derivatives().
  using Dual = FunctionRef<void(const double* r, double* w)>;

  ResidualBlocks(const ResidualFunctions& functions, std::span<StateStoreBase* const> stores);

  const ResidualFunctions& functions() const { return functions_; }
  const BlockKernels& kernels() const { return kernels_; }
  std::span<StateStoreBase* const> stores() const { return stores_; }
  std::vector<StateStoreBase*> stores_of(const StoreMapping& mapping) const;
  std::size_t size() const { return residuals_.size(); }
  const int* ids(std::size_t i) const { return ids_.data() + i * arity_; }
  const int* slots(std::size_t i) const { return slots_.data() + i * arity_; }
  const void* residual(std::size_t i) const { return residuals_[i]; }
  void points(std::size_t i, const void** x) const;
  void add(const void* residual, const int* slots);
  void set(std::size_t i, const void* residual) { residuals_.set(i, residual); }
  void remove(std::size_t i);
  BlockShape shape(const int* offset) const { return {functions_.dim, functions_.arity, functions_.dofs, offset}; }

  /// Results of the evaluation of one block, or of a batch if the residual has a batched evaluation.
  struct Scratch {
    double *r, *w;                               ///< rows and their weights, of one block or of a batch
    double *J, *C;                               ///< Jacobians and second derivatives
    double* transposed;                          ///< all Jacobians of a block
    std::array<double*, kMaxStates> jacobian{};  ///< Jacobian of each state of a block, aligned; in J
  };
  /// Evaluates blocks. Valid until a variable is added or the point changes.
  class Reader;
  /// Calls f(reader).
  void read(FunctionRef<void(Reader&)> f) const;

 private:
  const ResidualFunctions& functions_;
  const BlockKernels& kernels_;
  std::size_t arity_;
  std::vector<StateStoreBase*> stores_;
  ResidualArray residuals_;
  std::vector<int> slots_, ids_;  // arity entries per block: slot in its store, ID of its variable
  // Layout of Scratch [doubles].
  std::size_t columns_ = 0;  // sum of the dofs
  std::size_t scratch_size_ = 0;
  std::array<std::size_t, kMaxStates> first_of_jacobian_{};
  std::size_t first_w_ = 0, first_transposed_ = 0, first_J_ = 0, first_C_ = 0;
};

class ResidualBlocks::Reader : public ResidualBlocks::Scratch {
 public:
  Reader(const ResidualBlocks& blocks, double* scratch);

  /// Computes r.
  void evaluate(std::size_t i) {
    points(i);
    named_errors(i, [&] { blocks_.functions_.evaluate(blocks_.residual(i), x_.data(), r); });
  }
  /// Computes r, and the Jacobians with respect to perturbations of the states whose offset is not negative.
  void linearize_at_point(std::size_t i, const int* offset) {
    points(i);
    named_errors(i, [&] { blocks_.functions_.linearize(blocks_.residual(i), x_.data(), offset, r, jacobian.data()); });
  }
  /// Computes r, and the Jacobians with respect to δ.
  void linearize(std::size_t i, const int* offset) {
    linearize_at_point(i, offset);
    apply_charts(i, offset, jacobian.data());
  }
  void apply_charts(std::size_t i, const int* offset, double* const* J) {
    if (charted_) blocks_.kernels_.apply_charts(blocks_.shape(offset), charts(i), J);
  }
  /// Returns the chart of each state, null if it is the identity.
  const double* const* charts(std::size_t i) {
    const int* slots = blocks_.slots(i);
    for (std::size_t s = 0; s < blocks_.arity_; ++s) charts_[s] = views_[s].chart(slots[s]);
    return charts_.data();
  }

  /// Adds the Hessian of wᵀ r, where dual(r, w) computes w. If the residual implements second derivatives, w is held
  /// constant, and the second derivatives go through the charts to first order. Then r and the Jacobians at the point
  /// are set, and Jᵀ w is added to `gradient`. Otherwise uses central differences of Jᵀ w(r).
  void add_second_derivatives(std::size_t i, const int* offset, const HessianPlace* place, Dual dual, double* gradient,
                              double* H);

  // Batches of blocks.

  /// Returns whether blocks are evaluated in batches, several per vector register.
  bool batches() const { return blocks_.functions_.batch.linearize && instruction_set() != InstructionSet::baseline; }
  using Blocks = std::array<std::size_t, kBatch>;
  /// Returns the blocks at positions k, k + 1, … in the order of evaluation. Positions from `end` on repeat the last
  /// block. The following functions evaluate these blocks.
  Blocks batch(const PoolPlacement& place, int k, int end);
  void evaluate_batch() { blocks_.functions_.batch.evaluate(residuals_.data(), batch_x_.data(), r); }
  /// Computes r, and J with respect to perturbations of the point.
  void linearize_batch();
  /// Computes C from w.
  void curvature_batch() { blocks_.functions_.batch.curvature(residuals_.data(), batch_x_.data(), w, C); }
  /// Returns the Jacobian of each state of block b in the batch.
  const std::array<double*, kMaxStates>& jacobians_of_batch(int b);

 private:
  void points(std::size_t i) {
    const int* slots = blocks_.slots(i);
    for (std::size_t s = 0; s < blocks_.arity_; ++s) x_[s] = views_[s].point(slots[s]);
  }
  /// Calls f, which evaluates block i. An Error of the residual becomes an UndefinedResidualError that names it.
  template <class F>
  void named_errors(std::size_t i, F f) const {
    try {
      f();
    } catch (const Error&) {
      rethrow_undefined(blocks_.functions_.name, blocks_.stores_, blocks_.slots(i));
    }
  }
  void difference_gradient(std::size_t i, const int* offset, const HessianPlace* place, Dual dual, double* H);

  const ResidualBlocks& blocks_;
  std::array<StateView, kMaxStates> views_{};
  bool charted_ = false;  // a state has charts
  std::array<const void*, kMaxStates> x_{};
  std::array<const double*, kMaxStates> charts_{};
  std::array<const void*, kBatch> residuals_{};
  std::array<const void*, std::size_t(kMaxStates* kBatch)> batch_x_{};
  std::array<double*, kMaxStates> batch_jacobian_{};
};

/// Common part of the soft and hard pools.
template <class Base>
class BlockPool : public Base {
 public:
  std::string_view name() const override { return blocks_.functions().name; }
  int dim() const override { return blocks_.functions().dim; }
  int arity() const override { return blocks_.functions().arity; }
  int size() const override { return static_cast<int>(blocks_.size()); }
  const int* variables(int i) const override { return blocks_.ids(std::size_t(i)); }
  const int* dofs() const override { return blocks_.functions().dofs; }
  const void* residual(int i) const override { return blocks_.residual(std::size_t(i)); }
  void add_residual(const void* residual, const int* slots) override { blocks_.add(residual, slots); }
  void set_residual(int i, const void* residual) override { blocks_.set(std::size_t(i), residual); }
  void points(int i, const void** x) const override { blocks_.points(std::size_t(i), x); }
  void evaluate_block(int i, double* r) const override;
  void linearize_block(int i, const int* offset, double* r, double* J) const override;

 protected:
  BlockPool(const ResidualFunctions& functions, std::span<StateStoreBase* const> stores) : blocks_(functions, stores) {}
  void remove_residual(int i) override { blocks_.remove(std::size_t(i)); }

  ResidualBlocks blocks_;
};

}  // namespace tandem::detail

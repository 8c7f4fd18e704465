#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include <tandem/problem/function_ref.hpp>
#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem {

/// Sparse Cholesky factorisation H = L Lᵀ by blocks, one per variable, on the pattern of the Hessian of an
/// NlpEvaluator.
///
/// The symbolic analysis is done once; numeric factorisations after the first one do not allocate. The elimination
/// order is the order of the variables if that costs little more than SuiteSparse's AMD, otherwise AMD. A chain with
/// the variables of each keyframe together is a narrow band. A long chain is eliminated from both ends towards its
/// middle, in two threads if available.
///
/// CHOLMOD is not used: its supernodal kernel is GPL, and its simplicial one works entry by entry. Dense kernels on the
/// blocks of the problem are faster.
class BlockCholesky {
 public:
  static constexpr double kDefaultNaturalFlops = 1.2;
  /// Ratio of a pivot to its diagonal entry below which the pivot may be a rounding error.
  static constexpr double kRelativePivot = 1e-12;
  /// `natural_flops` is the accepted arithmetic of the order of the variables, relative to AMD. That order has better
  /// memory locality, which justifies the default. With a larger value, a chain is eliminated from its beginning to its
  /// end. The last variables are then near the root, which makes inverse_of() fast for them. A pattern from
  /// in_elimination_order() keeps its order.
  explicit BlockCholesky(const SymmetricPattern& pattern, double natural_flops = kDefaultNaturalFlops);
  BlockCholesky(BlockCholesky&&) = default;
  BlockCholesky& operator=(BlockCholesky&&) = default;

  /// Uses the threads of `tasks`, which must outlive the factor. Results do not depend on them.
  void use(const detail::TaskRunner& tasks) { task_runner_ = &tasks; }

  /// Factorises H + diag(shift); `shift` may be empty. Returns false if a pivot is not positive; see failed_unknown().
  bool factorize(const Eigen::VectorXd& values, const Eigen::VectorXd& shift = {});
  /// Factorises H + diag(shift) with the smallest shift that works: first `relative` times the diagonal of H, or 1
  /// where that is not positive, then 10 times as much, and so on. Returns false if the shift is no longer finite.
  bool factorize_shifted(const Eigen::VectorXd& values, Eigen::VectorXd diagonal, double relative);
  /// Factorises H. For a pattern from in_elimination_order(), the factor overwrites the values, which must not change
  /// until the next factorisation.
  bool factorize_in_place(Eigen::VectorXd& values);
  /// x = (L Lᵀ)⁻¹ x. Solves do not allocate, and threads may share a factor.
  void solve(Eigen::VectorXd& x) const;
  /// x = Lᵀ⁻¹ x, up to the permutation of the unknowns. Maps white coordinates to tangent ones.
  void solve_transposed(Eigen::VectorXd& x) const { backward(x); }
  /// x = L⁻¹ x, up to the permutation of the unknowns. Maps gradients in tangent coordinates to white ones.
  void solve_lower(Eigen::VectorXd& x) const { forward(x); }
  /// Returns the rows and columns of (L Lᵀ)⁻¹ of these blocks of the pattern, in this order. Solves once per column,
  /// through the ancestors of the blocks in the elimination tree.
  Eigen::MatrixXd inverse_of(const std::vector<int>& blocks) const;
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  /// Returns the whole columns of (L Lᵀ)⁻¹ of these blocks, in this order, and zeros up to a multiple of eight columns.
  Columns columns_of_inverse(const std::vector<int>& blocks) const;
  /// Return the first unknown of a block of the pattern, and the number of its unknowns.
  int first_unknown(int block) const { return first_unknown_[std::size_t(place_of_block_[std::size_t(block)])]; }
  int dofs(int block) const { return size_[std::size_t(place_of_block_[std::size_t(block)])]; }

  /// Returns the unknown at which the last factorisation failed.
  int failed_unknown() const { return failed_; }
  /// Returns the number of entries of L.
  double nonzeros() const { return nonzeros_; }

  /// Returns a basis of the directions v with H v ≈ 0, at most `most` of them. They belong to pivots below `relative`
  /// times their original diagonal entry; `unknowns` receives the unknowns of all such pivots if it is not null.
  /// Overwrites the factor, and the values if the pattern is in elimination order. In the new factor, the unknowns of
  /// all weak pivots are pinned: their pivots are 1 and their columns otherwise empty.
  std::vector<Eigen::VectorXd> null_space(Eigen::VectorXd& values, double relative, int most,
                                          std::vector<int>* unknowns = nullptr);
  /// Returns the unknowns with pivots below `relative` times their original diagonal entry after null_space(), the
  /// smallest ratio first, at most `most` of them. Pinned unknowns are omitted.
  std::vector<int> small_pivots(double relative, int most) const;

 protected:  // for detail::SelectedInverse
  /// Reserves memory for the factor of the pattern `blocks`, which must include `pattern`.
  BlockCholesky(const SymmetricPattern& pattern, const SymmetricPattern& blocks);

  struct Copy {  // copy of a block of H, or of several ones below each other, into a panel
    int source, source_stride, target, target_stride, rows, columns;
    bool transposed;
  };
  struct Fill {  // part of a panel without a block of H
    int target, stride, rows, columns;
  };
  struct Below {  // consecutive rows of a panel below its top, and their unknowns
    int row, unknown, rows;
  };
  struct Run {  // consecutive rows of an update: source row in the panel, target entry, number of rows
    int source_row, target, rows;
  };
  struct Update {  // update of the block column of a row by a panel
    int first_row, columns, target_stride, run_begin, run_end;
  };

  void compile(const SymmetricPattern& pattern, const SymmetricPattern& blocks, double natural_flops);
  void compile(const SymmetricPattern& factor);
  void compile_copies(const SymmetricPattern& pattern, const SymmetricPattern& factor);
  void compile_rows(const std::vector<int>& row_in_panel);
  void compile_updates(const std::vector<int>& row_in_panel);
  /// Range of block columns in elimination order, and their copies and fill.
  struct Section {
    int begin = 0, end = 0;
    std::vector<Copy> copies;
    std::vector<Fill> fill;
  };
  struct WeakPivots {  // unknowns with pivots below `relative` times their diagonal entry
    double relative;
    std::vector<int> unknowns;
  };

  /// Calls f(0) and f(1) for the two independent halves, in parallel if threads are available.
  void for_both_halves(detail::FunctionRef<void(int part)> f) const;
  void use_own_memory();
  void load(const Eigen::VectorXd& values);
  /// Factorises, and adds weak pivots of the halves and the separator to weak[0], weak[1] and weak[2].
  bool factorize(const Eigen::VectorXd& values, const Eigen::VectorXd& shift, WeakPivots* weak);
  void load(const Section& part, const Eigen::VectorXd& values, const Eigen::VectorXd& shift, bool with_diagonal);
  /// Eliminates block columns that have been loaded, and updates the columns before `reach`. If `weak` is given, weak
  /// pivots are listed and replaced by 1, and their columns are cleared. Returns the unknown at which it failed, or −1.
  int eliminate(int begin, int end, int reach, WeakPivots* weak = nullptr);
  /// Subtracts A Bᵀ from the columns of the block rows below the top of panel k. A and B have the rows of the panel
  /// (those of its top are not read) and `inner` columns.
  void subtract_below(int k, int inner, const double* A, const double* B);
  // Triangular solves in place, in the pattern's order of unknowns.
  void forward(Eigen::VectorXd& y) const;
  void backward(Eigen::VectorXd& y) const;
  std::vector<int> ancestors_of(const std::vector<int>& blocks) const;

  // Applies updates of block column k; called within dispatch_simd().
  [[gnu::always_inline]] void subtract_updates(int begin, int end, int k, int inner, const double* A, const double* B);
  /// Returns the index of the first update of k whose target is at or after `reach`.
  [[gnu::always_inline]] int first_update(int k, int reach) const;
  [[gnu::always_inline]] void forward_by(int k, double* y) const;
  [[gnu::always_inline]] void forward_top(int k, double* y) const;
  [[gnu::always_inline]] void forward_below(int begin, int end, int k, double* y) const;
  [[gnu::always_inline]] void backward_by(int k, double* y) const;
  /// Solves for the columns of a row-major matrix, a multiple of eight. N divides the width of k.
  template <int N>
  [[gnu::always_inline]] void backward_eights_by(int k, double* Y, int columns) const;

  int n_ = 0, blocks_ = 0, failed_ = -1;
  double nonzeros_ = 0;
  std::vector<int> size_;                   // Width of each block column, in elimination order.
  std::vector<int> row_start_, row_block_;  // Block rows of each block column, itself first.
  std::vector<int> panel_rows_;             // Height of each panel.
  std::vector<int> panel_;                  // First entry of each panel (column-major), and the end.
  std::vector<int> first_unknown_;          // First unknown of each block column.
  std::vector<int> place_of_block_;         // Elimination index of each block of the pattern.
  // Two independent halves and their separator. Without a separator, only the last part is used.
  std::array<Section, 3> parts_;
  std::vector<int> separator_columns_;  // block columns of the halves with rows in the separator
  std::vector<int> below_start_;        // per block column
  std::vector<int> below_separator_;    // first row run in the separator, or the end
  std::vector<Below> below_;
  std::vector<int> update_start_;
  std::vector<Update> updates_;
  std::vector<Run> runs_;
  bool in_factor_order_ = true;  // the values of the pattern are stored as those of the factor
  Eigen::VectorXd values_;
  double* entries_ = nullptr;  // values_, or the argument of factorize_in_place()
  Eigen::VectorXd diagonal_;   // diagonal entry before elimination, if weak pivots are listed, or by load()
  const detail::TaskRunner* task_runner_ = nullptr;
};

/// Returns the pattern of the factor of `pattern`, with values stored as the factor stores them. Use it for evaluators
/// whose Hessian is factorised in place. Throws Error if the factor has more than 2³¹ entries.
SymmetricPattern in_elimination_order(const SymmetricPattern& pattern);

}  // namespace tandem

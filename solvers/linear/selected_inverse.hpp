#pragma once

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <tandem/solvers/linear/block_cholesky.hpp>

namespace tandem::detail {

struct ConstrainedFront;

/// Whitened rows of one block of a least-squares problem, linearised: minimise ½‖J δ + r‖².
struct WhitenedRows {
  std::vector<int> blocks;  ///< blocks of the pattern that the columns of J belong to, side by side
  Eigen::MatrixXd J;
  Eigen::VectorXd r;
};

/// Linear equations A x = 0 as triplets. Rows of zeros are ignored.
struct LinearEquations {
  std::vector<int> row, column;  ///< entries in any order; duplicates are summed
  std::vector<double> value;
  int num_rows = 0;
};

/// Blocks of S = H⁻¹ on the pattern of the Cholesky factor of H, and others on demand. With equations A x = 0, S = Z
/// (Zᵀ H Z)⁻¹ Zᵀ, where Z is a basis of the null space of A. The memory is at most twice that of the factor.
///
/// Elimination writes each block as x_k = T_k x_s + z_k, where D_k is the covariance of z_k and s are the block rows
/// below k in the factor. The backward recursion (Takahashi, Fagan & Chen 1973, by blocks; Erisman & Tinney 1975)
///
///   S_sk = S_ss T_kᵀ        S_kk = D_k + T_k S_sk
///
/// needs only blocks of S_ss on the pattern. Without equations, T_k = −L_kk⁻ᵀ L_skᵀ and D_k = (L_kk L_kkᵀ)⁻¹. Blocks
/// with equations are eliminated by ConstrainedFront.
class SelectedInverse : private BlockCholesky {
 public:
  /// Adds `pairs` of blocks to the pattern, as zeros of H.
  explicit SelectedInverse(const SymmetricPattern& pattern, std::span<const std::pair<int, int>> pairs = {});

  /// Computes all blocks of the pattern, for H given by the values of its pattern. Returns false if a pivot is not
  /// positive; see failed_unknown(). Calls `check` often; its exceptions end the computation.
  bool compute(const Eigen::VectorXd& hessian, const LinearEquations& equations = {},
               const std::function<void()>& check = {});
  /// Computes the same for H = Σ Jᵀ J from the rows, by orthogonal transformations. They do not square the condition
  /// number, so the result is accurate to 1e-16 times the root of that of H, where compute() loses all digits if H has
  /// a condition number of 1e16. Takes several times the time of compute(). Returns false if the rows do not determine
  /// all unknowns.
  bool compute_from_rows(std::span<const WhitenedRows> rows, const std::function<void()>& check = {});
  /// Returns the minimiser δ of ½‖J δ + r‖² over the rows of the last compute_from_rows().
  const Eigen::VectorXd& minimizer() const { return minimizer_; }
  /// Returns the decrease of ½‖J δ + r‖² from δ = 0 to its minimum.
  double decrease() const { return decrease_; }
  using BlockCholesky::failed_unknown;
  /// Returns the smallest ratio of a pivot to its diagonal entry. Below kRelativePivot the pivot may be rounding.
  double smallest_pivot() const { return smallest_pivot_; }
  /// Returns log det H. With equations, H is restricted to their null space, and a term that depends only on the
  /// equations is neglected.
  double log_determinant() const { return log_determinant_; }

  /// Returns whether the pair of blocks is in the pattern of the factor.
  bool in_pattern(int a, int b) const;
  /// Returns S for the rows of block a and the columns of block b. Outside of the pattern, it solves once per column of
  /// the block that is eliminated later, from its place to the root and back.
  void block(int a, int b, Eigen::Ref<Eigen::MatrixXd> S) const;
  /// Returns S x.
  Eigen::VectorXd times(Eigen::VectorXd x) const {
    solve_column(0, 0, x);
    return x;
  }
  /// Returns J S Jᵀ for rows J whose columns belong to these blocks, side by side. All pairs of the blocks must be in
  /// the pattern. If directions have large variances but J does not observe them, solves along the elimination
  /// tree: a sum over entries of S would lose its digits by cancellation.
  Eigen::MatrixXd propagated(std::span<const int> blocks, const Eigen::MatrixXd& J) const;
  /// Returns the sum of the products of the diagonals of S and of the matrix of the last compute().
  double trace_of_product() const;

 private:
  using ConstPart = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
  void distribute_equations(const LinearEquations& equations);
  bool eliminate_free(int k);
  bool eliminate_constrained(int k);
  /// Replaces the factor [L_kk; L_sk] in panel k by [D_k; T_kᵀ], and adds to the log determinant.
  void convert_factor(int k);
  bool eliminate_rows(int k, std::vector<Eigen::MatrixXd>& waiting);
  bool fail(int k, const Eigen::VectorXd& direction);
  /// Returns the block of S of two places, low ≤ high, that is in the pattern.
  ConstPart stored(int low, int high) const;
  void invert(int k);
  void solve_column(int from, int to, Eigen::VectorXd& x) const;
  int panel_row(int k, int row_block) const;
  double* panel(int k) { return entries_ + panel_[std::size_t(k)]; }
  const double* panel(int k) const { return entries_ + panel_[std::size_t(k)]; }
  int below(int k) const { return panel_rows_[std::size_t(k)] - size_[std::size_t(k)]; }

  std::vector<int> place_;                  // elimination index of each block of the pattern
  std::vector<int> place_of_unknown_;       // elimination index of the block of each unknown
  std::vector<Eigen::MatrixXd> equations_;  // equations assigned to each place, with the panel rows as columns
  double smallest_pivot_ = 1;
  double log_determinant_ = 0, decrease_ = 0;
  Eigen::VectorXd minimizer_;
  // The entries of the factor become [D_k; T_kᵀ]. inverse_ is [S_kk; S_sk] in the same layout.
  Eigen::VectorXd inverse_, S_ss_, identity_;
};

}  // namespace tandem::detail

#pragma once

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <tandem/solvers/linear/block_cholesky.hpp>

namespace tandem::detail {

struct ConstrainedFront;

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
/// S_sk = S_ss T_kᵀ        S_kk = D_k + T_k S_sk
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

 private:
  void distribute_equations(const LinearEquations& equations);
  bool eliminate_free(int k);
  bool eliminate_constrained(int k);
  bool fail(int k, const Eigen::VectorXd& direction);
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
  double log_determinant_ = 0;
  // The entries of the factor become [D_k; T_kᵀ]. inverse_ is [S_kk; S_sk] in the same layout.
  Eigen::VectorXd inverse_, S_ss_, identity_;
};

}  // namespace tandem::detail

#pragma once

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <tandem/solvers/linear/block_cholesky.hpp>

namespace tandem::detail {

struct ConstrainedFront;

/// Linear equations A x = 0 by triplets. Rows whose entries are all zero say nothing.
struct LinearEquations {
  std::vector<int> row, column;  ///< ascending in row or not; a pair may occur twice and then adds up
  std::vector<double> value;
  int num_rows = 0;
};

/// The blocks of S = H⁻¹ on the pattern of H's Cholesky factor, and others on demand; under equations A x = 0 those of
/// S = Z (Zᵀ H Z)⁻¹ Zᵀ, Z a basis of A's null space. Never more memory than twice the factor's.
///
/// Elimination writes each block as x_k = T_k x_s + z_k, z_k of covariance D_k, with s the block rows below k in the
/// factor. Then backwards (Takahashi, Fagan & Chen 1973, by blocks; Erisman & Tinney 1975)
///
///   S_sk = S_ss T_kᵀ        S_kk = D_k + T_k S_sk
///
/// and all of S_ss is in the pattern. Without equations T_k = −L_kk⁻ᵀ L_skᵀ and D_k = (L_kk L_kkᵀ)⁻¹; blocks under
/// equations are eliminated by ConstrainedFront.
class SelectedInverse : private BlockCholesky {
 public:
  /// `pairs` of blocks join the pattern, as zeros of H.
  explicit SelectedInverse(const SymmetricPattern& pattern, std::span<const std::pair<int, int>> pairs = {});

  /// All blocks of the pattern, for H by its pattern's values. False when a pivot is not positive: failed_unknown(). It
  /// ends with the exception that `check` throws, which is called often.
  bool compute(const Eigen::VectorXd& hessian, const LinearEquations& equations = {},
               const std::function<void()>& check = {});
  using BlockCholesky::failed_unknown;
  /// Whether some pivot was so small against its diagonal entry that it may be rounding.
  bool weak() const { return weak_; }
  /// log det H; under equations of the Hessian in their null space, but for a factor that is the equations' alone.
  double log_determinant() const { return log_determinant_; }

  /// Whether the blocks' pair is in the factor's pattern.
  bool holds(int a, int b) const;
  /// S of rows a and columns b. Outside of the pattern, sparse solves of b's columns or a's, whichever is eliminated
  /// later: from its place on to the root and back to the other's.
  void block(int a, int b, Eigen::Ref<Eigen::MatrixXd> S) const;

 private:
  void start_equations(const LinearEquations& equations);
  bool eliminate_free(int k);
  bool eliminate_constrained(int k);
  bool fail(int k, const Eigen::VectorXd& direction);
  void invert(int k);
  void solve_column(int from, int to, Eigen::VectorXd& x) const;
  int panel_row(int k, int row_block) const;
  double* panel(int k) { return entries_ + panel_[std::size_t(k)]; }
  const double* panel(int k) const { return entries_ + panel_[std::size_t(k)]; }
  int below(int k) const { return panel_rows_[std::size_t(k)] - size_[std::size_t(k)]; }

  std::vector<int> place_;                  // of each block of the pattern
  std::vector<int> place_of_unknown_;       // its block's place
  std::vector<Eigen::MatrixXd> equations_;  // waiting at each place, columns as the panel's rows
  bool weak_ = false;
  double log_determinant_ = 0;
  // The factor's entries become [D_k; T_kᵀ]; inverse_ is [S_kk; S_sk] in the same layout.
  Eigen::VectorXd inverse_, S_ss_, identity_;
};

}  // namespace tandem::detail

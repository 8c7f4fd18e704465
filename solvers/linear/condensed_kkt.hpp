#pragma once

#include <vector>

#include <Eigen/Core>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>

namespace tandem::detail {

/// Linear systems of an interior-point method, solved by a Cholesky factorisation on the blocks of the Hessian. The
/// unknowns are those of the NLP (x), the slacks of the inequalities (s), and the multipliers of equalities (c) and
/// inequalities (d):
///
///     | H    0    Jcᵀ   Jdᵀ |          H includes Σ and the inertia correction; S, C, D and B are diagonal,
///     | 0    S    0     B   |          S, C, D ≥ 0, and B = −1 up to scaling
///     | Jc   0   −C     0   |
///     | Jd   B    0    −D   |
///
/// Slacks and multipliers are eliminated first. The remaining matrix M = H + Jcᵀ C⁻¹ Jc + Jdᵀ S (B² + D S)⁻¹ Jd has the
/// blocks of H, because the variables of a constraint are neighbours in its pattern. The pivots before M have known
/// signs. M is thus positive definite if and only if the whole matrix has one negative eigenvalue per constraint, the
/// inertia of a descent direction.
///
/// M needs C⁻¹, and loses H to rounding if S is very large. C and D are therefore raised to a small part of Jᵢ
/// diag(H)⁻¹ Jᵢᵀ of the row: `regularization` for equalities, and 1e-4 of that for inequalities, which also have S.
/// solve() returns the solution of the modified matrix. The iterative refinement of the interior-point method corrects
/// the difference.
class CondensedKkt {
 public:
  explicit CondensedKkt(const NlpEvaluator& nlp);

  /// Analyses the triplets of the matrix, whose indices start at `base`. Each off-diagonal pair must occur in one
  /// triangle; duplicates are summed. Entries of Jc and Jd must be in the order of the Jacobian of the NLP. Returns
  /// false if the matrix has another form.
  bool analyze(int size, int entries, const int* row, const int* column, int base);
  /// Returns false if the matrix, after rounding, does not have the required inertia. solve() then returns zero.
  bool factorize(const double* values, double regularization);
  /// Overwrites the right-hand side by the unrefined solution.
  void solve(double* rhs);

  /// Number of negative eigenvalues of a matrix with the required inertia.
  int num_constraints() const { return equalities_ + inequalities_; }
  int size() const { return unknowns_ + inequalities_ + num_constraints(); }

 private:
  using Vector = Eigen::VectorXd;

  struct HessianEntries {  // entries of the pattern, by columns
    std::vector<int> column_start, row;
  };
  bool map_entry(int entry, int row, int column, const HessianEntries& hessian);
  void load(const double* values);
  void regularize(double relative);

  struct Run {  // consecutive triplets, and their consecutive targets
    int from, to, size;
  };
  static void add(std::vector<Run>& runs, int from, int to);

  const NlpEvaluator& nlp_;
  const SymmetricPattern& hessian_pattern_;
  const TripletPattern& jacobian_pattern_;
  int unknowns_, equalities_ = 0, inequalities_ = 0;
  std::vector<int> multiplier_;                             // index of the multiplier of each row of the NLP
  std::vector<int> equality_entries_, inequality_entries_;  // entries of the Jacobian of the NLP, in order
  std::size_t next_equality_ = 0, next_inequality_ = 0;
  std::vector<Run> to_hessian_, to_jacobian_, to_diagonal_, to_coupling_;

  Vector hessian_;  // H, then M
  Vector jacobian_;
  Vector diagonal_;     // S, −C, −D
  Vector coupling_;     // B
  Vector regularized_;  // C and D after regularisation
  Vector weights_;      // weight of each row of the NLP in M
  Vector curvature_, x_, rows_;
  BlockCholesky factor_;
  bool factorized_ = false;
};

}  // namespace tandem::detail

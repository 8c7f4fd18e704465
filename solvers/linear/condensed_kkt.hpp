#pragma once

#include <vector>

#include <Eigen/Core>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/linear/pivoted_kkt.hpp>

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
/// blocks of H: its pattern connects the variables of each constraint. The pivots before M have known signs. M is thus
/// positive definite if and only if the whole matrix has one negative eigenvalue per constraint, the inertia of a
/// descent direction.
///
/// M needs C⁻¹, and loses H to rounding if S is very large. C and D are therefore raised to a small part of Jᵢ
/// diag(H)⁻¹ Jᵢᵀ of the row. The part is 1e-8 for equalities, and 1e-12 for inequalities, which also have S. The
/// function solve() returns the solution of the modified matrix. The iterative refinement of the interior-point method
/// corrects the difference.
///
/// The refinement fails if H has almost no curvature along a variable, for example one that only constraints read. The
/// modification is then large for the other variables of its rows. The option `pivoted` of factorize() remains
/// accurate. It solves the whole matrix by an LU factorisation with pivoting. M, with a smaller modification, then
/// gives only the inertia.
///
/// If the NLP has at least as many equalities as unknowns, padding unknowns follow x. They are uncoupled and have a
/// positive diagonal entry.
class CondensedKkt {
 public:
  /// Returns the number of padding unknowns. Without them, Ipopt refuses NLPs with more equalities than unknowns, and
  /// ignores the cost of NLPs with as many.
  static int num_padding(const NlpEvaluator& nlp);

  explicit CondensedKkt(const NlpEvaluator& nlp);

  /// Analyses the triplets of the matrix, whose indices start at `base`. Each off-diagonal pair must occur in one
  /// triangle; duplicates are summed. Entries of Jc and Jd must be in the order of the Jacobian of the NLP. Returns
  /// false if the matrix has another form.
  bool analyze(int size, int entries, const int* row, const int* column, int base);
  /// Returns false if the matrix, after rounding, does not have the required inertia. solve() then returns zero.
  /// `pivoted` selects the slower factorisation, for use if refined solutions of the other one are inaccurate.
  bool factorize(const double* values, bool pivoted = false);
  /// Overwrites the right-hand side by the unrefined solution.
  void solve(double* rhs);

  /// Number of negative eigenvalues of a matrix with the required inertia.
  int num_constraints() const { return equalities_ + inequalities_; }
  int size() const { return first_slack_ + inequalities_ + num_constraints(); }

 private:
  using Vector = Eigen::VectorXd;

  struct HessianEntries {  // entries of the pattern, by columns
    std::vector<int> column_start, row;
  };
  bool map_entry(int entry, int row, int column, const HessianEntries& hessian);
  void load(const double* values);
  void find_compliance(bool least);
  bool factorize_condensed(const double* values, bool least);
  bool factorize_pivoted(const double* values);
  void solve_condensed(Eigen::Map<Eigen::VectorXd>& v);

  struct Run {  // consecutive triplets, and their consecutive targets
    int from, to, size;
  };
  static void add(std::vector<Run>& runs, int from, int to);

  const NlpEvaluator& nlp_;
  const SymmetricPattern& hessian_pattern_;
  const TripletPattern& jacobian_pattern_;
  int unknowns_, first_slack_, equalities_ = 0, inequalities_ = 0;
  std::vector<int> multiplier_;                             // index of the multiplier of each row of the NLP
  std::vector<int> equality_entries_, inequality_entries_;  // entries of the Jacobian of the NLP, in order
  std::size_t next_equality_ = 0, next_inequality_ = 0;
  std::vector<Run> to_hessian_, to_jacobian_, to_diagonal_, to_coupling_;

  Vector hessian_;  // H, then M
  Vector jacobian_;
  Vector diagonal_;     // diagonal of padding, S, −C, −D
  Vector coupling_;     // B
  Vector compliance_;   // compliance of the cost along each constraint
  Vector regularized_;  // C and D after regularisation
  Vector weights_;      // weight of each row of the NLP in M
  Vector curvature_, x_, rows_;
  BlockCholesky factor_;
  PivotedKkt pivoted_;
  bool factorized_ = false, use_pivoted_ = false;
};

}  // namespace tandem::detail

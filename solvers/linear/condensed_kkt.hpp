#pragma once

#include <vector>

#include <Eigen/Core>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>

namespace tandem::detail {

/// An interior-point method's linear systems, by a Cholesky factor on the Hessian's own blocks. The unknowns are those of
/// the program (x), the slacks of its inequalities (s), and the multipliers of equalities (c) and inequalities (d):
///
///     | H    0    Jcᵀ   Jdᵀ |          H with Σ and what corrects its inertia; S, C, D and B diagonal,
///     | 0    S    0     B   |          S, C, D ≥ 0, B = −1 but for scaling
///     | Jc   0   −C     0   |
///     | Jd   B    0    −D   |
///
/// Slacks and multipliers are eliminated first: M = H + Jcᵀ C⁻¹ Jc + Jdᵀ S (B² + D S)⁻¹ Jd has the blocks of H, since each
/// constraint's variables are neighbours in its pattern. As each pivot before M is of known sign, M is positive definite
/// if and only if the whole matrix has as many negative eigenvalues as there are constraints: the inertia that makes a
/// step one of descent.
///
/// M needs C⁻¹, and loses H to rounding where S is very large. So C and D are raised to at least a small part of the row's
/// Jᵢ diag(H)⁻¹ Jᵢᵀ: `regularization` for equalities, 1e-4 of that for inequalities, which have S as well (and which, when
/// they say the same thing twice, differ by it alone). What solve() gives is the solution of that matrix near by; the
/// caller's refinement against its own, which interior-point methods do anyway, takes the difference back.
class CondensedKkt {
 public:
  explicit CondensedKkt(const Program& program);

  /// Takes note of where the matrix's triplets stand, counted from `base`: of each pair one triangle, doubles adding up,
  /// those of Jc and of Jd in the order of the program's Jacobian. False when the matrix is not of this form.
  bool analyze(int size, int entries, const int* row, const int* column, int base);
  /// False when the matrix, or what rounding leaves of it, has not the right inertia; solve() then gives zero.
  bool factorize(const double* values, double regularization);
  /// Overwrites the right-hand side by the solution, unrefined.
  void solve(double* rhs);

  /// The eigenvalues below zero that a matrix of the right inertia has.
  int num_constraints() const { return equalities_ + inequalities_; }
  int size() const { return unknowns_ + inequalities_ + num_constraints(); }

 private:
  using Vector = Eigen::VectorXd;

  struct HessianEntries {  // of the pattern, by columns
    std::vector<int> column_start, row;
  };
  bool note(int entry, int row, int column, const HessianEntries& hessian);
  void load(const double* values);
  void regularize(double relative);

  struct Run {  // consecutive triplets' values, and where they are added
    int from, to, size;
  };
  static void add(std::vector<Run>& runs, int from, int to);

  const Program& program_;
  const SymmetricPattern& hessian_pattern_;
  const TripletPattern& jacobian_pattern_;
  int unknowns_, equalities_ = 0, inequalities_ = 0;
  std::vector<int> multiplier_;                   // of each row of the program, its place from the first multiplier on
  std::vector<int> of_equality_, of_inequality_;  // entries of the program's Jacobian, in order
  std::size_t next_equality_ = 0, next_inequality_ = 0;
  std::vector<Run> to_hessian_, to_jacobian_, to_diagonal_, to_coupling_;

  Vector hessian_;  // H, and then M
  Vector jacobian_;
  Vector diagonal_;     // S, −C, −D
  Vector coupling_;     // B
  Vector regularized_;  // C, D, raised
  Vector weights_;      // of each row of the program in M
  Vector curvature_, x_, rows_;
  BlockCholesky factor_;
  bool factorized_ = false;
};

}  // namespace tandem::detail

#pragma once

#include <span>
#include <utility>
#include <vector>

#include <tandem/problem/problem.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/solvers/linear/selected_inverse.hpp>

namespace tandem {

/// Marginal covariances of a problem's variables at their values, in the tangent space of right perturbations
/// (X ⊕ δ = X Exp(δ), translation first; m², m rad, rad²): blocks of S = H⁻¹, with H the Gauss-Newton Hessian, robust
/// losses by their weights ρ′. Solve the problem first: away from the optimum they mean little.
///
/// - Fixed variables have zero covariance.
/// - Under hard equalities (equal bounds) S is that of the problem confined to them, linearised:
///   S = H⁻¹ − H⁻¹Aᵀ (A H⁻¹ Aᵀ)⁻¹ A H⁻¹, zero along constrained directions; H alone may be singular, and equalities
///   may repeat each other. Combinations of rows (scaled to norm 1) below 1e-10 count as repeats. Digits are lost to
///   two rows that differ by δ, as 1e-16/δ, and to a row that some variable enters ε times as much as another, as
///   1e-16/ε², where the first is the earlier in the elimination.
/// - Inequalities are left out, at their bounds or not: conservative.
///
/// What is kept are the blocks of S on the pattern of H's Cholesky factor, found by selected inversion (see
/// detail::SelectedInverse): each variable's own, those of pairs that some residual reads together, and some more. Any
/// other pair costs a sparse solve for each column, time linear in the problem's size, at each call: many such pairs are
/// better named in advance, and then in the pattern.
///
/// A snapshot: the problem may change afterwards. Only, a variable that is removed takes its covariances with it.
class Marginals {
 public:
  /// Two variables by their ids (Problem::id).
  using Pair = std::pair<int, int>;
  /// With the covariances of all `pairs` at hand, as if some residual read both: linear in time for pairs of a chain that
  /// are of about the same place in it. Throws Error when residuals leave some direction free (naming the variable and
  /// it), or have no finite value, and Stopped when it is to stop.
  explicit Marginals(Problem& problem, std::span<const Pair> pairs = {}, const Stop& stop = {});

  template <LieGroup A>
  Matrix<A::dof, A::dof> covariance(const Variable<A>& a) const {
    return cross_covariance(a, a);
  }
  /// Rows of a, columns of b.
  template <LieGroup A, LieGroup B>
  Matrix<A::dof, B::dof> cross_covariance(const Variable<A>& a, const Variable<B>& b) const {
    Matrix<A::dof, B::dof> S;
    block(id(a), id(b), S);
    return S;
  }
  /// Of [δa; δb].
  template <LieGroup A, LieGroup B>
  Matrix<A::dof + B::dof, A::dof + B::dof> joint(const Variable<A>& a, const Variable<B>& b) const {
    Matrix<A::dof + B::dof, A::dof + B::dof> S;
    const Matrix<A::dof, B::dof> ab = cross_covariance(a, b);
    S << covariance(a), ab, ab.transpose(), covariance(b);
    return S;
  }
  /// Of variables by their ids, one after the other; a pair out of the pattern costs a solve for each column.
  Eigen::MatrixXd joint(std::span<const int> variable_ids, std::span<const int> dofs) const;
  /// log det H; under hard equalities that of H confined to them, but for a factor of the equations' own.
  double log_determinant() const { return parts_.inverse.log_determinant(); }
  /// Whether the pair's covariance is at hand, without a solve.
  template <LieGroup A, LieGroup B>
  bool in_pattern(const Variable<A>& a, const Variable<B>& b) const {
    return in_pattern(id(a), id(b));
  }

 private:
  template <LieGroup G>
  static int id(const Variable<G>& x) {
    return x.store && x.store->slots.is_current(x.slot, x.generation) ? x.store->id[std::size_t(x.slot)] : -1;
  }
  int block_of(int variable_id) const;
  void block(int a, int b, Eigen::Ref<Eigen::MatrixXd> S) const;
  bool in_pattern(int a, int b) const;

  struct Parts {
    std::vector<int> block_of_variable;  // −1 when fixed
    detail::SelectedInverse inverse;
  };
  static Parts compute(Problem& problem, std::span<const Pair> pairs, const Stop& stop);

  Parts parts_;
};

}  // namespace tandem

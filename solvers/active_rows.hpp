#pragma once

#include <vector>

#include <Eigen/Core>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>

namespace tandem::detail {

/// The active rows A of the hard constraints, in solves with M = H + Aᵀ W A.
///
/// With large weights W, M⁻¹ almost equals the inverse of H on the null space of A, and M is positive definite wherever
/// H is on that null space. The method of multipliers removes the difference in a few solves with one factor (Bertsekas
/// 1982, Constrained Optimization and Lagrange Multiplier Methods, §2.2):
///
///   p = M⁻¹ (Aᵀ (W b − y) − g)      y ← y + W (A p − b)
///
/// The limit minimises ½ pᵀ H p + gᵀ p under A p = b, with multipliers y. Redundant rows do no harm. Each solve keeps
/// H p + g + Aᵀ y = 0, so that only the rows have an error.
class ActiveRows {
 public:
  /// Bound at which a row is active.
  enum Side : signed char { lower = -1, inactive = 0, upper = 1 };

  /// Sets the rows that are active according to the multipliers y: equalities, and rows with y ≠ 0.
  static std::vector<Side> sides(const NlpEvaluator& nlp, const Eigen::VectorXd& y);

  /// Sets the multipliers y of an interior point, which are small on inactive inequalities, to 0 there. An inequality is
  /// inactive if its slack exceeds its multiplier, both in standard deviations that the cost alone would leave the row,
  /// as in a primal-dual active set method. The point of `nlp` must be X̄.
  static void drop_inactive(NlpEvaluator& nlp, Eigen::VectorXd& y);

  /// Takes over the active rows. `jacobian` is that of all rows of the NLP, `scale` the curvature of the cost along
  /// each unknown.
  void set(const NlpEvaluator& nlp, const Eigen::VectorXd& jacobian, const std::vector<Side>& sides,
           const Eigen::VectorXd& scale);

  bool empty() const { return entries_.row.empty(); }
  /// W of each row of the NLP, 0 for inactive ones.
  const Eigen::VectorXd& weights() const { return weight_; }
  /// Returns √w⁰ of each row of the NLP, where 1/w⁰ is the variance that the cost alone would leave it, roughly.
  double root_stiffness(Eigen::Index row) const { return root_[row]; }
  /// Sets p and y by one solve, from the right-hand sides g and b, which has one entry per row of the NLP. y must be a
  /// guess of the multipliers, 0 for inactive rows. Sets the `errors` A p − b of the rows, and returns the largest one
  /// [standard deviations, or relative to the largest entry of b].
  double solve(const BlockCholesky& factor, const Eigen::VectorXd& g, const Eigen::VectorXd& b, Eigen::VectorXd& p,
               Eigen::VectorXd& y, Eigen::VectorXd& errors) const;
  /// Corrects p and y of solve() until the largest error is negligible. Returns false if the equations contradict each
  /// other.
  bool refine(const BlockCholesky& factor, const Eigen::VectorXd& b, Eigen::VectorXd& p, Eigen::VectorXd& y,
              Eigen::VectorXd& errors) const;
  /// Corrects p and y by one solve for errors of the rows, and sets them to those of the linear rows that are left. The
  /// errors may be those of the rows of the problem at p, which are curved. They must be 0 for inactive rows.
  void correct(const BlockCholesky& factor, Eigen::VectorXd& p, Eigen::VectorXd& y, Eigen::VectorXd& errors) const;
  /// Returns W^½ A X, with one row per active row, for a matrix X with one row per unknown and a multiple of eight
  /// columns.
  BlockCholesky::Columns white_product(const BlockCholesky::Columns& X) const;

 private:
  TripletPattern entries_;         // of the active rows A
  Eigen::VectorXd value_;          // of each entry; may have more, unused values
  Eigen::VectorXd weight_, root_;  // of each row of the NLP
  mutable Eigen::VectorXd rhs_, change_;

  double size(const Eigen::VectorXd& errors, const Eigen::VectorXd& b) const;
};

}  // namespace tandem::detail

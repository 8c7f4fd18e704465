#pragma once

#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <Eigen/QR>

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem::testing {

/// Solves a linear-quadratic problem by a dense active-set method, independent of the solvers: one constraint enters or
/// leaves at a time, and each active set is solved by a rank-revealing factorisation of its KKT matrix.
class DenseProgram {
 public:
  /// Solves the problem; its variables get the solution.
  explicit DenseProgram(Problem& problem) : nlp_(problem) {
    const int n = nlp_.num_unknowns(), m = nlp_.num_rows();
    Eigen::VectorXd g(n), values(nlp_.hessian_pattern().nonzeros()), c(m),
        jacobian(Eigen::Index(nlp_.jacobian_pattern().row.size()));
    nlp_.linearize(g, values);
    nlp_.linearize_constraints(c, jacobian);
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n), A = Eigen::MatrixXd::Zero(m, n);
    const std::vector<int> starts = nlp_.hessian_pattern().column_starts(), rows = nlp_.hessian_pattern().rows();
    for (int j = 0; j < n; ++j)
      for (int k = starts[std::size_t(j)]; k < starts[std::size_t(j) + 1]; ++k)
        H(rows[std::size_t(k)], j) = H(j, rows[std::size_t(k)]) = values[k];
    for (std::size_t k = 0; k < nlp_.jacobian_pattern().row.size(); ++k)
      A(nlp_.jacobian_pattern().row[k], nlp_.jacobian_pattern().column[k]) += jacobian[Eigen::Index(k)];
    solve(H, g, A, c);
    nlp_.move_to(step_);
    nlp_.recenter();
  }

  /// Multipliers of all rows.
  const Eigen::VectorXd& multipliers() const { return y_; }
  /// Covariance of all unknowns under the active rows.
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  Eigen::Index first_unknown(const Problem& problem, const VariableHandle& x) const {
    return nlp_.hessian_pattern().first[std::size_t(nlp_.block_of(problem.id(x)))];
  }

 private:
  void solve(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, const Eigen::MatrixXd& A, const Eigen::VectorXd& c) {
    const Eigen::Index n = H.rows(), m = A.rows();
    std::vector<int> side(std::size_t(m), 0);  // 1: at the upper bound
    for (Eigen::Index i = 0; i < m; ++i) side[std::size_t(i)] = nlp_.lower()[i] == nlp_.upper()[i];
    for (int round = 0; round < 10000; ++round) {
      std::vector<Eigen::Index> active;
      for (Eigen::Index i = 0; i < m; ++i)
        if (side[std::size_t(i)] != 0) active.push_back(i);
      const auto a = Eigen::Index(active.size());
      Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n + a, n + a);
      Eigen::VectorXd right(n + a);
      K.topLeftCorner(n, n) = H;
      right.head(n) = -g;
      for (Eigen::Index k = 0; k < a; ++k) {
        const Eigen::Index i = active[std::size_t(k)];
        K.row(n + k).head(n) = A.row(i);
        K.col(n + k).head(n) = A.row(i);
        right[n + k] = (side[std::size_t(i)] > 0 ? nlp_.upper()[i] : nlp_.lower()[i]) - c[i];
      }
      const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factor(K);
      const Eigen::VectorXd solution = factor.solve(right);
      step_ = solution.head(n);
      y_.setZero(m);
      for (Eigen::Index k = 0; k < a; ++k) y_[active[std::size_t(k)]] = solution[n + k];
      const Eigen::VectorXd value = c + A * step_;
      double worst = 1e-11;
      Eigen::Index row = -1;
      int next = 0;
      for (Eigen::Index i = 0; i < m; ++i) {
        if (nlp_.lower()[i] == nlp_.upper()[i]) continue;
        const int at = side[std::size_t(i)];
        const double by = at ? -at * y_[i] : std::max(value[i] - nlp_.upper()[i], nlp_.lower()[i] - value[i]);
        if (!(by > worst)) continue;
        worst = by;
        row = i;
        next = at ? 0 : value[i] > nlp_.upper()[i] ? 1 : -1;
      }
      if (row < 0) {
        covariance_ = factor.pseudoInverse().topLeftCorner(n, n);
        return;
      }
      side[std::size_t(row)] = next;
    }
    throw Error("the dense active-set method cycles");
  }

  NlpEvaluator nlp_;
  Eigen::VectorXd step_, y_;
  Eigen::MatrixXd covariance_;
};

}  // namespace tandem::testing

#pragma once

#include <Eigen/Dense>

#include <tandem/solvers/marginals.hpp>

#include "problem/mixed_problem.hpp"

/// Provides reference marginals: dense linear algebra in extended precision on the same H and A.
namespace tandem::testing {

using Dense = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

/// Returns the Jacobian of the equalities with rows of norm 1.
inline Eigen::MatrixXd equality_jacobian(NlpEvaluator& nlp) {
  const Eigen::MatrixXd J = dense_jacobian(nlp);
  Eigen::MatrixXd A(0, J.cols());
  for (int i = 0; i < nlp.num_rows(); ++i)
    if (nlp.lower()[i] == nlp.upper()[i] && J.row(i).norm() > 0) {
      A.conservativeResize(A.rows() + 1, Eigen::NoChange);
      A.bottomRows<1>() = J.row(i).normalized();
    }
  return A;
}

struct DenseMarginals {
  Eigen::MatrixXd S, A;
  std::vector<int> block_of_id, first;

  explicit DenseMarginals(Problem& problem) {
    NlpEvaluator nlp(problem);
    Eigen::VectorXd g(nlp.num_unknowns()), h = hessian_values(nlp);
    nlp.linearize(g, h);
    first = nlp.hessian_pattern().first;
    for (int id = 0; id < problem.num_variables(); ++id) block_of_id.push_back(nlp.block_of(id));
    const Dense H = dense(nlp.hessian_pattern(), h).cast<long double>();
    A = equality_jacobian(nlp);
    Dense Z = Dense::Identity(H.rows(), H.rows());
    if (A.rows() > 0) {  // null space of A
      Eigen::FullPivHouseholderQR<Dense> qr(A.cast<long double>().transpose());
      qr.setThreshold(1e-10L);
      Z = Dense(qr.matrixQ()).rightCols(H.rows() - qr.rank()).eval();
    }
    const Dense reduced = Z.transpose() * H * Z;
    S = (Z * reduced.ldlt().solve(Dense(Z.transpose()))).cast<double>();
  }

  template <LieGroup A_, LieGroup B_>
  Eigen::MatrixXd block(const Problem& problem, const Variable<A_>& a, const Variable<B_>& b) const {
    const int p = block_of_id[std::size_t(problem.id(a))], q = block_of_id[std::size_t(problem.id(b))];
    if (p < 0 || q < 0) return Eigen::MatrixXd::Zero(A_::dof, B_::dof);
    return S.block(first[std::size_t(p)], first[std::size_t(q)], A_::dof, B_::dof);
  }
};

/// Largest error of the marginals over all pairs of variables. Entries are relative to √(S_ii S_jj), or to 1e-8 of the
/// largest entry if the variances are zero.
struct Comparison {
  double error = 0;
  int pairs = 0, outside = 0;  ///< pairs compared, and those outside the pattern
};
template <class... Xs>
Comparison compare(Problem& problem, const std::vector<Xs>&... lists) {
  const Marginals marginals(problem);
  const DenseMarginals reference(problem);
  Comparison result;
  const double floor = 1e-8 * std::sqrt(reference.S.cwiseAbs().maxCoeff());
  const auto pair = [&](const auto& a, const auto& b) {
    const Eigen::MatrixXd S = marginals.cross_covariance(a, b), expected = reference.block(problem, a, b);
    const Eigen::VectorXd sa = reference.block(problem, a, a).diagonal().cwiseMax(0.0).cwiseSqrt().cwiseMax(floor);
    const Eigen::VectorXd sb = reference.block(problem, b, b).diagonal().cwiseMax(0.0).cwiseSqrt().cwiseMax(floor);
    const double error =
        (sa.cwiseInverse().asDiagonal() * (S - expected) * sb.cwiseInverse().asDiagonal()).cwiseAbs().maxCoeff();
    result.error = std::isfinite(error) ? std::max(result.error, error) : HUGE_VAL;
    ++result.pairs;
    result.outside += !marginals.in_pattern(a, b);
  };
  const auto against_all = [&](const auto& list) {
    for (const auto& a : list) {
      const auto all = [&](const auto& other) {
        for (const auto& b : other) pair(a, b);
      };
      (all(lists), ...);
    }
  };
  (against_all(lists), ...);
  return result;
}

}  // namespace tandem::testing

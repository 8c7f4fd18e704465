#include <gtest/gtest.h>

#include "mixed_problem.hpp"

namespace tandem::testing {
namespace {

/// A chain with constraints, long enough for two tasks.
TEST(ExactHessian, LongChainMatchesFiniteDifferences) {
  constexpr int kPoses = 320;
  const Vector<6> step{1.0, 0.05, -0.02, 0.02, -0.03, 0.1};
  const Gaussian noise{0.3, 0.2, 0.4, 0.05, 0.04, 0.1};
  Problem problem;
  std::vector<Variable<SE3>> x;
  for (int k = 0; k < kPoses; ++k) x.push_back(problem.add(SE3::Exp(0.3 * random_vector(6, 1.0, unsigned(k)))));
  problem.minimize(Prior<SE3>{SE3()}, noise, {x[0]});
  for (std::size_t k = 1; k < x.size(); ++k) {
    problem.minimize(RelativePose<SE3>{SE3::Exp(step)}, noise, {x[k - 1], x[k]}, Cauchy(2.0));
    if (k > 1) problem.minimize(ConstantTwist<SE3>{1.0, 1.1}, noise, {x[k - 2], x[k - 1], x[k]});
    if (k % 3 == 0)
      problem.subject_to(TwistComponents<SE3, sway | heave>{1.0}, Bounds<2>(equal_to(0.0)), {x[k - 1], x[k]});
  }
  NlpEvaluator nlp(problem);
  const int n = nlp.num_unknowns(), m = nlp.num_rows();
  const auto& pattern = nlp.jacobian_pattern();
  const Eigen::VectorXd delta = random_vector(n, 0.2, 1), multipliers = random_vector(m, 3.0, 2);
  const auto gradient_at = [&](const Eigen::VectorXd& d) {
    Eigen::VectorXd g(n), J(static_cast<Eigen::Index>(pattern.row.size()));
    nlp.move_to(d);
    nlp.gradient(g);
    nlp.constraint_jacobian(J);
    for (std::size_t k = 0; k < pattern.row.size(); ++k)
      g[pattern.column[k]] += J[Eigen::Index(k)] * multipliers[pattern.row[k]];
    return g;
  };
  nlp.move_to(delta);
  Eigen::VectorXd values = hessian_values(nlp);
  nlp.exact_hessian(1.0, multipliers, values);
  const Eigen::MatrixXd H = dense(nlp.hessian_pattern(), values);
  const double scale = H.cwiseAbs().maxCoeff();
  for (int column = 0; column < n; column += 37) {
    constexpr double h = 1e-5;
    Eigen::VectorXd plus = delta, minus = delta;
    plus[column] += h;
    minus[column] -= h;
    const Eigen::VectorXd expected = (gradient_at(plus) - gradient_at(minus)) / (2 * h);
    EXPECT_LE((H.col(column) - expected).cwiseAbs().maxCoeff(), 1e-9 * scale) << "column " << column;
  }
}

}  // namespace
}  // namespace tandem::testing

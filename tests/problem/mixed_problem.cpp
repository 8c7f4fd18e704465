#include "problem/mixed_problem.hpp"

#include <algorithm>
#include <random>

namespace tandem::detail {

template class StateStore<testing::Body>;
template struct FunctionsOf<testing::Carried>;
template struct FunctionsOf<testing::Below>;
template struct FunctionsOf<Prior<testing::Body>>;

}  // namespace tandem::detail

namespace tandem::testing {

MixedVariables add_mixed_variables(Problem& problem) {
  const auto pose = [](double x, double y, double z, double rx, double ry, double rz) {
    return SE3::Exp((Vector<6>() << x, y, z, rx, ry, rz).finished());
  };
  MixedVariables v;
  v.a = problem.add(pose(0.3, -1.2, 0.5, 0.2, 0.1, -0.6), "a");
  v.b = problem.add(pose(1.1, -0.7, 0.4, -0.3, 0.4, 0.2), "b");
  v.p = problem.add(R3({0.4, -0.9, 1.3}), "p");
  v.q = problem.add(SE2::Exp({0.7, 0.2, 1.1}), "q");
  v.c = problem.add(pose(1.6, 0.1, -0.2, 0.5, -0.2, 0.9), "c");
  v.s = problem.add(Body(SO3::Exp({0.9, -0.4, 0.3}), R3({-0.2, 0.6, 0.1})), "s");
  return v;
}

MixedProblem::MixedProblem() {
  each_mixed_cost(v, [&](const auto& residual, const Gaussian& noise, const auto& x, const Loss& loss) {
    problem.minimize(residual, noise, x, loss);
  });
  each_mixed_constraint(
      v, [&](const auto& residual, const auto& bounds, const auto& x) { problem.subject_to(residual, bounds, x); });
}

Eigen::MatrixXd dense(const SymmetricPattern& pattern, const Eigen::VectorXd& values) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(pattern.size(), pattern.size());
  for (int block = 0; block < pattern.num_blocks(); ++block)
    for (int b = pattern.block_start[std::size_t(block)]; b < pattern.block_start[std::size_t(block) + 1]; ++b) {
      const int other = pattern.block_row[std::size_t(b)], row = pattern.first[std::size_t(other)];
      const int column = pattern.first[std::size_t(block)], m = pattern.width(other), n = pattern.width(block);
      const double* from =
          values.data() + pattern.value_start[std::size_t(block)] + pattern.block_offset[std::size_t(b)];
      H.block(row, column, m, n) = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>(
          from, m, n, Eigen::OuterStride<>(pattern.height(block)));
      if (other != block) H.block(column, row, n, m) = H.block(row, column, m, n).transpose();
    }
  return H;
}

SymmetricPattern reversed(const SymmetricPattern& natural) {
  SymmetricPattern h;
  h.first = natural.first;
  const int n = natural.num_blocks();
  for (int k = 0; k < n; ++k) h.place.push_back(n - 1 - k);
  for (int k = 0; k < n; ++k) {
    h.block_start.push_back(int(h.block_row.size()));
    h.block_row.push_back(k);
    for (int other = k - 1; other >= 0; --other) {
      const auto begin = natural.block_row.begin() + natural.block_start[std::size_t(other)],
                 end = natural.block_row.begin() + natural.block_start[std::size_t(other) + 1];
      if (std::find(begin, end, k) != end || (k == n - 1 && other == 0)) h.block_row.push_back(other);
    }
  }
  h.block_start.push_back(int(h.block_row.size()));
  h.place_values("the matrix");
  return h;
}

Eigen::MatrixXd dense_jacobian(NlpEvaluator& nlp) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(nlp.jacobian_pattern().row.size()));
  nlp.constraint_jacobian(values);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(nlp.num_rows(), nlp.num_unknowns());
  for (Eigen::Index k = 0; k < values.size(); ++k)
    J(nlp.jacobian_pattern().row[std::size_t(k)], nlp.jacobian_pattern().column[std::size_t(k)]) += values[k];
  return J;
}

Eigen::VectorXd random_vector(Eigen::Index n, double size, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-size, size);
  return Eigen::VectorXd::NullaryExpr(n, [&](Eigen::Index) { return uniform(random); });
}

}  // namespace tandem::testing

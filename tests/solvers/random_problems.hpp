#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include <tandem/lie/rn.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>

/// Provides small random problems with hard constraints, and an independent check of their solutions.
namespace tandem::testing {

/// Residual aᵀx + bᵀy + h sin(cᵀx + dᵀy), which has curvature of both signs.
struct Wave {
  static constexpr std::string_view name = "wave";
  static constexpr int dim = 1;
  using States = std::tuple<R3, R3>;
  Vector<3> a, b, c, d;
  double height;

  void operator()(const R3& x, const R3& y, Vector<1>& r, Matrix<1, 3>* Jx = nullptr,
                  Matrix<1, 3>* Jy = nullptr) const {
    const double phase = c.dot(x.vector()) + d.dot(y.vector());
    r[0] = a.dot(x.vector()) + b.dot(y.vector()) + height * std::sin(phase);
    if (Jx) *Jx = (a + height * std::cos(phase) * c).transpose();
    if (Jy) *Jy = (b + height * std::cos(phase) * d).transpose();
  }
};

/// Residual that depends on no variable.
struct ConstantResidual {
  static constexpr std::string_view name = "constant";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  double value;

  void operator()(const R3&, Vector<1>& r, Matrix<1, 3>* J = nullptr) const {
    r[0] = value;
    if (J) J->setZero();
  }
};

struct RandomProblem {
  Problem problem;
  std::vector<Variable<R3>> x;

  Eigen::VectorXd values() const {
    Eigen::VectorXd all(3 * Eigen::Index(x.size()));
    for (std::size_t k = 0; k < x.size(); ++k) all.segment<3>(3 * Eigen::Index(k)) = problem.value(x[k]).vector();
    return all;
  }
};

/// Returns a problem with 12 unknowns, soft Wave residuals with standard deviations over three decades, and up to 9
/// hard ones with all kinds of bounds. All constraints are met at one random point. Every third problem has a constant
/// cost of up to 5e5.
inline RandomProblem random_problem(std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator);
  };
  const auto vector = [&](double size) {
    return Vector<3>(size * normal(generator), size * normal(generator), size * normal(generator));
  };
  const auto wave = [&] { return Wave{vector(1.0), vector(1.0), vector(0.5), vector(0.5), uniform(0.0, 1.0)}; };

  RandomProblem p;
  std::vector<R3> inside;
  for (int k = 0; k < 4; ++k) {
    p.x.push_back(p.problem.add(R3(vector(2.0)), "x" + std::to_string(k)));
    inside.emplace_back(vector(2.0));
    const double sigma = std::pow(10.0, uniform(-1.0, 1.0));
    p.problem.minimize(Prior<R3>{R3(vector(2.0))}, Gaussian{sigma, sigma, sigma}, {p.x.back()});
  }
  const auto pair = [&] {
    const int first = std::uniform_int_distribution<int>(0, 3)(generator);
    return std::pair(std::size_t(first), std::size_t(first + std::uniform_int_distribution<int>(1, 3)(generator)) % 4);
  };
  for (int k = 0; k < 6; ++k) {
    const auto [i, j] = pair();
    const Wave w = wave();
    p.problem.minimize(w, Gaussian{std::pow(10.0, uniform(-2.0, 1.0))}, {p.x[i], p.x[j]});
  }
  if (seed % 3 == 0) p.problem.minimize(ConstantResidual{uniform(1.0, 1e3)}, Gaussian{1.0}, {p.x[0]});
  const int rows = std::uniform_int_distribution<int>(1, 9)(generator);
  for (int k = 0; k < rows; ++k) {
    const auto [i, j] = pair();
    const Wave w = wave();
    Vector<1> at;
    w(inside[i], inside[j], at);
    const double margin = uniform(0.0, 1.0) < 0.3 ? 0.0 : uniform(0.0, 1.0);
    const double kind = uniform(0.0, 1.0);
    const UniformBounds bounds = kind < 0.15  ? equal_to(at[0])
                                 : kind < 0.5 ? at_most(at[0] + margin)
                                 : kind < 0.8 ? at_least(at[0] - margin)
                                              : between(at[0] - margin, at[0] + uniform(0.01, 1.0));
    p.problem.subject_to(w, bounds, {p.x[i], p.x[j]});
  }
  return p;
}

/// Residual of the first-order (Karush–Kuhn–Tucker) conditions at X̄.
struct Optimality {
  /// Least ‖g + Jᵀ y‖ over the multipliers y, with unknowns scaled to unit curvature (standard deviations of the cost).
  /// Only multipliers of active rows with the signs of their bounds are allowed.
  double residual;
  double multipliers;  ///< Σ |y|: the decrease of the cost if each bound is relaxed by one
};

/// Computes the residual. A row is active if a step of `at_bound` in scaled unknowns reaches its bound.
inline Optimality optimality(Problem& problem, double at_bound = 1e-4) {
  NlpEvaluator nlp(problem);
  const Eigen::Index n = nlp.num_unknowns(), m = nlp.num_rows();
  Eigen::VectorXd g(n), hessian(nlp.hessian_pattern().nonzeros()), c(m), root(n);
  Eigen::VectorXd values(Eigen::Index(nlp.jacobian_pattern().row.size()));
  nlp.linearize(g, hessian);
  nlp.linearize_constraints(c, values);
  detail::hessian_diagonal(nlp.hessian_pattern(), hessian, root);
  root = root.cwiseSqrt();
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(m, n);
  for (std::size_t k = 0; k < nlp.jacobian_pattern().row.size(); ++k)
    J(nlp.jacobian_pattern().row[k], nlp.jacobian_pattern().column[k]) += values[Eigen::Index(k)];
  // One column per active bound, for a non-negative multiplier.
  Eigen::MatrixXd A(n, 0);
  std::vector<double> norms;
  for (Eigen::Index i = 0; i < m; ++i)
    for (const double side : {1.0, -1.0}) {
      const Eigen::VectorXd column = side * J.row(i).transpose().cwiseQuotient(root);
      const double distance = side > 0 ? nlp.upper()[i] - c[i] : c[i] - nlp.lower()[i];
      if (distance > at_bound * column.norm()) continue;
      A.conservativeResize(Eigen::NoChange, A.cols() + 1);
      A.rightCols<1>() = column.normalized();
      norms.push_back(column.norm());
    }
  // Non-negative least squares by an active-set method (Lawson & Hanson 1974, §23.3).
  const Eigen::VectorXd target = -g.cwiseQuotient(root);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(A.cols());
  std::vector<Eigen::Index> passive;
  for (Eigen::Index step = 0; step < 10 * A.cols(); ++step) {
    const Eigen::VectorXd slope = A.transpose() * (target - A * y);
    Eigen::Index best = -1;
    for (Eigen::Index k = 0; k < A.cols(); ++k)
      if (std::find(passive.begin(), passive.end(), k) == passive.end() && (best < 0 || slope[k] > slope[best]))
        best = k;
    if (best < 0 || slope[best] <= 1e-13 * (1 + target.norm())) break;
    passive.push_back(best);
    while (!passive.empty()) {
      Eigen::MatrixXd P(n, Eigen::Index(passive.size()));
      for (std::size_t k = 0; k < passive.size(); ++k) P.col(Eigen::Index(k)) = A.col(passive[k]);
      const Eigen::VectorXd z = P.completeOrthogonalDecomposition().solve(target);
      double fraction = 1;
      for (std::size_t k = 0; k < passive.size(); ++k)
        if (const double now = y[passive[k]], then = z[Eigen::Index(k)]; then <= 0)
          fraction = std::min(fraction, now / std::max(now - then, 1e-300));
      for (std::size_t k = 0; k < passive.size(); ++k) y[passive[k]] += fraction * (z[Eigen::Index(k)] - y[passive[k]]);
      if (fraction >= 1) break;
      std::erase_if(passive, [&](Eigen::Index k) {
        if (y[k] > 1e-15) return false;
        y[k] = 0;
        return true;
      });
    }
  }
  double multipliers = 0;
  for (Eigen::Index k = 0; k < A.cols(); ++k) multipliers += y[k] / norms[std::size_t(k)];
  return {(target - A * y).norm(), multipliers};
}

}  // namespace tandem::testing

#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include <tandem/lie/rn.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/prior.hpp>

/// Provides small random problems with hard constraints.
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
  std::vector<R3> feasible;  ///< values of x that meet all constraints

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
    return Vector<3>{size * normal(generator), size * normal(generator), size * normal(generator)};
  };
  const auto wave = [&] { return Wave{vector(1.0), vector(1.0), vector(0.5), vector(0.5), uniform(0.0, 1.0)}; };

  RandomProblem p;
  for (int k = 0; k < 4; ++k) {
    p.x.push_back(p.problem.add(R3(vector(2.0)), "x" + std::to_string(k)));
    p.feasible.emplace_back(vector(2.0));
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
    w(p.feasible[i], p.feasible[j], at);
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

}  // namespace tandem::testing

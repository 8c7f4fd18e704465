#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Cholesky>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/calibration/noise_group.hpp>

/// A linear Gaussian problem and its exact evidence.
namespace tandem::testing {

using Number = Rn<1>;

/// A random walk of n steps that is measured at each step.
struct Walk {
  int n = 300;
  double step_sigma = 0.5, fix_sigma = 1.0, initial_sigma = 10.0;
  std::vector<double> z;
  double given_step_sigma = 1.0, given_fix_sigma = 1.0;
  Problem problem;
  std::vector<Variable<Number>> variables;
  NoiseGroup steps{"steps", {}, 0}, fixes{"fixes", {}, 0};

  explicit Walk(unsigned seed, int length = 300, double outliers = 0) : n(length) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    double x = 0;
    for (int i = 0; i < n; ++i, x += step_sigma * normal(random)) {
      z.push_back(x + fix_sigma * normal(random));
      if (uniform(random) < outliers) z.back() += 100;
    }
  }
  void build(const Loss& loss = {}) {
    auto& x = variables;
    for (int i = 0; i < n; ++i) {
      x.push_back(problem.add(Number(Vector<1>(z[std::size_t(i)]))));
      if (i == 0) {
        problem.minimize(Prior<Number>{Number()}, {initial_sigma}, {x[0]});
      } else {
        steps.rows.push_back({problem.minimize(RelativePose<Number>{Number()}, {given_step_sigma},
                                               {x[std::size_t(i) - 1], x[std::size_t(i)]})});
      }
      fixes.rows.push_back({problem.minimize(Prior<Number>{Number(Vector<1>(z[std::size_t(i)]))}, {given_fix_sigma},
                                             {x[std::size_t(i)]}, loss)});
    }
  }
  /// Returns the log density of z for factors on the given noise, up to a constant; by dense matrices.
  double exact(double log_steps, double log_fixes) const {
    const double q = std::pow(given_step_sigma * std::exp(log_steps), 2),
                 r = std::pow(given_fix_sigma * std::exp(log_fixes), 2);
    Eigen::MatrixXd S(n, n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) S(i, j) = initial_sigma * initial_sigma + q * std::min(i, j) + (i == j ? r : 0.0);
    const Eigen::LLT<Eigen::MatrixXd> llt(S);
    const Eigen::Map<const Eigen::VectorXd> d(z.data(), n);
    return -0.5 * d.dot(llt.solve(d)) - llt.matrixLLT().diagonal().array().log().sum();
  }
};

}  // namespace tandem::testing

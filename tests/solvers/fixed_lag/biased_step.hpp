#pragma once

#include <string_view>
#include <tuple>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/gaussian.hpp>

namespace tandem::testing {

/// Returns Gaussian noise of n rows with the standard deviation `sigma` each.
inline Gaussian noise(int n, double sigma) { return Gaussian(Eigen::VectorXd::Constant(n, sigma)); }

/// Odometry with a constant bias b per step, r = y − x − b − step.
struct BiasedStep {
  static constexpr std::string_view name = "biased step";
  static constexpr int dim = 3;
  using States = std::tuple<R3, R3, R3>;
  Vector<3> step;
  void operator()(const R3& x, const R3& y, const R3& b, Vector<3>& r, Matrix<3, 3>* Jx = nullptr,
                  Matrix<3, 3>* Jy = nullptr, Matrix<3, 3>* Jb = nullptr) const {
    r = y.vector() - x.vector() - b.vector() - step;
    if (Jx) *Jx = -Matrix<3, 3>::Identity();
    if (Jy) *Jy = Matrix<3, 3>::Identity();
    if (Jb) *Jb = -Matrix<3, 3>::Identity();
  }
};

}  // namespace tandem::testing

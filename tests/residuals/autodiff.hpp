#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <tuple>
#include <vector>

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/testing.hpp>

#include "sanitized.hpp"

namespace tandem {
namespace testing {

/// Dual numbers with one direction. All residuals use this scalar type, which saves compile time.
using Jet = ceres::Jet<double, 1>;

}  // namespace testing

// Instantiated in autodiff.cpp.
extern template class BasicSEK3<1, testing::Jet>;
extern template class BasicSE2<testing::Jet>;

}  // namespace tandem

namespace tandem::testing {

/// Returns the largest difference of the Jacobians from forward automatic differentiation, divided by their largest
/// entry. Returns infinity if the value over dual numbers differs. along(state, k, dual) evaluates with `state`
/// perturbed along k.
double autodiff_error(const Eigen::VectorXd& r, const Eigen::MatrixXd& J, const std::vector<int>& dofs,
                      const std::function<void(int state, int k, Jet* dual)>& along);

template <class R, class... Xs>
double autodiff_error(const R& residual, const Xs&... x) {
  Vector<R::dim> r;
  std::tuple<RowsBy<R::dim, Xs>...> J;
  std::apply([&](auto&... Ji) { residual(x..., r, &Ji...); }, J);
  Eigen::MatrixXd all(R::dim, (Xs::dof + ...));
  double* to = all.data();
  std::apply([&](const auto&... Ji) { ((to = std::copy_n(Ji.data(), Ji.size(), to)), ...); }, J);

  const std::tuple states(x.template cast<Jet>()...);
  const auto along = [&](int state, int k, Jet* dual) {
    auto moved = states;
    detail::each<sizeof...(Xs)>([&](auto i) {
      using X = typename std::tuple_element_t<i, std::tuple<Xs...>>::template Rebind<Jet>;
      if (int(i) != state) return;
      typename X::Tangent direction = X::Tangent::Zero();
      direction[k].v[0] = 1.0;
      std::get<i>(moved) = std::get<i>(moved) * X::Exp(direction);
    });
    Vector<R::dim, Jet> value;
    std::apply([&](const auto&... y) { residual(y..., value); }, moved);
    std::copy_n(value.data(), R::dim, dual);
  };
  return autodiff_error(r, all, {Xs::dof...}, along);
}

/// Tolerances on relative errors. Automatic differentiation rounds like the Jacobians: some tens of operations of 1e-16
/// each. Differences are limited by their resolution, which is worst where a discontinuity forces small steps: h < 1e-6
/// rad at positions of up to 100 m.
inline constexpr double kAutodiff = 1e-13, kDifferences = 1e-10, kWorstResolution = 5e-7;

inline void expect_correct(const JacobianReport& report) {
  EXPECT_LE(report.relative, kDifferences + report.resolution) << report.text;
  EXPECT_LE(report.resolution, kWorstResolution) << report.text;
}

template <class R, class... Xs>
void expect_correct_jacobians(const R& residual, const Xs&... x) {
  expect_correct(check_jacobians(residual, x...));
  EXPECT_LE(autodiff_error(residual, x...), kAutodiff) << R::name;
}

template <class R>
void expect_correct_jacobians_at_random_states(const R& residual, unsigned seed, int count = 40) {
  if (kSanitized) count = std::min(count, 8);
  expect_correct(check_jacobians_at_random(residual, seed, count));
  std::mt19937_64 random(seed);
  for (int i = 0; i < count; ++i) {
    const auto states = random_states<typename R::States>(random, StateDistance(i % 4));
    std::apply([&](const auto&... x) { EXPECT_LE(autodiff_error(residual, x...), kAutodiff) << R::name << ", " << i; },
               states);
  }
}

/// Returns a tangent with a rotation by `angle` [rad] and a translation of the order of `size` [m].
template <class G>
typename G::Tangent tangent(double angle, double size) {
  typename G::Tangent v;
  double norm2 = 0.0;
  for (int k = 0; k < G::dof; ++k) {
    v[k] = std::cos(1.0 + 2.3 * k);  // arbitrary direction
    if (detail::is_rotation<G>(k)) norm2 += v[k] * v[k];
  }
  for (int k = 0; k < G::dof; ++k) v[k] *= detail::is_rotation<G>(k) ? angle / std::sqrt(norm2) : size;
  return v;
}

/// Returns tangents from 0 to rotations by nearly π, where Log is ill-conditioned.
template <class G>
std::vector<typename G::Tangent> residual_sizes() {
  using std::numbers::pi;
  return {G::Tangent::Zero(),    tangent<G>(1e-9, 1e-9),     tangent<G>(0.02, 0.05),    tangent<G>(0.9, 2.0),
          tangent<G>(2.6, 80.0), tangent<G>(pi - 1e-3, 1.0), tangent<G>(pi - 1e-6, 1.0)};
}

/// Returns exp(M) in long double by a Taylor polynomial and 5 squarings.
template <int N>
Matrix<N, N, long double> expm(const Matrix<N, N>& M) {
  const Matrix<N, N, long double> A = M.template cast<long double>() / 32.0L;
  Matrix<N, N, long double> sum = Matrix<N, N, long double>::Identity(), term = sum;
  for (int k = 1; k < 40; ++k) sum += term = (term * A / static_cast<long double>(k)).eval();
  for (int i = 0; i < 5; ++i) sum = (sum * sum).eval();
  return sum;
}
template <class G>
auto expm(const typename G::Tangent& v) {
  return expm<G::matrix_size>(G::hat(v));
}
template <class G>
Matrix<G::matrix_size, G::matrix_size, long double> plain(const G& x) {
  return x.matrix().template cast<long double>();
}

/// Returns the largest entry of a − b, divided by the largest entry of a or 1, whichever is larger.
template <class A, class B>
double difference(const A& a, const B& b) {
  return double((a - b).cwiseAbs().maxCoeff() / std::max<long double>(1.0L, a.cwiseAbs().maxCoeff()));
}

}  // namespace tandem::testing

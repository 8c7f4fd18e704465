#pragma once

#include <gtest/gtest.h>

#include "residuals/autodiff.hpp"

namespace tandem::testing {

/// Returns the Hessian of wᵀ r with respect to right perturbations: the symmetric part of the derivative of Jᵀ w, by
/// dual numbers.
template <class R, class... Xs>
auto second_derivatives(const R& residual, const Vector<R::dim>& w, const Xs&... x) {
  constexpr int n = (Xs::dof + ...);
  Matrix<n, n> D;
  const std::tuple states(x.template cast<Jet>()...);
  int column = 0;
  detail::each<sizeof...(Xs)>([&](auto i) {
    using X = typename std::tuple_element_t<i, std::tuple<Xs...>>::template Rebind<Jet>;
    for (int k = 0; k < X::dof; ++k, ++column) {
      typename X::Tangent direction = X::Tangent::Zero();
      direction[k].v[0] = 1.0;
      auto moved = states;
      std::get<i>(moved) = std::get<i>(states) * X::Exp(direction);
      Vector<R::dim, Jet> r;
      std::tuple<RowsBy<R::dim, typename Xs::template Rebind<Jet>>...> J;
      std::apply([&](const auto&... y) { std::apply([&](auto&... Ji) { residual(y..., r, &Ji...); }, J); }, moved);
      int row = 0;
      std::apply(
          [&](const auto&... Ji) {
            const auto put = [&](const auto& by) {
              for (int c = 0; c < by.cols(); ++c, ++row) {
                D(row, column) = 0.0;
                for (int m = 0; m < R::dim; ++m) D(row, column) += w[m] * by(m, c).v[0];
              }
            };
            (put(Ji), ...);
          },
          J);
    }
  });
  return Matrix<n, n>(0.5 * (D + D.transpose()));
}

template <class R, class... Xs>
void expect_correct_curvature(const R& residual, const Vector<R::dim>& w, const Xs&... x) {
  static_assert(HasCurvature<R>);
  const auto expected = second_derivatives(residual, w, x...);
  std::remove_const_t<decltype(expected)> H;
  residual.curvature(x..., w, H);
  EXPECT_LE((H - expected).cwiseAbs().maxCoeff(), 1e-12 * std::max(1.0, expected.cwiseAbs().maxCoeff())) << R::name;
}

}  // namespace tandem::testing

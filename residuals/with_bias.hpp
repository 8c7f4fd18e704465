#pragma once

#include <tuple>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// A residual f(x) = h(x) − z with the bias b of its measurement as an additional state:
///
///   e = f(x) + b
///
/// b has the rows and units of f. GaussMarkov describes how it changes over time.
template <class R>
struct WithBias {
  static constexpr std::string_view name = R::name;
  static constexpr int dim = R::dim;
  using States = decltype(std::tuple_cat(typename R::States(), std::tuple<Rn<dim>>()));

  R residual;

  auto fields() { return std::tie(residual); }

  /// Takes the states of f, b, e and, if Jacobians are requested, the Jacobians of f and then that of b.
  template <class... Args>
  requires(sizeof...(Args) == std::tuple_size_v<States> + 1 ||
           sizeof...(Args) == 2 * std::tuple_size_v<States> + 1) void
  operator()(Args&&... args) const {
    constexpr std::size_t inner = std::tuple_size_v<States> - 1, r = inner + 1;
    const auto refs = std::tie(args...);
    const auto call = [&]<std::size_t... X, std::size_t... J>(std::index_sequence<X...>, std::index_sequence<J...>) {
      residual(std::get<X>(refs)..., std::get<r>(refs), std::get<r + 1 + J>(refs)...);
    };
    if constexpr (sizeof...(Args) == r + 1) {
      call(std::make_index_sequence<inner>(), std::index_sequence<>());
    } else {
      call(std::make_index_sequence<inner>(), std::make_index_sequence<inner>());
      if (const auto& by_bias = std::get<sizeof...(Args) - 1>(refs)) by_bias->setIdentity();
    }
    std::get<r>(refs) += std::get<inner>(refs).vector();
  }

  /// Takes the states, w, and H of all states. b is linear.
  template <class... Args>
  requires(HasCurvature<R> && sizeof...(Args) == std::tuple_size_v<States> + 2) void curvature(Args&&... args) const {
    constexpr std::size_t inner = std::tuple_size_v<States> - 1;
    constexpr int n = detail::CurvatureOf<R, typename R::States>::size;
    const auto refs = std::tie(args...);
    Matrix<n, n> of_residual;
    [&]<std::size_t... X>(std::index_sequence<X...>) {
      residual.curvature(std::get<X>(refs)..., std::get<inner + 1>(refs), of_residual);
    }
    (std::make_index_sequence<inner>());
    auto& H = std::get<inner + 2>(refs);
    H.setZero();
    H.template topLeftCorner<n, n>() = of_residual;
  }
};

}  // namespace tandem

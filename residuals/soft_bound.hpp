#pragma once

#include <tandem/residuals/bounds.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Soft bound: the amount by which each row of a residual exceeds its bounds, zero inside them [units of the residual].
///   problem.minimize(SoftBound{TwistComponents<SE3, surge>{dt}, between(0.0, 2.5)}, Gaussian{0.05}, {x0, x1});
template <class R>
struct SoftBound {
  static constexpr std::string_view name = R::name;
  static constexpr int dim = R::dim;
  using States = typename R::States;

  R residual;
  Bounds<dim> bounds;

  SoftBound() = default;
  SoftBound(const R& f, const Bounds<dim>& b) : residual(f), bounds(b) {}

  auto fields() { return std::tie(residual, bounds); }

  /// Takes the arguments of the residual: states, r, and either no Jacobian pointers or one for each state (possibly
  /// null).
  template <class... Args>
  requires(sizeof...(Args) == std::tuple_size_v<States> + 1 ||
           sizeof...(Args) == 2 * std::tuple_size_v<States> + 1) void
  operator()(Args&&... args) const {
    constexpr std::size_t states = std::tuple_size_v<States>;
    residual(args...);
    auto refs = std::tie(args...);
    auto& r = std::get<states>(refs);
    for (int i = 0; i < dim; ++i) {
      const bool below = r[i]<bounds.lower[i], above = r[i]> bounds.upper[i];
      if (below) {
        r[i] -= bounds.lower[i];
      } else if (above) {
        r[i] -= bounds.upper[i];
      } else {
        r[i] *= 0.;
        clear_row<states + 1>(refs, i);
      }
    }
  }

 private:
  template <std::size_t First, class Refs>
  static void clear_row(Refs& refs, int row) {
    [&]<std::size_t... I>(std::index_sequence<I...>) {
      ((std::get<First + I>(refs) ? (void)std::get<First + I>(refs)->row(row).setZero() : (void)0), ...);
    }
    (std::make_index_sequence<std::tuple_size_v<Refs> - First>{});
  }
};
template <class R>
SoftBound(const R&, UniformBounds) -> SoftBound<R>;
template <class R, int N>
SoftBound(const R&, Bounds<N>) -> SoftBound<R>;

template <class R>
inline constexpr bool is_soft_bound = false;
template <class R>
inline constexpr bool is_soft_bound<SoftBound<R>> = true;

}  // namespace tandem

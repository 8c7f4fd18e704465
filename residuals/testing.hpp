#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include "tandem/lie/error.hpp"
#include "tandem/residuals/residual.hpp"

/// For whoever writes a residual: are its Jacobians right? Any test framework will do, e.g.
///
///   const JacobianReport report = check_jacobians_at_random(MyResidual{measurement}, 1, 100);
///   EXPECT_LT(report.relative, 1e-8) << report.text;
///
/// They are compared with differences along X Exp(±h e_k), Richardson-extrapolated and with h chosen entry by
/// entry: good to some 1e-11 where the residual is smooth, 1e-15/g where it jumps (rotations at π) at a
/// distance g. Also checked: every row and entry is set, and neither r nor a Jacobian depends on which of the
/// other Jacobians were asked for.
namespace tandem {

/// The worst entry found by check_jacobians. A broken rule counts as an infinite error, which `text`
/// explains.
struct JacobianReport {
  double relative = 0.0;  ///< |given − differences| over the largest entry of all Jacobians at those states
  double absolute = 0.0;  ///< |given − differences|, in the residual's units by m or rad
  double resolution = 0.0;  ///< what the differences can tell of that entry, relative likewise
  int sample = 0;           ///< which of the random states, from 0
  int state = 0, row = 0, column = 0;
  std::string text = "no Jacobian entry differs";
};

/// How far random states are from one another, and the first from the identity.
enum class Spread {
  tiny,      ///< 1e-8 m, rad
  moderate,  ///< 0.5 m, rad
  large,     ///< 30 m, rotations of 1 to 3 rad
  near_pi    ///< 1 m, rotations of π − 1e-1 to π − 1e-3
};

namespace detail {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// f(0), f(1), … f(n − 1), each a constant of its own type.
template <std::size_t n, class F>
void each(const F& f) {
  [&]<std::size_t... i>(std::index_sequence<i...>) { (f(std::integral_constant<std::size_t, i>{}), ...); }
  (std::make_index_sequence<n>{});
}

/// Whether direction k of the tangent winds around: a rotation.
template <LieGroup G>
bool is_rotation(int k) {
  return std::abs(G::Exp(10.0 * G::Tangent::Unit(k)).Log()[k] - 10.0) > 1.0;
}

template <LieGroup G>
typename G::Tangent random_tangent(std::mt19937_64& random, Spread spread) {
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  typename G::Tangent v;
  for (double& entry : v) entry = std::normal_distribution<double>()(random);
  if (spread == Spread::tiny) return 1e-8 * v;
  if (spread == Spread::moderate) return 0.5 * v;
  double norm2 = 0.0;
  for (int k = 0; k < G::dof; ++k) norm2 += is_rotation<G>(k) ? v[k] * v[k] : 0.0;
  const bool large = spread == Spread::large;
  const double angle = large ? uniform(1.0, 3.0) : std::numbers::pi - std::pow(10.0, uniform(-3.0, -1.0));
  for (int k = 0; k < G::dof; ++k)
    v[k] *= is_rotation<G>(k) ? angle / std::sqrt(norm2) : (large ? 30.0 : 1.0);
  return v;
}

/// df/dh at 0 with its uncertainty, row by row: Neville's table of central differences over halved steps, of
/// which the entry of order 10 that agrees best with its neighbours is kept (Ridders 1982). Steps that cross
/// a jump disagree; steps so short that only rounding is left may agree by chance, so what is lost to it
/// counts.
template <int N, class F>
std::pair<Vector<N>, Vector<N>> differentiate(const F& f, double scale) {
  constexpr int columns = 5, steps = 22;
  Vector<N> value = Vector<N>::Constant(kNaN);
  Vector<N> uncertainty = Vector<N>::Constant(std::numeric_limits<double>::infinity());
  std::array<Vector<N>, columns> now, before;
  double h = 0.125;
  for (int step = 0; step < steps; ++step, h *= 0.5, before = now) {
    const Vector<N> ahead = f(h), behind = f(-h);
    now[0] = (ahead - behind) / (2.0 * h);
    for (int m = 1; m < columns; ++m)
      now[m] = step < m ? now[m - 1]
                        : Vector<N>(now[m - 1] + (now[m - 1] - before[m - 1]) / (std::pow(4.0, m) - 1.0));
    if (step < columns) continue;
    const Vector<N>& best = now[columns - 1];
    const double rounding = 1e-15 * std::max(scale, ahead.cwiseAbs().maxCoeff());
    for (int i = 0; i < N; ++i) {
      const double e = rounding / h + std::max(std::abs(best[i] - now[columns - 2][i]),
                                               std::abs(best[i] - before[columns - 2][i]));
      if (e < uncertainty[i]) value[i] = best[i], uncertainty[i] = e;
    }
  }
  return {value, uncertainty};
}

template <class A, class B>
bool same(const A& a, const B& b) {
  return (a - b).cwiseAbs().maxCoeff() <= 1e-12 * (1.0 + b.cwiseAbs().maxCoeff());  // false for NaN
}

}  // namespace detail

/// Random states for a residual that reads `States`; a state of the same group as the one before it lies
/// `spread` away.
template <class States>
States random_states(std::mt19937_64& random, Spread spread) {
  States states;
  detail::each<std::tuple_size_v<States>>([&](auto i) {
    using X = std::tuple_element_t<i, States>;
    std::get<i>(states) = X::Exp(detail::random_tangent<X>(random, spread));
    if constexpr (i > 0)
      if constexpr (std::is_same_v<X, std::tuple_element_t<i - 1, States>>)
        std::get<i>(states) = std::get<i - 1>(states) * std::get<i>(states);
  });
  return states;
}

/// Checks the Jacobians of `residual` at these states; throws what the residual throws there.
template <Residual R, class... Xs>
requires(std::is_same_v<std::tuple<Xs...>, typename R::States>) JacobianReport
    check_jacobians(const R& residual, const Xs&... states) {
  constexpr int N = R::dim;
  using Jacobians = std::tuple<RowsBy<N, Xs>...>;
  const auto evaluate = [&](unsigned wanted, Jacobians& J) {
    Vector<N> r = Vector<N>::Constant(detail::kNaN);
    std::apply([](auto&... M) { (M.setConstant(detail::kNaN), ...); }, J);
    [&]<std::size_t... i>(std::index_sequence<i...>) {
      residual(states..., r, (wanted >> i & 1u ? &std::get<i>(J) : nullptr)...);
    }
    (std::index_sequence_for<Xs...>{});
    return r;
  };

  JacobianReport report;
  constexpr unsigned all = (1u << sizeof...(Xs)) - 1u;
  Jacobians J, some;
  const Vector<N> r = evaluate(all, J);
  for (unsigned wanted = 0; wanted <= all; ++wanted) {
    const bool same_value = detail::same(evaluate(wanted, some), r);
    bool same_jacobians = true;
    detail::each<sizeof...(Xs)>([&](auto i) {
      if (wanted >> i & 1u)
        same_jacobians = same_jacobians && detail::same(std::get<i>(some), std::get<i>(J));
    });
    if (same_value && same_jacobians) continue;
    report.relative = report.absolute = std::numeric_limits<double>::infinity();
    report.text = std::string(R::name) + (same_value ? ": a Jacobian" : ": the value") +
                  " is not finite everywhere, or depends on which (other) Jacobians are asked for";
    return report;
  }

  double scale = 0.0;
  std::apply([&](const auto&... M) { scale = std::max({M.cwiseAbs().maxCoeff()...}); }, J);
  detail::each<sizeof...(Xs)>([&](auto state) {
    using X = std::tuple_element_t<state, typename R::States>;
    for (int k = 0; k < X::dof; ++k) {
      const auto [slope, uncertainty] = detail::differentiate<N>(
          [&](double h) {
            typename R::States moved(states...);
            std::get<state>(moved) = std::get<state>(moved) * X::Exp(h * X::Tangent::Unit(k));
            Vector<N> at;
            try {
              std::apply([&](const Xs&... x) { residual(x..., at, static_cast<RowsBy<N, Xs>*>(nullptr)...); },
                         moved);
            } catch (const Error&) {  // undefined this far away
              at.setConstant(detail::kNaN);
            }
            return at;
          },
          scale);
      for (int i = 0; i < N; ++i) {
        const double given = std::get<state>(J)(i, k), reference = std::max(scale, std::abs(slope[i]));
        double error = std::abs(given - slope[i]);
        if (std::isnan(error)) error = std::numeric_limits<double>::infinity();
        if (error <= report.relative * reference) continue;
        report = {error / reference, error, uncertainty[i] / reference, 0, int(state), i, k, {}};
        std::ostringstream text;
        text << R::name << ": state " << state << ", row " << i << ", column " << k << ": Jacobian " << given
             << ", differences " << slope[i] << " (to " << uncertainty[i] << "), relative error "
             << report.relative;
        report.text = text.str();
      }
    }
  });
  return report;
}

/// Checks them at `count` random states, of each Spread in turn; the same seed gives the same states. States
/// at which the residual throws Error are drawn again.
template <Residual R>
JacobianReport check_jacobians_at_random(const R& residual, unsigned seed, int count) {
  std::mt19937_64 random(seed);
  JacobianReport worst;
  int refused = 0;
  for (int sample = 0; sample < count;) {
    const auto states = random_states<typename R::States>(random, Spread(sample % 4));
    try {
      JacobianReport report =
          std::apply([&](const auto&... x) { return check_jacobians(residual, x...); }, states);
      report.sample = sample++;
      if (report.relative > worst.relative) worst = report;
    } catch (const Error&) {
      if (++refused > 100 + 10 * count) throw;
    }
  }
  return worst;
}

}  // namespace tandem

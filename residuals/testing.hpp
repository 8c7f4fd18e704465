#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/residuals/residual.hpp>

/// For whoever writes a residual: are its Jacobians right? Within any test framework, e.g.
///
///   const JacobianReport report = check_jacobians_at_random(MyResidual{measurement}, 1, 100);
///   EXPECT_LT(report.relative, 1e-8) << report.text;
///
/// They are compared with extrapolated differences along X Exp(±h e_k), h chosen column by column: good to
/// some 1e-11 where the residual is smooth, to 1e-14 over the distance [rad] where it jumps, as at rotations
/// by π. Checked as well: all entries are set, whichever Jacobians are asked for, and are the same.
namespace tandem {

/// The worst entry found; a broken rule counts as an infinite error. `text` says it in a line.
struct JacobianReport {
  double relative = 0.0;    ///< |given − differences| over the largest entry of all Jacobians at those states
  double absolute = 0.0;    ///< |given − differences|, in the residual's units by m or rad
  double resolution = 0.0;  ///< uncertainty of the differences there, relative likewise
  int sample = 0;           ///< which of the random states, from 0
  int state = 0, row = 0, column = 0;
  std::string text = "no entry differs";
};

/// How far random states are from one another, and the first from the identity: 1e-8; 0.5; 30 m and rotations
/// of 1 to 3 rad; 1 m and rotations of π − 1e-1 to π − 1e-3.
enum class Spread { tiny, moderate, large, near_pi };

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
  typename G::Tangent v;
  for (double& entry : v) entry = std::normal_distribution<double>()(random);
  if (spread == Spread::tiny) return 1e-8 * v;
  if (spread == Spread::moderate) return 0.5 * v;
  const bool large = spread == Spread::large;
  const double u = std::uniform_real_distribution<double>(1.0, 3.0)(random);
  const double angle = large ? u : std::numbers::pi - std::pow(10.0, -u);
  double norm2 = 0.0;
  for (int k = 0; k < G::dof; ++k) norm2 += is_rotation<G>(k) ? v[k] * v[k] : 0.0;
  for (int k = 0; k < G::dof; ++k) v[k] *= is_rotation<G>(k) ? angle / std::sqrt(norm2) : large ? 30.0 : 1.0;
  return v;
}

/// df/dh at 0 and its uncertainty: of Neville's table of central differences over halved steps, the entry
/// that agrees best with its neighbours in all rows (Ridders 1982). Steps that cross a jump disagree; very
/// short ones may agree by chance, so rounding counts too: some tens of units in the last place of `scale`
/// over the step.
std::pair<Eigen::VectorXd, double> differentiate(int rows, const std::function<void(double h, double* f)>& f,
                                                 double scale);

/// A residual at some states, whatever its types are: what is checked of it is compiled once.
struct ResidualAt {
  std::string_view name;
  int rows;
  std::vector<int> dofs;  ///< of its states
  /// r, and, of the states of these bits, the Jacobians, one after the other by columns; what is not set is NaN.
  std::function<void(unsigned wanted, double* r, double* J)> evaluate;
  /// r with one of the states moved by h along direction k; NaN where it is undefined.
  std::function<void(int state, int k, double h, double* r)> along;
};
JacobianReport check_jacobians(const ResidualAt& residual);

}  // namespace detail

/// Random states for a residual to read; one lies `spread` from the one before if they are of the same group.
template <class States>
States random_states(std::mt19937_64& random, Spread spread) {
  States states;
  detail::each<std::tuple_size_v<States>>([&](auto i) {
    using X = std::tuple_element_t<i, States>;
    constexpr std::size_t before = i == 0 ? 0 : i - 1;
    X& x = std::get<i>(states) = X::Exp(detail::random_tangent<X>(random, spread));
    if constexpr (std::is_same_v<X, std::tuple_element_t<before, States>>)
      if (i > 0) x = std::get<before>(states) * x;
  });
  return states;
}

/// Checks the Jacobians of `residual` at these states; throws what the residual throws there.
template <Residual R, class... Xs>
JacobianReport check_jacobians(const R& residual, const Xs&... states) {
  static_assert(std::is_same_v<std::tuple<Xs...>, typename R::States>, "these are not the states it reads");
  constexpr int N = R::dim, count = sizeof...(Xs);
  const auto evaluate = [&](unsigned wanted, double* r, double* J) {
    Vector<N> value = Vector<N>::Constant(detail::kNaN);
    std::tuple<RowsBy<N, Xs>...> jacobians;
    std::apply([](auto&... Ji) { (Ji.setConstant(detail::kNaN), ...); }, jacobians);
    [&]<std::size_t... i>(std::index_sequence<i...>) {
      residual(states..., value, (wanted >> i & 1u ? &std::get<i>(jacobians) : nullptr)...);
    }
    (std::index_sequence_for<Xs...>{});
    std::copy_n(value.data(), N, r);
    std::apply([&](const auto&... Ji) { ((J = std::copy_n(Ji.data(), Ji.size(), J)), ...); }, jacobians);
  };
  const auto along = [&](int state, int k, double h, double* r) {
    std::tuple<Xs...> moved(states...);
    detail::each<count>([&](auto i) {
      using X = std::tuple_element_t<i, std::tuple<Xs...>>;
      if (int(i) == state) std::get<i>(moved) = std::get<i>(moved) * X::Exp(h * X::Tangent::Unit(k));
    });
    Vector<N> value = Vector<N>::Constant(detail::kNaN);
    try {
      std::apply([&](const auto&... x) { residual(x..., value, static_cast<RowsBy<N, Xs>*>(nullptr)...); }, moved);
    } catch (const Error&) {  // undefined so far away: shorter steps will do
    }
    std::copy_n(value.data(), N, r);
  };
  return detail::check_jacobians({R::name, N, {Xs::dof...}, evaluate, along});
}

/// Checks them at `count` random states, of each Spread in turn; states at which the residual throws are
/// drawn again.
template <Residual R>
JacobianReport check_jacobians_at_random(const R& residual, unsigned seed, int count) {
  std::mt19937_64 random(seed);
  JacobianReport worst;
  for (int sample = 0, refused = 0; sample < count;) {
    const auto states = random_states<typename R::States>(random, Spread(sample % 4));
    try {
      auto report = std::apply([&](const auto&... x) { return check_jacobians(residual, x...); }, states);
      report.sample = sample++;
      if (report.relative > worst.relative) worst = report;
    } catch (const Error&) {
      if (++refused > 100 + 10 * count) throw;
    }
  }
  return worst;
}

}  // namespace tandem

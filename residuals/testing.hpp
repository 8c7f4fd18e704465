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

/// Checks the Jacobians of a user-defined residual, within any test framework:
///
///   const JacobianReport report = check_jacobians_at_random(MyResidual{measurement}, 1, 100);
///   EXPECT_LT(report.relative, 1e-8) << report.text;
///
/// The Jacobians are compared with extrapolated differences along X Exp(±h e_k), with h chosen for each column. The
/// differences are accurate to about 1e-11 where the residual is smooth, and to 1e-14 divided by the distance [rad] to
/// a discontinuity, such as rotations by π. The checks also require that the residual sets all entries, and that the
/// values do not depend on which Jacobians are requested.
namespace tandem {

/// Worst Jacobian entry. An entry that is not set or depends on the requested Jacobians counts as an infinite error.
/// `text` describes the entry.
struct JacobianReport {
  double relative = 0.0;    ///< |given − differences| / largest entry of all Jacobians at those states.
  double absolute = 0.0;    ///< |given − differences|, in units of the residual per m or rad.
  double resolution = 0.0;  ///< Uncertainty of the differences, relative to the same entry.
  int sample = 0;           ///< Index of the random sample.
  int state = 0, row = 0, column = 0;
  std::string text = "all entries agree";
};

/// Distance between consecutive random states, and of the first one from the identity:
///   tiny      1e-8
///   moderate  0.5
///   large     30 m and rotations of 1 to 3 rad
///   near_pi   1 m and rotations of π − 1e-1 to π − 1e-3
enum class StateDistance { tiny, moderate, large, near_pi };

namespace detail {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
/// Calls f(0), f(1), … f(n − 1), each with a std::integral_constant.
template <std::size_t n, class F>
void each(const F& f) {
  [&]<std::size_t... i>(std::index_sequence<i...>) { (f(std::integral_constant<std::size_t, i>{}), ...); }
  (std::make_index_sequence<n>{});
}

/// Returns true if direction k of the tangent is a rotation.
template <LieGroup G>
bool is_rotation(int k) {
  return std::abs(G::Exp(10.0 * G::Tangent::Unit(k)).Log()[k] - 10.0) > 1.0;
}

template <LieGroup G>
typename G::Tangent random_tangent(std::mt19937_64& random, StateDistance distance) {
  typename G::Tangent v;
  for (double& entry : v) entry = std::normal_distribution<double>()(random);
  if (distance == StateDistance::tiny) return 1e-8 * v;
  if (distance == StateDistance::moderate) return 0.5 * v;
  const bool large = distance == StateDistance::large;
  const double u = std::uniform_real_distribution<double>(1.0, 3.0)(random);
  const double angle = large ? u : std::numbers::pi - std::pow(10.0, -u);
  double norm2 = 0.0;
  for (int k = 0; k < G::dof; ++k) norm2 += is_rotation<G>(k) ? v[k] * v[k] : 0.0;
  for (int k = 0; k < G::dof; ++k) v[k] *= is_rotation<G>(k) ? angle / std::sqrt(norm2) : large ? 30.0 : 1.0;
  return v;
}

/// Returns df/dh at 0 and its uncertainty. Builds Neville's table of central differences over halved steps and selects
/// the entry that agrees best with its neighbours in all rows (Ridders 1982). Steps across a discontinuity disagree.
/// Very short steps may agree by chance, so the uncertainty includes rounding: some tens of units in the last place of
/// `scale`, divided by the step.
std::pair<Eigen::VectorXd, double> differentiate(int rows, const std::function<void(double h, double* f)>& f,
                                                 double scale);

/// Type-erased residual at given states, so that the checks are compiled only once.
struct ResidualAt {
  std::string_view name;
  int rows;
  std::vector<int> dofs;  ///< tangent dimensions of the states
  /// Computes r and the Jacobians of the states whose bits are set in `wanted`. J holds the Jacobians of all states one
  /// after the other, by columns; entries that are not set are NaN.
  std::function<void(unsigned wanted, double* r, double* J)> evaluate;
  /// Computes r with one state moved by h along direction k; NaN where the residual is undefined.
  std::function<void(int state, int k, double h, double* r)> along;
};
JacobianReport check_jacobians(const ResidualAt& residual);

}  // namespace detail

/// Returns random states for a residual. Consecutive states of the same group lie at `distance` from each other.
template <class States>
States random_states(std::mt19937_64& random, StateDistance distance) {
  States states;
  detail::each<std::tuple_size_v<States>>([&](auto i) {
    using X = std::tuple_element_t<i, States>;
    constexpr std::size_t before = i == 0 ? 0 : i - 1;
    X& x = std::get<i>(states) = X::Exp(detail::random_tangent<X>(random, distance));
    if constexpr (std::is_same_v<X, std::tuple_element_t<before, States>>)
      if (i > 0) x = std::get<before>(states) * x;
  });
  return states;
}

/// Checks the Jacobians of `residual` at these states. Throws if the residual throws there.
template <Residual R, class... Xs>
JacobianReport check_jacobians(const R& residual, const Xs&... states) {
  static_assert(std::is_same_v<std::tuple<Xs...>, typename R::States>, "the states do not match R::States");
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
    } catch (const Error&) {  // undefined at this step: the value remains NaN, shorter steps are used
    }
    std::copy_n(value.data(), N, r);
  };
  return detail::check_jacobians({R::name, N, {Xs::dof...}, evaluate, along});
}

/// Checks the Jacobians at `count` random samples, with each StateDistance in turn. Draws again if the residual throws.
template <Residual R>
JacobianReport check_jacobians_at_random(const R& residual, unsigned seed, int count) {
  std::mt19937_64 random(seed);
  JacobianReport worst;
  for (int sample = 0, rejected = 0; sample < count;) {
    const auto states = random_states<typename R::States>(random, StateDistance(sample % 4));
    try {
      auto report = std::apply([&](const auto&... x) { return check_jacobians(residual, x...); }, states);
      report.sample = sample++;
      if (report.relative > worst.relative) worst = report;
    } catch (const Error&) {
      if (++rejected > 100 + 10 * count) throw;
    }
  }
  return worst;
}

}  // namespace tandem

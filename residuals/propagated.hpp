#pragma once

#include <type_traits>
#include <utility>

#include <tandem/residuals/imu_prediction.hpp>

namespace tandem {

namespace detail {

/// True if the second state of R is the velocity of its first state: R::reads_velocity.
template <class R>
constexpr bool reads_velocity() {
  if constexpr (requires { R::reads_velocity; })
    return R::reads_velocity;
  else
    return false;
}

/// States of Propagated<R>. `Extras` are the states of R after pose and velocity.
template <bool velocity, class States>
struct PropagatedStates;
template <class... Extras>
struct PropagatedStates<false, std::tuple<SE3, Extras...>> {
  using type = std::tuple<SE3, R3, Rn<6>, Extras...>;
};
template <class... Extras>
struct PropagatedStates<true, std::tuple<SE3, R3, Extras...>> {
  using type = std::tuple<SE3, R3, Rn<6>, Extras...>;
};

}  // namespace detail

/// A residual R at an instant after a keyframe. Inertial measurements predict the state from the keyframe k, and R is
/// evaluated at
///
///   (X, v) = predict(X_k, v_k, b_k, delta, earth)
///
/// The noise of the prediction is neglected, so delta.dt should not exceed a keyframe interval. States: pose, world
/// velocity and biases [accelerometer; gyroscope] at the keyframe, then the states of R after its pose (and after its
/// velocity if R::reads_velocity).
template <Residual R>
struct Propagated {
  static constexpr std::string_view name = R::name;
  static constexpr int dim = R::dim;
  using States = typename detail::PropagatedStates<detail::reads_velocity<R>(), typename R::States>::type;
  static constexpr std::size_t extras = std::tuple_size_v<States> - 3;

  R residual;
  ImuDelta delta;
  Earth earth{};

  auto fields() { return std::tie(residual, delta, earth); }

  /// `rest`: the remaining states, r, and the Jacobians of either all states or none.
  template <Over<SE3> X, Over<R3> V, Over<Rn<6>> B, class... Rest>
  requires(sizeof...(Rest) == extras + 1 || sizeof...(Rest) == 2 * extras + 4) void operator()(const X& x, const V& v,
                                                                                               const B& b,
                                                                                               Rest&&... rest) const {
    evaluate(x, v, b, std::tie(rest...), std::make_index_sequence<extras>());
  }

 private:
  template <class X, class V, class B, class Rest, std::size_t... I>
  void evaluate(const X& x, const V& v, const B& b, const Rest& rest, std::index_sequence<I...>) const {
    using S = typename X::Scalar;
    constexpr bool velocity = detail::reads_velocity<R>();
    auto& r = std::get<extras>(rest);
    if constexpr (std::tuple_size_v<Rest> == extras + 1) {
      const ImuPrediction<S> at = predict(x, v, b, delta, earth);
      if constexpr (velocity)
        residual(at.pose, at.velocity, std::get<I>(rest)..., r);
      else
        residual(at.pose, std::get<I>(rest)..., r);
    } else {
      RowsBy<dim, X>* const Jx = std::get<extras + 1>(rest);
      RowsBy<dim, V>* const Jv = std::get<extras + 2>(rest);
      RowsBy<dim, B>* const Jb = std::get<extras + 3>(rest);
      const bool wanted = Jx || Jv || Jb;
      ImuPredictionJacobians<S> by;
      RowsBy<dim, X> by_pose;
      const ImuPrediction<S> at = predict(x, v, b, delta, earth, wanted ? &by : nullptr);
      RowsBy<dim, X>* const J_pose = wanted ? &by_pose : nullptr;
      if constexpr (velocity) {
        RowsBy<dim, V> by_velocity;
        residual(at.pose, at.velocity, std::get<I>(rest)..., r, J_pose, wanted ? &by_velocity : nullptr,
                 std::get<extras + 4 + I>(rest)...);
        if (Jx) *Jx = by_pose * by.pose_by_pose + by_velocity * by.velocity_by_pose;
        if (Jv) *Jv = by_pose * by.pose_by_velocity + by_velocity * by.velocity_by_velocity;
        if (Jb) *Jb = by_pose * by.pose_by_bias + by_velocity * by.velocity_by_bias;
      } else {
        residual(at.pose, std::get<I>(rest)..., r, J_pose, std::get<extras + 4 + I>(rest)...);
        if (Jx) Jx->noalias() = by_pose * by.pose_by_pose;
        if (Jv) Jv->noalias() = by_pose * by.pose_by_velocity;
        if (Jb) Jb->noalias() = by_pose * by.pose_by_bias;
      }
    }
  }
};
template <class R>
Propagated(const R&, const ImuDelta&) -> Propagated<R>;
template <class R>
Propagated(const R&, const ImuDelta&, const Earth&) -> Propagated<R>;

}  // namespace tandem

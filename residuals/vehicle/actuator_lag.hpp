#pragma once

#include <cmath>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Actuators that follow a constant command with a first-order lag, discretised exactly [units of the actuators]:
///
///   e = a1 − (f a0 + (1 − f) u),   f = exp(−dt/lag)
///
/// States: a0, u, a1.
template <int N>
struct ActuatorLag {
  static constexpr std::string_view name = "actuator lag";
  static constexpr int dim = N;
  static constexpr bool linear = true;
  using Actuators = Rn<N>;
  using States = std::tuple<Actuators, Actuators, Actuators>;

  Vector<N> decay = Vector<N>::Zero();  ///< f

  ActuatorLag() = default;
  /// `lag` and `dt` are in s. Actuators with a lag of 0 follow at once.
  ActuatorLag(const Vector<N>& lag, double dt) {
    for (int i = 0; i < N; ++i) decay[i] = lag[i] > 0 ? std::exp(-dt / lag[i]) : 0.0;
  }

  auto fields() { return std::tie(decay); }

  template <Over<Actuators> A>
  void operator()(const A& a0, const A& u, const A& a1, Rows<N, A>& r, RowsBy<N, A>* J0 = nullptr,
                  RowsBy<N, A>* Ju = nullptr, RowsBy<N, A>* J1 = nullptr) const {
    using S = typename A::Scalar;
    const Vector<N, S> f = decay.template cast<S>(), rest = Vector<N, S>::Ones() - f;
    r = a1.vector() - f.cwiseProduct(a0.vector()) - rest.cwiseProduct(u.vector());
    if (J0) *J0 = -f.asDiagonal().toDenseMatrix();
    if (Ju) *Ju = -rest.asDiagonal().toDenseMatrix();
    if (J1) J1->setIdentity();
  }
};

}  // namespace tandem

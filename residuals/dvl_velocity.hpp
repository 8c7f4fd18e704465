#pragma once

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Velocity over ground along the body axes, measured by a Doppler velocity log [m/s]:  e = Rᵀ v − z. States: pose and
/// world velocity. Source: Groves 2013, §6.5 (Doppler sonar).
struct DvlVelocity {
  static constexpr std::string_view name = "DVL velocity";
  static constexpr int dim = 3;
  static constexpr bool reads_velocity = true;  ///< the second state is the velocity of the first
  using States = std::tuple<SE3, R3>;

  Vector<3> measured;  ///< m/s, along the body's axes

  auto fields() { return std::tie(measured); }

  const Vector<3>& reading() const { return measured; }

  template <Over<SE3> X, Over<R3> V>
  void operator()(const X& x, const V& v, Rows<3, X>& r, RowsBy<3, X>* Jx = nullptr, RowsBy<3, V>* Jv = nullptr) const {
    using S = typename X::Scalar;
    const Matrix<3, 3, S> to_body = x.rotation().inverse().matrix();
    const Vector<3, S> in_body = to_body * v.vector();
    r = in_body - measured.template cast<S>();
    if (Jx) *Jx << Matrix<3, 3, S>::Zero(), skew(in_body);
    if (Jv) *Jv = to_body;
  }
};

/// DvlVelocity with a scale factor error s (wrong speed of sound or beam angle) as third state [m/s]:  e = (1 + s) Rᵀ v
/// − z.
struct ScaledDvlVelocity {
  static constexpr std::string_view name = "scaled DVL velocity";
  static constexpr int dim = 3;
  static constexpr bool reads_velocity = true;
  using States = std::tuple<SE3, R3, Rn<1>>;

  Vector<3> measured;  ///< m/s, along the body's axes

  auto fields() { return std::tie(measured); }

  template <Over<SE3> X, Over<R3> V, Over<Rn<1>> F>
  void operator()(const X& x, const V& v, const F& s, Rows<3, X>& r, RowsBy<3, X>* Jx = nullptr,
                  RowsBy<3, V>* Jv = nullptr, RowsBy<3, F>* Js = nullptr) const {
    using S = typename X::Scalar;
    const Matrix<3, 3, S> to_body = x.rotation().inverse().matrix();
    const Vector<3, S> in_body = to_body * v.vector();
    const S scale = S(1.) + s.vector()[0];
    r = scale * in_body - measured.template cast<S>();
    if (Jx) *Jx << Matrix<3, 3, S>::Zero(), scale * skew(in_body);
    if (Jv) *Jv = scale * to_body;
    if (Js) *Js = in_body;
  }
};

}  // namespace tandem

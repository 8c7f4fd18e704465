#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/so3.hpp>
#include <tandem/residuals/residual.hpp>

/// Motion of a quadrotor over one forward Euler step, as hard equalities of a plan. States: attitude R (body in the
/// world, z up), body rate ω [rad/s], position and velocity in the world [m, m/s], rotor thrusts f [N].
namespace tandem {

/// Quadrotor in plus configuration: rotor 0 is ahead, 1 to the left, 2 behind, 3 to the right. Rotors 0 and 2 turn
/// against 1 and 3.
struct Quadrotor {
  double mass;            ///< kg
  Vector<3> inertia;      ///< principal moments [kg m²]
  double arm;             ///< distance from the centre to a rotor [m]
  double yaw_torque;      ///< yaw torque per thrust [N m/N]
  double gravity = 9.81;  ///< m/s²

  auto fields() { return std::tie(mass, inertia, arm, yaw_torque, gravity); }

  /// Returns the matrix from thrusts to torque about the body axes [m].
  Matrix<3, 4> torque() const {
    Matrix<3, 4> B;
    B << 0.0, arm, 0.0, -arm, -arm, 0.0, arm, 0.0, yaw_torque, -yaw_torque, yaw_torque, -yaw_torque;
    return B;
  }
  double hover() const { return mass * gravity / 4.0; }  ///< thrust of each rotor [N]
};

/// Kinematics by the rate at the start of the step:  e = Log((X0 Exp(dt ξ0))⁻¹ X1).   States: X0, ξ0, X1.
template <LieGroup G>
struct EulerKinematics {
  static constexpr std::string_view name = "Euler kinematics";
  static constexpr int dim = G::dof;
  using Rate = Rn<G::dof>;
  using States = std::tuple<G, Rate, G>;

  double dt;  ///< s, > 0

  auto fields() { return std::tie(dt); }

  template <Over<G> X, Over<Rate> W>
  void operator()(const X& x0, const W& w0, const X& x1, Rows<dim, X>& r, RowsBy<dim, X>* J0 = nullptr,
                  RowsBy<dim, W>* Jw = nullptr, RowsBy<dim, X>* J1 = nullptr) const {
    using S = typename X::Scalar;
    const typename X::Tangent d = S(dt) * w0.vector();
    const X back = X::Exp(-d);
    r = (back * x0.inverse() * x1).Log();
    if (!J0 && !Jw && !J1) return;
    const InverseJacobians<X> at_r(r);
    if (J0) *J0 = -multiply<X>(at_r.left, back.Ad());
    if (Jw) *Jw = -S(dt) * multiply<X>(at_r.left, X::Jr(d));
    if (J1) *J1 = at_r.right;
  }
};

/// Euler's equation:  e = ω1 − ω0 − dt J⁻¹ (τ f − ω0 × J ω0) [rad/s].   States: ω0, f, ω1.
struct QuadrotorRate {
  static constexpr std::string_view name = "quadrotor rate";
  static constexpr int dim = 3;
  using States = std::tuple<R3, Rn<4>, R3>;

  Quadrotor model;
  double dt;  ///< s, > 0

  auto fields() { return std::tie(model, dt); }

  template <Over<R3> W, Over<Rn<4>> F>
  void operator()(const W& w0, const F& f, const W& w1, Rows<3, W>& r, RowsBy<3, W>* J0 = nullptr,
                  RowsBy<3, F>* Jf = nullptr, RowsBy<3, W>* J1 = nullptr) const {
    using S = typename W::Scalar;
    const Vector<3, S> inertia = model.inertia.template cast<S>(), w = w0.vector();
    const Vector<3, S> by_inertia = S(dt) * inertia.cwiseInverse();
    const Matrix<3, 4, S> torque = model.torque().template cast<S>();
    const Vector<3, S> momentum = inertia.cwiseProduct(w);
    r = w1.vector() - w - by_inertia.cwiseProduct(torque * f.vector() - w.cross(momentum));
    if (J0) {
      *J0 = by_inertia.asDiagonal() * (skew(w) * inertia.asDiagonal().toDenseMatrix() - skew(momentum));
      *J0 -= Matrix<3, 3, S>::Identity();
    }
    if (Jf) *Jf = -(by_inertia.asDiagonal() * torque);
    if (J1) J1->setIdentity();
  }
};

/// Newton's equation:  e = v1 − v0 − dt (R0 e_z Σf/m − g e_z) [m/s].   States: v0, R0, f, v1.
struct QuadrotorVelocity {
  static constexpr std::string_view name = "quadrotor velocity";
  static constexpr int dim = 3;
  using States = std::tuple<R3, SO3, Rn<4>, R3>;

  Quadrotor model;
  double dt;  ///< s, > 0

  auto fields() { return std::tie(model, dt); }

  template <Over<R3> V, Over<SO3> Q, Over<Rn<4>> F>
  void operator()(const V& v0, const Q& R0, const F& f, const V& v1, Rows<3, V>& r, RowsBy<3, V>* J0 = nullptr,
                  RowsBy<3, Q>* JR = nullptr, RowsBy<3, F>* Jf = nullptr, RowsBy<3, V>* J1 = nullptr) const {
    using S = typename V::Scalar;
    const S thrust = f.vector().sum() / S(model.mass);
    const Matrix<3, 3, S> R = R0.matrix();
    r = v1.vector() - v0.vector() - S(dt) * thrust * R.col(2);
    r[2] += S(dt * model.gravity);
    if (J0) *J0 = -Matrix<3, 3, S>::Identity();
    if (JR) *JR << S(dt) * thrust * R.col(1), -S(dt) * thrust * R.col(0), Vector<3, S>::Zero();
    if (Jf) *Jf = -S(dt / model.mass) * R.col(2) * Matrix<1, 4, S>::Ones();
    if (J1) J1->setIdentity();
  }
};

}  // namespace tandem

#pragma once

#include <array>
#include <cmath>
#include <tuple>

#include <Eigen/LU>

#include <tandem/lie/exp_curvature.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/residuals/residual.hpp>
#include <tandem/residuals/vehicle/vehicle_model.hpp>

namespace tandem {

/// Smoothing ε of |x| = √(x² + ε²) in damping terms, which are then differentiable at zero speed [m/s, rad/s].
inline constexpr double kSmoothSpeed = 1e-3;

/// Equations of motion of a vehicle (vehicle_model.hpp) over one step, discretised by the implicit midpoint rule [m/s,
/// rad/s]:
///
///   e = ξ1 − ξ0 + dt ([ω × w; 0] + M⁻¹ (C(ν) ν + D(ν) ν + g(R) − τ))
///
/// All terms refer to the midpoint. The twist over ground is ξ = (ξ0 + ξ1)/2 = [v; ω], and R = R0 Exp(dt ω/2). The
/// current along the body axes is w = Rᵀ c, so the twist through the water is ν = [v − w; ω]. For a constant command
/// the mean actuator state is ā = β a0 + (1 − β) u with β = (lag/dt)(1 − exp(−dt/lag)). The water is treated as an
/// inertial frame: Coriolis terms and added mass depend on ν, and ν' = ξ' + [ω × w; 0]. States: pose X0, ξ0, ξ1, a0, u,
/// and the current c in the world [m/s]. The midpoint rule conserves the kinetic energy of a vehicle without damping or
/// forces for any dt.
template <int N>
struct VehicleDynamics {
  static constexpr std::string_view name = "vehicle dynamics";
  static constexpr int dim = 6;
  using Twist = Rn<6>;
  using Actuators = Rn<N>;
  using States = std::tuple<SE3, Twist, Twist, Actuators, Actuators, R3>;

  VehicleModel<N> vehicle;
  double dt = 1.0;                                       ///< s, > 0
  Matrix<6, 6> mass_inverse = Matrix<6, 6>::Identity();  ///< M⁻¹
  Vector<N> start_weight = Vector<N>::Zero();            ///< β, weight of a0 in the mean actuator state

  VehicleDynamics() = default;
  VehicleDynamics(const VehicleModel<N>& model, double step)
      : vehicle(model), dt(step), mass_inverse(vehicle.mass.inverse()) {
    for (int i = 0; i < N; ++i)
      start_weight[i] = vehicle.lag[i] > 0 ? -std::expm1(-dt / vehicle.lag[i]) * vehicle.lag[i] / dt : 0.0;
  }

  /// All numbers that the residual depends on. Limits and lags of the actuators are not among them.
  auto fields() {
    VehicleModel<N>& v = vehicle;
    return std::tie(v.mass, v.linear, v.quadratic, v.lift, v.weight, v.buoyancy, v.centre_of_mass, v.centre_of_buoyancy,
                    v.thrust, v.fin, dt, mass_inverse, start_weight);
  }

  template <Over<SE3> X, Over<Twist> W, Over<Actuators> A, Over<R3> V>
  void operator()(const X& x0, const W& w0, const W& w1, const A& a0, const A& u, const V& current, Rows<6, X>& r,
                  RowsBy<6, X>* Jx0 = nullptr, RowsBy<6, W>* Jw0 = nullptr, RowsBy<6, W>* Jw1 = nullptr,
                  RowsBy<6, A>* Ja0 = nullptr, RowsBy<6, A>* Ju = nullptr, RowsBy<6, V>* Jc = nullptr) const {
    using S = typename X::Scalar;
    using Rotation = BasicSO3<S>;
    using Vector3 = Vector<3, S>;
    using Vector6 = Vector<6, S>;
    using Square3 = Matrix<3, 3, S>;
    using Square6 = Matrix<6, 6, S>;
    using std::sqrt;
    const S step(dt), half(0.5 * dt);
    const Vector6 twist = S(0.5) * (w0.vector() + w1.vector());
    const Vector3 omega = twist.template tail<3>(), turn = half * omega;
    const Rotation middle = x0.rotation() * Rotation::Exp(turn);
    const Square3 to_body = middle.inverse().matrix();
    const Vector3 water = to_body * current.vector(), up = to_body.col(2);

    Vector6 nu = twist;
    nu.template head<3>() -= water;
    Vector6 speed;
    for (int i = 0; i < 6; ++i) speed[i] = sqrt(nu[i] * nu[i] + S(kSmoothSpeed * kSmoothSpeed));
    const Square6 M = vehicle.mass.template cast<S>(), lift = vehicle.lift.template cast<S>();
    const Square6 by_mass = step * mass_inverse.template cast<S>();
    const Vector6 momentum = M * nu, lifted = lift * nu;
    const Vector3 p1 = momentum.template head<3>(), p2 = momentum.template tail<3>(), v = nu.template head<3>();
    const Vector<N, S> beta = start_weight.template cast<S>();
    const Vector<N, S> actuators =
        beta.cwiseProduct(a0.vector()) + (Vector<N, S>::Ones() - beta).cwiseProduct(u.vector());
    const Matrix<6, N, S> fin = vehicle.fin.template cast<S>();
    const Matrix<6, N, S> push = vehicle.thrust.template cast<S>() + (nu[0] * speed[0]) * fin;
    const Vector3 lever =
        (vehicle.buoyancy * vehicle.centre_of_buoyancy - vehicle.weight * vehicle.centre_of_mass).template cast<S>();
    const S lightness(vehicle.buoyancy - vehicle.weight);

    Vector6 wrench = vehicle.linear.template cast<S>() * nu + speed[0] * lifted - push * actuators;
    wrench += vehicle.quadratic.template cast<S>() * nu.cwiseProduct(speed);
    wrench.template head<3>() += omega.cross(p1) - lightness * up;
    wrench.template tail<3>() += v.cross(p1) + omega.cross(p2) - lever.cross(up);
    r = w1.vector() - w0.vector() + by_mass * wrench;
    r.template head<3>() += step * omega.cross(water);
    if (!Jx0 && !Jw0 && !Jw1 && !Ja0 && !Ju && !Jc) return;

    const Matrix<6, N, S> by_actuators = -by_mass * push;
    if (Ja0) *Ja0 = by_actuators * beta.asDiagonal();
    if (Ju) *Ju = by_actuators * (Vector<N, S>::Ones() - beta).asDiagonal();
    if (!Jx0 && !Jw0 && !Jw1 && !Jc) return;

    // Derivatives with respect to ν: −ad(ν)ᵀ M, the derivative of its factor ad(ν), and damping.
    Square6 by_nu = vehicle.linear.template cast<S>() + speed[0] * lift;
    const Square3 omega_x = skew(omega), p1_x = skew(p1);
    by_nu.template topRows<3>() += omega_x * M.template topRows<3>();
    by_nu.template bottomRows<3>() += skew(v) * M.template topRows<3>() + omega_x * M.template bottomRows<3>();
    by_nu.template topRightCorner<3, 3>() -= p1_x;
    by_nu.template bottomLeftCorner<3, 3>() -= p1_x;
    by_nu.template bottomRightCorner<3, 3>() -= skew(p2);
    const Vector6 slope = nu.cwiseQuotient(speed);  // d|νᵢ|/dνᵢ
    by_nu += vehicle.quadratic.template cast<S>() * (speed + nu.cwiseProduct(slope)).asDiagonal();
    by_nu.col(0) += slope[0] * lifted - (speed[0] + nu[0] * slope[0]) * (fin * actuators);
    by_nu = (by_mass * by_nu).eval();

    const Square3 water_x = skew(water), up_x = skew(up);
    if (Jc) {
      *Jc = -by_nu.template leftCols<3>() * to_body;
      Jc->template topRows<3>() += step * omega_x * to_body;
    }
    if (!Jx0 && !Jw0 && !Jw1) return;
    // Derivatives with respect to a rotation of the midpoint attitude, which rotates current and vertical in the
    // opposite direction.
    Matrix<6, 3, S> restoring;
    restoring << -lightness * up_x, -skew(lever) * up_x;
    Matrix<6, 3, S> by_turn = by_mass * restoring - by_nu.template leftCols<3>() * water_x;
    by_turn.template topRows<3>() += step * omega_x * water_x;
    if (Jx0) *Jx0 << Matrix<6, 3, S>::Zero(), by_turn * Rotation::Exp(turn).inverse().matrix();
    Square6 by_twist = S(0.5) * by_nu;
    by_twist.template topRightCorner<3, 3>() -= half * water_x;
    by_twist.template rightCols<3>() += S(0.5) * half * by_turn * Rotation::Jr(turn);
    if (Jw0) *Jw0 = by_twist - Square6::Identity();
    if (Jw1) *Jw1 = by_twist + Square6::Identity();
  }

  static constexpr int kUnknowns = 21 + 2 * N;  ///< tangent dimension of all states

  /// Applies the chain rule in two steps. The first step differentiates with respect to the mean twist ξ, a rotation ψ
  /// of the midpoint attitude, the current and the mean actuator state ā. The second step differentiates these with
  /// respect to the states. Nonlinear terms are products, damping, the rotation of world-fixed vectors, and ψ =
  /// Log(Exp(−dt ω/2) Exp(x) Exp(dt (ω + δω)/2)), where x is the rotation perturbation of X0.
  void curvature(const SE3& x0, const Twist& w0, const Twist& w1, const Actuators& a0, const Actuators& u,
                 const R3& current, const Vector<6>& w, Matrix<kUnknowns, kUnknowns>& H) const;
};

template <int N>
void VehicleDynamics<N>::curvature(const SE3& x0, const Twist& w0, const Twist& w1, const Actuators& a0,
                                   const Actuators& u, const R3& current, const Vector<6>& w,
                                   Matrix<kUnknowns, kUnknowns>& H) const {
  using Vec3 = Vector<3>;
  using Mat3 = Matrix<3, 3>;
  const double half = 0.5 * dt;
  const Vector<6> twist = 0.5 * (w0.vector() + w1.vector());
  const Vec3 omega = twist.tail<3>(), turn = half * omega;
  const Mat3 to_body = (x0.rotation() * SO3::Exp(turn)).inverse().matrix();
  const Vec3 water = to_body * current.vector(), up = to_body.col(2);
  Vector<6> nu = twist;
  nu.head<3>() -= water;
  const Vector<N> actuators =
      start_weight.cwiseProduct(a0.vector()) + (Vector<N>::Ones() - start_weight).cwiseProduct(u.vector());

  // φ = wᵀ e = yᵀ wrench + sᵀ (ω × water) + …; gradient and Hessian with respect to ν, without the actuators.
  const Vector<6> y = dt * (mass_inverse.transpose() * w);
  const Vec3 y1 = y.head<3>(), y2 = y.tail<3>(), s = dt * w.head<3>();
  Matrix<6, 6> K = Matrix<6, 6>::Zero();  // Coriolis: νᵀ K M ν
  K.topLeftCorner<3, 3>() = K.bottomRightCorner<3, 3>() = -skew(y2);
  K.bottomLeftCorner<3, 3>() = -skew(y1);
  const Matrix<6, 6> coriolis = K * vehicle.mass;
  Matrix<6, 6> by_nu = coriolis + coriolis.transpose();
  Vector<6> gradient = by_nu * nu + vehicle.linear.transpose() * y;
  const Vector<6> lifted = vehicle.lift.transpose() * y, damped = vehicle.quadratic.transpose() * y;
  const Vector<N> fins = vehicle.fin.transpose() * y;
  const auto smooth = [&](int i) { return std::sqrt(nu[i] * nu[i] + kSmoothSpeed * kSmoothSpeed); };
  // νᵢ|νᵢ| has the derivatives |νᵢ| (1 + p²) and p (3 − p²), where p = νᵢ/|νᵢ| is the derivative of |νᵢ|.
  for (int i = 0; i < 6; ++i) {
    const double speed = smooth(i), p = nu[i] / speed;
    const double factor = damped[i] - (i == 0 ? fins.dot(actuators) : 0.0);
    gradient[i] += factor * speed * (1.0 + p * p);
    by_nu(i, i) += factor * p * (3.0 - p * p);
  }
  const double surge = smooth(0), p = nu[0] / surge;
  gradient += surge * lifted;
  gradient[0] += p * lifted.dot(nu);
  by_nu.col(0) += p * lifted;
  by_nu.row(0) += p * lifted.transpose();
  by_nu(0, 0) += (1.0 - p * p) / surge * lifted.dot(nu);
  const Vector<N> surge_by_actuators = -surge * (1.0 + p * p) * fins;

  // Derivatives with respect to [ξ; ψ; current]: ν = ξ − [water; 0], where δwater = water × ψ + to_body δc + ½ ψ × (ψ ×
  // water) − ψ × to_body δc.
  const Vec3 lever = vehicle.buoyancy * vehicle.centre_of_buoyancy - vehicle.weight * vehicle.centre_of_mass;
  const Vec3 by_water = s.cross(omega) - gradient.head<3>();
  const Vec3 by_up = (vehicle.weight - vehicle.buoyancy) * y1 - y2.cross(lever);
  const Vec3 by_turn = by_water.cross(water) + by_up.cross(up);
  Matrix<6, 12> nu_by = Matrix<6, 12>::Zero();
  nu_by.leftCols<6>().setIdentity();
  nu_by.block<3, 3>(0, 6) = -skew(water);
  nu_by.block<3, 3>(0, 9) = -to_body;
  const Matrix<6, 12> bent = by_nu * nu_by;
  Matrix<12, 12> middle = nu_by.transpose() * bent;
  const auto add = [&](int row, int column, const Mat3& block) {
    middle.block<3, 3>(row, column) += block;
    middle.block<3, 3>(column, row) += block.transpose();
  };
  const Mat3 across = -skew(s);
  add(3, 6, across * skew(water));
  add(3, 9, across * to_body);
  add(6, 9, skew(by_water) * to_body);
  const auto turned = [](const Vec3& g, const Vec3& v) {
    return Mat3(0.5 * g * v.transpose() - 0.5 * g.dot(v) * Mat3::Identity());
  };
  add(6, 6, turned(by_water, water) + turned(by_up, up));

  // Derivatives with respect to the states: ξ = (ξ0 + ξ1)/2, ψ = B x + J δω + ½ (B x) × (J δω) + … with J = Jr(dt ω/2)
  // dt/2.
  const Mat3 back = SO3::Exp(-turn).matrix(), by_omega = half * SO3::Jr(turn);
  Matrix<12, 12> states = Matrix<12, 12>::Zero();  // [ξ; x; current]
  states.topLeftCorner<6, 6>().setIdentity();
  states.block<3, 3>(6, 3) = by_omega;
  states.block<3, 3>(6, 6) = back;
  states.bottomRightCorner<3, 3>().setIdentity();
  Matrix<12, 12> S = states.transpose() * middle * states;
  const Mat3 product = -0.5 * (back.transpose() * skew(by_turn) * by_omega);
  S.block<3, 3>(6, 3) += product;
  S.block<3, 3>(3, 6) += product.transpose();
  Vector<6> v = Vector<6>::Zero(), lambda = Vector<6>::Zero();
  v.tail<3>() = turn;
  lambda.tail<3>() = by_turn;
  S.block<3, 3>(3, 3) += half * half * ExpCurvature<SE3>::hessian(v, lambda).template bottomRightCorner<3, 3>();
  const Vector<12> surge_by = (nu_by.row(0) * states).transpose();

  H.setZero();
  constexpr int kTwist = 6, kActuators = 18, kCurrent = 18 + 2 * N;
  const std::array<std::array<int, 3>, 4> parts{{{0, kTwist, 6}, {0, kTwist + 6, 6}, {6, 3, 3}, {9, kCurrent, 3}}};
  const auto twist_weight = [](int from) { return from == 0 ? 0.5 : 1.0; };
  for (const auto& [row, to_row, rows] : parts)
    for (const auto& [column, to_column, columns] : parts)
      H.block(to_row, to_column, rows, columns) =
          twist_weight(row) * twist_weight(column) * S.block(row, column, rows, columns);
  for (const auto& [row, to, rows] : parts)
    for (int i = 0; i < 2; ++i) {
      const Vector<N> weight = i == 0 ? start_weight : Vector<N>(Vector<N>::Ones() - start_weight);
      const Vector<N> by = weight.cwiseProduct(surge_by_actuators);
      auto block = H.block(to, kActuators + N * i, rows, N);
      block = twist_weight(row) * surge_by.segment(row, rows) * by.transpose();
      H.block(kActuators + N * i, to, N, rows) = block.transpose();
    }
}

}  // namespace tandem

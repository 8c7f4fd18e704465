#pragma once

#include <Eigen/LU>

#include <tandem/lie/error.hpp>
#include <tandem/residuals/vehicle/actuator_lag.hpp>
#include <tandem/residuals/vehicle/vehicle_dynamics.hpp>

namespace tandem {

/// Pose, twist and actuator states of a vehicle.
template <int N>
struct VehicleState {
  SE3 pose;                                 ///< body in the world
  Vector<6> twist = Vector<6>::Zero();      ///< over ground, along the body axes [m/s, rad/s]
  Vector<N> actuators = Vector<N>::Zero();  ///< actuator states, which follow the commands with a lag
};

/// Forward simulation of one vehicle with a fixed step: computes states that satisfy VehicleDynamics, TwistKinematics
/// and ActuatorLag.
template <int N>
class VehicleStep {
 public:
  /// Copies the model; dt is in s.
  VehicleStep(const VehicleModel<N>& model, double dt);

  /// Returns the state after one step with a constant command, in a current [m/s] along the world axes. Throws
  /// UndefinedResidualError if Newton's iteration for the implicit rule does not converge because the step is too long
  /// for the forces.
  VehicleState<N> operator()(const VehicleState<N>& from, const Vector<N>& command, const Vector<3>& current) const;
  /// Does the same as operator(), but continues with constant twist and actuator states where operator() throws. For
  /// initial guesses, which need not satisfy the dynamics.
  VehicleState<N> or_constant_twist(const VehicleState<N>& from, const Vector<N>& command,
                                    const Vector<3>& current) const;

 private:
  bool find_twist(const VehicleState<N>& from, const Vector<N>& command, const Vector<3>& current,
                  Vector<6>& twist) const;
  VehicleState<N> with_twist(const VehicleState<N>& from, const Vector<N>& command, const Vector<6>& twist) const;

  static constexpr int kMostIterations = 50, kMostHalvings = 30;
  static constexpr double kTolerance = 1e-13, kRounding = 1e-10;

  VehicleDynamics<N> dynamics_;
  ActuatorLag<N> lag_;
};

template <int N>
VehicleStep<N>::VehicleStep(const VehicleModel<N>& model, double dt) : dynamics_(model, dt), lag_(model.lag, dt) {}

template <int N>
VehicleState<N> VehicleStep<N>::operator()(const VehicleState<N>& from, const Vector<N>& command,
                                           const Vector<3>& current) const {
  Vector<6> twist;
  if (!find_twist(from, command, current, twist))
    throw UndefinedResidualError("vehicle dynamics: the implicit step does not converge; use a shorter time step");
  return with_twist(from, command, twist);
}

template <int N>
VehicleState<N> VehicleStep<N>::or_constant_twist(const VehicleState<N>& from, const Vector<N>& command,
                                                  const Vector<3>& current) const {
  Vector<6> twist;
  if (find_twist(from, command, current, twist)) return with_twist(from, command, twist);
  VehicleState<N> to = from;
  to.pose = from.pose * SE3::Exp(dynamics_.dt * from.twist);
  return to;
}

template <int N>
bool VehicleStep<N>::find_twist(const VehicleState<N>& from, const Vector<N>& command, const Vector<3>& current,
                                Vector<6>& w1) const {
  const Rn<6> w0(from.twist);
  const Rn<N> a0(from.actuators), u(command);
  const R3 water(current);
  w1 = from.twist;
  Vector<6> e;
  Matrix<6, 6> J;
  const auto residual = [&](const Vector<6>& w) {
    dynamics_(from.pose, w0, Rn<6>(w), a0, u, water, e, nullptr, nullptr, &J);
    return e.norm();
  };
  double error = residual(w1);
  for (int i = 0; i < kMostIterations && error > kTolerance * (1.0 + w1.norm()); ++i) {
    const Vector<6> newton = J.partialPivLu().solve(e), start = w1;
    double fraction = 1.0, next = 0.0;
    for (int halving = 0; halving < kMostHalvings; ++halving, fraction *= 0.5) {
      w1 = start - fraction * newton;
      if ((next = residual(w1)) < error) break;
    }
    if (!(next < error)) return error <= kRounding * (1.0 + w1.norm());  // limited by rounding, or no solution
    error = next;
  }
  return true;
}

template <int N>
VehicleState<N> VehicleStep<N>::with_twist(const VehicleState<N>& from, const Vector<N>& command,
                                           const Vector<6>& twist) const {
  VehicleState<N> to;
  to.twist = twist;
  to.pose = from.pose * SE3::Exp(0.5 * dynamics_.dt * (from.twist + twist));
  to.actuators = lag_.decay.cwiseProduct(from.actuators) + (Vector<N>::Ones() - lag_.decay).cwiseProduct(command);
  return to;
}

extern template class VehicleStep<3>;
extern template class VehicleStep<8>;

}  // namespace tandem

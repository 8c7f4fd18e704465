#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include <tandem/residuals/vehicle/vehicle_step.hpp>

namespace tandem {

/// Gains and limits of the pure-pursuit controller.
struct PursuitOptions {
  double speed = 1.5;             ///< maximum speed relative to the goal [m/s]
  double turn_rate = 0.4;         ///< maximum turn rate [rad/s]
  double position_gain = 0.3;     ///< velocity per position error [1/s]
  double orientation_gain = 0.6;  ///< turn rate per orientation error [1/s]
  double response = 2.0;          ///< time to reach a commanded twist [s]
  double min_speed = 0.5;         ///< minimum surge of a vehicle that steers with fins [m/s]
};

/// Returns whether the actuators can also push the vehicle sideways and vertically.
template <int N>
bool is_holonomic(const VehicleModel<N>& vehicle) {
  return vehicle.thrust.row(1).norm() > 0 && vehicle.thrust.row(2).norm() > 0;
}

/// Returns the command whose body acceleration is closest to `acceleration` [m/s², rad/s²], clipped to the bounds of
/// the vehicle. Uses damped least squares on the equations of motion. A zero acceleration holds the twist. For a
/// vehicle that is not holonomic only surge, pitch and yaw count. Otherwise a torpedo would waste thrust on its roll,
/// because its propeller also turns the hull.
template <int N>
Vector<N> command_for(const VehicleModel<N>& vehicle, const VehicleState<N>& state, const Vector<3>& current,
                      const Vector<6>& acceleration) {
  constexpr double dt = 1e-6;       // [s], so short that only the twist changes
  constexpr double damping = 1e-4;  // [m/s², rad/s²]² per full command
  Vector<6> e;
  VehicleDynamics<N>(vehicle, dt)(state.pose, Rn<6>(state.twist), Rn<6>(state.twist), Rn<N>(), Rn<N>(), R3(current), e);
  const Vector<6> without_push = -e / dt;
  const double surge = state.twist[0] - state.pose.rotation().inverse().act(current).x();
  const Matrix<6, N> push = vehicle.thrust + surge * std::abs(surge) * vehicle.fin;
  const Vector<N> half = 0.5 * (vehicle.upper - vehicle.lower);
  const Matrix<6, 6> mass_inverse = vehicle.mass.inverse();
  Vector<6> counts = Vector<6>::Ones();
  if (!is_holonomic(vehicle)) counts << 1.0, 0.0, 0.0, 0.0, 1.0, 1.0;
  const Matrix<6, N> gain = counts.asDiagonal() * mass_inverse * push * half.asDiagonal();
  const Matrix<N, N> normal = gain.transpose() * gain + damping * Matrix<N, N>::Identity();
  const Vector<N> share = normal.ldlt().solve(Vector<N>(gain.transpose() * (acceleration - without_push)));
  return half.cwiseProduct(share).cwiseMax(vehicle.lower).cwiseMin(vehicle.upper);
}

/// Returns the pure-pursuit command towards a goal pose that moves with the body twist `goal_twist`. A holonomic
/// vehicle moves straight to the goal and turns with it; another one steers its bow towards it. This is a baseline
/// controller. Its roll-out obeys the dynamics, so it is also an initial guess for a plan.
template <int N>
Vector<N> pursue(const VehicleModel<N>& vehicle, const VehicleState<N>& state, const Vector<3>& current,
                 const SE3& goal, const Vector<6>& goal_twist, const PursuitOptions& o) {
  const SE3 to_goal = state.pose.inverse() * goal;
  const Vector<3> p = to_goal.translation();
  const auto within = [](const Vector<3>& v, double most) {
    return Vector<3>(v.norm() > most ? Vector<3>(v * (most / v.norm())) : v);
  };
  Vector<6> wanted = to_goal.Ad() * goal_twist;
  if (is_holonomic(vehicle)) {
    wanted.head<3>() += within(o.position_gain * p, o.speed);
    wanted.tail<3>() += within(o.orientation_gain * to_goal.rotation().Log(), o.turn_rate);
  } else {
    const double ahead = goal_twist.head<3>().norm();
    wanted = state.twist;  // keeps the sway and heave that it has
    wanted[0] = std::clamp(ahead + o.position_gain * p[0], o.min_speed, ahead + o.speed);
    wanted[4] = std::clamp(-o.orientation_gain * std::atan2(p[2], std::hypot(p[0], p[1])), -o.turn_rate, o.turn_rate);
    wanted[5] = std::clamp(o.orientation_gain * std::atan2(p[1], p[0]), -o.turn_rate, o.turn_rate);
  }
  VehicleState<N> damped = state;
  // Drag is taken at the wanted twist. Compensating the drag of the current twist would cancel the natural damping.
  if (!is_holonomic(vehicle)) damped.twist = wanted;
  return command_for(vehicle, damped, current, Vector<6>((wanted - state.twist) / o.response));
}

/// Returns the command that turns the body to the orientation `course` (body to world) and moves it over ground at
/// `speed` [m/s] along the x axis of `course`. Drag is taken at the wanted twist, which suits a poorly known current.
template <int N>
Vector<N> keep_course(const VehicleModel<N>& vehicle, const VehicleState<N>& state, const Vector<3>& current,
                      const SO3& course, double speed, const PursuitOptions& o) {
  const SO3 to_course = state.pose.rotation().inverse() * course;
  VehicleState<N> damped = state;
  damped.twist << to_course.act({speed, 0.0, 0.0}), o.orientation_gain * to_course.Log();
  if (!is_holonomic(vehicle)) damped.twist.template segment<3>(1) = state.twist.template segment<3>(1);
  return command_for(vehicle, damped, current, Vector<6>((damped.twist - state.twist) / o.response));
}

extern template Vector<3> command_for(const VehicleModel<3>&, const VehicleState<3>&, const Vector<3>&,
                                      const Vector<6>&);
extern template Vector<8> command_for(const VehicleModel<8>&, const VehicleState<8>&, const Vector<3>&,
                                      const Vector<6>&);
extern template Vector<3> pursue(const VehicleModel<3>&, const VehicleState<3>&, const Vector<3>&, const SE3&,
                                 const Vector<6>&, const PursuitOptions&);
extern template Vector<8> pursue(const VehicleModel<8>&, const VehicleState<8>&, const Vector<3>&, const SE3&,
                                 const Vector<6>&, const PursuitOptions&);
extern template Vector<3> keep_course(const VehicleModel<3>&, const VehicleState<3>&, const Vector<3>&, const SO3&,
                                      double, const PursuitOptions&);
extern template Vector<8> keep_course(const VehicleModel<8>&, const VehicleState<8>&, const Vector<3>&, const SO3&,
                                      double, const PursuitOptions&);

}  // namespace tandem

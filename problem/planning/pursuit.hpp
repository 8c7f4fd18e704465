#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include <tandem/residuals/vehicle/vehicle_step.hpp>

namespace tandem {

/// Gains and limits of pure pursuit.
struct PursuitOptions {
  double speed = 1.5;             ///< most, over that of the goal [m/s]
  double turn_rate = 0.4;         ///< most [rad/s]
  double position_gain = 0.3;     ///< 1/s
  double orientation_gain = 0.6;  ///< 1/s
  double response = 2.0;          ///< s in which a wanted twist is to be reached
  double least_speed = 0.5;       ///< of a vehicle whose fins need it to turn [m/s]
};

/// Whether it can push sideways, up and down, not only ahead.
template <int N>
bool is_holonomic(const VehicleModel<N>& vehicle) {
  return vehicle.thrust.row(1).norm() > 0 && vehicle.thrust.row(2).norm() > 0;
}

/// The command that comes nearest to an acceleration of the body [m/s², rad/s²], by damped least squares over the
/// vehicle's own equations of motion, cut to its bounds. Zero: it holds its twist. Of a vehicle that is not holonomic, in
/// surge, pitch and yaw: the propeller of a torpedo turns the hull, too, and would be spent on holding its roll.
template <int N>
Vector<N> command_for(const VehicleModel<N>& vehicle, const VehicleState<N>& state, const Vector<3>& current,
                      const Vector<6>& acceleration) {
  constexpr double dt = 1e-6;       // s: a step over which nothing changes but the twist
  constexpr double damping = 1e-4;  // [m/s², rad/s²]² of a whole command
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

/// A command by pure pursuit of a goal pose that moves with its body twist: a vehicle that can push sideways moves
/// straight to it and turns with it, another one steers its bow there. A baseline, and the start of a plan: a roll-out of
/// it obeys the dynamics.
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
    wanted = state.twist;  // sideways it moves as it will
    wanted[0] = std::clamp(ahead + o.position_gain * p[0], o.least_speed, ahead + o.speed);
    wanted[4] = std::clamp(-o.orientation_gain * std::atan2(p[2], std::hypot(p[0], p[1])), -o.turn_rate, o.turn_rate);
    wanted[5] = std::clamp(o.orientation_gain * std::atan2(p[1], p[0]), -o.turn_rate, o.turn_rate);
  }
  VehicleState<N> damped = state;
  // By what damps the wanted twist: pushed against what damps the one it has, it would stop by itself no longer.
  if (!is_holonomic(vehicle)) damped.twist = wanted;
  return command_for(vehicle, damped, current, Vector<6>((wanted - state.twist) / o.response));
}

/// A command that keeps a course with a way through the world [m/s], both in the world's frame. By what damps the wanted
/// twist, for who hardly knows the current.
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

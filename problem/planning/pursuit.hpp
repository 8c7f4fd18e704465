#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include <tandem/residuals/vehicle/vehicle_step.hpp>

namespace tandem {

/// Gains and limits of the pure-pursuit controller.
struct PursuitOptions {
  double speed = 1.5;             ///< Maximum speed relative to the goal [m/s].
  double turn_rate = 0.4;         ///< Maximum turn rate [rad/s].
  double position_gain = 0.3;     ///< Velocity per position error [1/s].
  double orientation_gain = 0.6;  ///< Turn rate per orientation error [1/s].
  double response = 2.0;          ///< Time to reach a commanded twist [s].
  double min_speed = 0.5;         ///< Minimum surge of a vehicle that steers with fins [m/s].
};

/// Returns whether the actuators can also push the vehicle sideways and vertically.
template <int N>
bool is_holonomic(const VehicleModel<N>& vehicle) {
  return vehicle.thrust.row(1).norm() > 0 && vehicle.thrust.row(2).norm() > 0;
}

namespace detail {

/// Returns the minimum of ½ xᵀ H x − gᵀ x between the bounds, by a primal-dual active-set iteration (Hintermüller et
/// al. 2002). If it does not converge, clips the last iterate.
template <int N>
Vector<N> bounded_minimum(const Matrix<N, N>& H, const Vector<N>& g, const Vector<N>& lower, const Vector<N>& upper) {
  constexpr int max_iterations = 4 * N;
  Vector<N> x = H.ldlt().solve(g);
  Eigen::Array<int, N, 1> at = Eigen::Array<int, N, 1>::Zero();  // −1 at the lower bound, 1 at the upper bound, 0 free
  for (int k = 0; k < max_iterations; ++k) {
    const Eigen::Array<int, N, 1> before = at;
    const Vector<N> slope = H * x - g;
    for (int i = 0; i < N; ++i) {
      if (at[i] != 0 && at[i] * slope[i] > 0)
        at[i] = 0;
      else if (x[i] > upper[i])
        at[i] = 1;
      else if (x[i] < lower[i])
        at[i] = -1;
    }
    if ((at == before).all()) break;
    Matrix<N, N> free = H;
    Vector<N> right = g;
    for (int i = 0; i < N; ++i)
      if (at[i] != 0) {
        free.row(i) = Vector<N>::Unit(i).transpose();
        right[i] = at[i] > 0 ? upper[i] : lower[i];
      }
    x = free.partialPivLu().solve(right);
  }
  return x.cwiseMax(lower).cwiseMin(upper);
}

/// Returns the command u within the bounds of the vehicle that minimises the acceleration error e + G u [m/s², rad/s²].
/// Bounds are part of the minimisation: clipping each thruster instead would leave a torque that spins the vehicle. For
/// a vehicle that is not holonomic only surge, pitch and yaw count. Otherwise a torpedo would waste thrust on its roll,
/// because its propeller also turns the hull.
template <int N>
Vector<N> closest_command(const VehicleModel<N>& vehicle, const Matrix<6, N>& G, const Vector<6>& e) {
  constexpr double damping = 1e-4;  // [m/s², rad/s²]² per full command
  const Vector<N> half = (0.5 * (vehicle.upper - vehicle.lower)).cwiseMax(1e-300);  // above 0 for absent actuators
  Vector<6> counts;
  if (is_holonomic(vehicle))
    counts << 1.0, 1.0, 1.0, 100.0, 100.0, 100.0;  // thrust is useless while the hull spins
  else
    counts << 1.0, 0.0, 0.0, 0.0, 1.0, 1.0;
  const Matrix<6, N> gain = counts.asDiagonal() * G * half.asDiagonal();
  const Matrix<N, N> normal = gain.transpose() * gain + damping * Matrix<N, N>::Identity();
  return half.cwiseProduct(bounded_minimum<N>(normal, Vector<N>(-gain.transpose() * counts.cwiseProduct(e)),
                                              vehicle.lower.cwiseQuotient(half), vehicle.upper.cwiseQuotient(half)));
}

}  // namespace detail

/// Returns the command whose body acceleration is closest to `acceleration` [m/s², rad/s²] by damped least squares on
/// the equations of motion; see detail::closest_command(). A zero acceleration holds the twist.
template <int N>
Vector<N> command_for(const VehicleModel<N>& vehicle, const VehicleState<N>& state, const Vector<3>& current,
                      const Vector<6>& acceleration) {
  constexpr double dt = 1e-6;  // [s], so short that only the twist changes
  Vector<6> e;
  VehicleDynamics<N>(vehicle, dt)(state.pose, Rn<6>(state.twist), Rn<6>(state.twist), Rn<N>(), Rn<N>(), R3(current), e);
  const Vector<6> without_push = -e / dt;
  const double surge = state.twist[0] - state.pose.rotation().inverse().act(current).x();
  const Matrix<6, N> push = vehicle.thrust + surge * std::abs(surge) * vehicle.fin;
  return detail::closest_command<N>(vehicle, Matrix<6, N>(vehicle.mass.inverse() * push),
                                    Vector<6>(without_push - acceleration));
}

/// Returns the command with which a step of `dt` [s] ends closest to `twist`, by damped least squares on the
/// discretised equations of motion. This holds for any step length. command_for() suits steps that are short compared
/// with the vehicle's response.
template <int N>
Vector<N> command_reaching(const VehicleModel<N>& vehicle, double dt, const VehicleState<N>& state,
                           const Vector<3>& current, const Vector<6>& twist) {
  Vector<6> e;
  Matrix<6, N> by_command;
  VehicleDynamics<N>(vehicle, dt)(state.pose, Rn<6>(state.twist), Rn<6>(twist), Rn<N>(state.actuators), Rn<N>(),
                                  R3(current), e, nullptr, nullptr, nullptr, nullptr, &by_command);
  return detail::closest_command<N>(vehicle, Matrix<6, N>(by_command / dt), Vector<6>(e / dt));
}

/// Returns the body twist of pure pursuit towards a goal pose that moves with the body twist `goal_twist` [m/s, rad/s].
/// A holonomic vehicle moves straight to the goal and turns with it; another one steers its bow towards it.
template <int N>
Vector<6> pursuit_twist(const VehicleModel<N>& vehicle, const VehicleState<N>& state, const SE3& goal,
                        const Vector<6>& goal_twist, const PursuitOptions& o) {
  const SE3 to_goal = state.pose.inverse() * goal;
  const Vector<3> p = to_goal.translation();
  const auto within = [](const Vector<3>& v, double most) {
    return Vector<3>(v.norm() > most ? Vector<3>(v * (most / v.norm())) : v);
  };
  if (is_holonomic(vehicle)) {
    const SO3& turn = to_goal.rotation();
    Vector<6> wanted;
    wanted << turn.act(goal_twist.head<3>()) + within(o.position_gain * p, o.speed),
        turn.act(goal_twist.tail<3>()) + within(o.orientation_gain * turn.Log(), o.turn_rate);
    return wanted;
  }
  const double ahead = goal_twist.head<3>().norm();
  Vector<6> wanted = state.twist;  // keeps its present sway and heave
  wanted[0] = std::clamp(ahead + o.position_gain * p[0], o.min_speed, ahead + o.speed);
  wanted[4] = std::clamp(-o.orientation_gain * std::atan2(p[2], std::hypot(p[0], p[1])), -o.turn_rate, o.turn_rate);
  wanted[5] = std::clamp(o.orientation_gain * std::atan2(p[1], p[0]), -o.turn_rate, o.turn_rate);
  return wanted;
}

/// Returns the command of pure pursuit; see pursuit_twist(). This is a baseline controller. Its roll-out obeys the
/// dynamics, so it is also an initial guess for a plan.
template <int N>
Vector<N> pursue(const VehicleModel<N>& vehicle, const VehicleState<N>& state, const Vector<3>& current,
                 const SE3& goal, const Vector<6>& goal_twist, const PursuitOptions& o) {
  const Vector<6> wanted = pursuit_twist(vehicle, state, goal, goal_twist, o);
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

#pragma once

#include <string_view>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/outside.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/twist_components.hpp>

/// What is known of a target beside how its motion goes on: for those who add it to a problem, and for those who look ahead.
namespace tandem::detail {

/// Of a pose: f(residual, role, entry of TrackingNoise, standard deviations), once or, in the plane, not at all.
template <LieGroup G, class F>
void each_attitude_constraint(const TrackingOptions& options, const TrackingNoise& noise, F f) {
  if constexpr (G::point_dim == 3)  // a planar target is level
    f(RollPitch<G>{}, options.roll_pitch, "roll_pitch", noise.roll_pitch);
}

/// Of the twist between two poses dt [s] apart: zero(residual, role, entry, standard deviations) of what is to vanish,
/// within(residual, role, bounds, entry, standard deviations) of limits.
template <LieGroup G, class Zero, class Within>
void each_twist_constraint(const TrackingOptions& options, const TrackingNoise& noise, double dt, Zero zero,
                           Within within) {
  constexpr TwistAxes sideways = G::point_dim == 2 ? sway : sway | heave;
  using NonHolonomic = TwistComponents<G, sideways>;
  using Surge = TwistComponents<G, surge>;
  using YawRate = TwistComponents<G, yaw_rate>;
  zero(NonHolonomic{dt}, options.non_holonomic, "non_holonomic",
       Vector<NonHolonomic::dim>(noise.non_holonomic.head<NonHolonomic::dim>()));
  if (options.surge) within(Surge{dt}, options.limits, *options.surge, "surge", Vector<1>(noise.surge));
  if (options.max_yaw_rate) {
    const Bounds<1> turning = between(-*options.max_yaw_rate, *options.max_yaw_rate);
    within(YawRate{dt}, options.limits, turning, "yaw_rate", Vector<1>(noise.yaw_rate));
  }
}

}  // namespace tandem::detail

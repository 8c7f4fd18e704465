#pragma once

#include <string_view>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/soft_bound.hpp>
#include <tandem/residuals/twist_components.hpp>

/// Constraints on the target, for the problem builder and for forecasts.
namespace tandem::detail {

/// Calls f(residual, role, name in TrackingNoise, sigmas) for the constraint on a pose. There is none in the plane.
template <LieGroup G, class F>
void each_attitude_constraint(const TrackingOptions& options, const TrackingNoise& noise, F f) {
  if constexpr (G::point_dim == 3)  // a planar target is level
    f(RollPitch<G>{}, options.roll_pitch, "roll_pitch", noise.roll_pitch);
}

/// Visits the constraints on the twist between two poses, dt [s] apart. Calls zero(residual, role, name, sigmas) for
/// residuals that must vanish. Calls within(residual, role, bounds, name, sigmas) for limits.
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

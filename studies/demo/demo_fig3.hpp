#pragma once

#include <string>
#include <vector>

#include <tandem/lie/sek3.hpp>
#include <tandem/studies/estimation/estimate.hpp>

/// Figure 3 of Baxter & Teran Espinoza et al. 2025: what the constant-twist prior on SE(3), with no measurement at all,
/// makes of poses that are not known. A first example of the library; all of it is in demo_fig3.cpp.
namespace tandem::fig3 {

constexpr double speed = 1.0;                 ///< forward, along the body's x [m/s]
constexpr double turn_rate = 0.5;             ///< to the left, about the body's z [rad/s]
constexpr double radius = speed / turn_rate;  ///< of the arc, around the origin, in the world's x-y plane [m]

/// The pose at time t [s] of a vehicle that has this twist and starts at (radius, 0, 0), heading along the world's y.
SE3 arc_pose(double t);

/// How far a pose is from following the arc, wherever on it: its position from the circle [m], and its x axis from
/// the circle's tangent at the nearest point [rad].
struct OffArc {
  double distance, angle;
};
OffArc off_arc(const SE3& pose);

/// Poses at increasing times [s]; the given ones are on the arc and stay there.
struct Panel {
  struct Pose {
    double t;
    bool given;
  };
  std::string title;
  std::vector<Pose> poses;
};

/// (a) extrapolation, (b) interpolation and (c) a chain between its ends.
std::vector<Panel> panels();

/// A panel before and after; one pose each of the panel's.
struct Solution {
  Panel panel;
  std::vector<SE3> start, solved;
  Summary summary;
};

/// Starts the unknown poses far from the arc, the same way for the same seed, and solves for them. Constant twists that
/// make more turns, or the other way, between the given poses fit as well: a start farther off, or poses at very uneven
/// times, may end in one of them. Throws Error when the solver is not in this build; a solve that does not converge is
/// in the summary.
Solution solve(const Panel& panel, const Solver& solver, unsigned seed);

}  // namespace tandem::fig3

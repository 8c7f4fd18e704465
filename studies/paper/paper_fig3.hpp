#pragma once

#include <string>
#include <vector>

#include <tandem/lie/sek3.hpp>
#include <tandem/studies/estimation/estimate.hpp>

/// Figure 3 of Baxter & Teran Espinoza et al. 2025: the constant-twist prior on SE(3) extrapolates and interpolates
/// poses without any measurement. paper_fig3.cpp is also a first example of the library.
namespace tandem::fig3 {

constexpr double speed = 1.0;                 ///< forward, along the body's x [m/s]
constexpr double turn_rate = 0.5;             ///< positive to the left, about the body's z [rad/s]
constexpr double radius = speed / turn_rate;  ///< radius of the arc around the origin, in the world's x-y plane [m]

/// Returns the pose at time t [s] of a vehicle with this twist that starts at (radius, 0, 0) and heads along the
/// world's y.
SE3 arc_pose(double t);

/// Deviation of a pose from the arc.
struct OffArc {
  double distance;  ///< distance of the position from the circle [m]
  double angle;     ///< angle from the tangent at the nearest point of the circle to the body's x axis [rad]
};
OffArc off_arc(const SE3& pose);

/// A panel of the figure: poses at increasing times.
struct Panel {
  struct Pose {
    double t;    ///< s
    bool given;  ///< whether the pose is fixed on the arc; other poses are unknown
  };
  std::string title;
  std::vector<Pose> poses;
};

/// Returns (a) extrapolation, (b) interpolation and (c) a chain between two given poses.
std::vector<Panel> panels();

/// The poses of a panel: initial guess and solution.
struct Solution {
  Panel panel;
  std::vector<SE3> start, solved;
  Summary summary;
};

/// Solves a panel. The initial guess of the unknown poses is far from the arc and random, determined by the seed.
///
/// The problem has other minima: constant twists with more turns, or in the other direction, between the given poses. A
/// worse initial guess or very uneven times may lead to one of them. Throws Error if the solver is not available; a
/// solve that does not converge is not an error, see `summary`.
Solution solve(const Panel& panel, const AnySolver& solver, unsigned seed);

}  // namespace tandem::fig3

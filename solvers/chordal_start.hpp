#pragma once

#include <span>
#include <vector>

#include <tandem/lie/se2.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/residuals/gaussian.hpp>

namespace tandem {

/// Edge of a pose graph; see RelativePose.
template <LieGroup G>
struct PoseEdge {
  int from, to;    ///< indices in [0, number of poses)
  G z;             ///< measured pose of `to` in the frame of `from` [m]
  Gaussian noise;  ///< noise of Log(z⁻¹ from⁻¹ to) [m, rad]
};

/// Returns initial poses for a pose graph from its edges alone. Use them if a solve from the poses of a file or of
/// odometry ends in a poor local minimum. G is SE2 or SE3. Pose 0 is `first`.
///
/// Rotations minimise Σ w ‖R_from R_z − R_to‖² over all matrices and are then projected onto rotations (chordal
/// relaxation: Martinec & Pajdla 2007; Carlone et al. 2015, "Initialization Techniques for 3D SLAM", §III-C).
/// Translations minimise Σ v ‖t_to − t_from − R_from t_z‖². Both are linear. w and v are the mean information of an
/// edge's rotation and translation.
///
/// Throws BadInputError if an edge refers to a pose that does not exist, or if edges do not connect a pose to pose 0.
template <LieGroup G>
std::vector<G> chordal_start(int poses, std::span<const PoseEdge<G>> edges, const G& first = {});

extern template std::vector<SE2> chordal_start(int, std::span<const PoseEdge<SE2>>, const SE2&);
extern template std::vector<SE3> chordal_start(int, std::span<const PoseEdge<SE3>>, const SE3&);

}  // namespace tandem

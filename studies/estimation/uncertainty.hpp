#pragma once

#include <optional>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/studies/navigation/found_constants.hpp>

namespace tandem {

/// How sure an estimate is at one keyframe. Pose covariances are 6 × 6 in the tangent space of right perturbations (x y z
/// [m], then rotation about x y z [rad], body axes); those of planar problems are zero out of the plane.
struct KeyframeUncertainty {
  Matrix<6, 6> chaser = Matrix<6, 6>::Zero();
  Eigen::MatrixXd target;  ///< of a pose likewise; of a point 3 × 3 along the world's axes [m²]
  /// Of the relative pose: the target's position along the chaser's axes [m²], its rotation about the target's [rad²].
  Matrix<3, 3> relative_position = Matrix<3, 3>::Zero();
  std::optional<Matrix<3, 3>> relative_rotation;

  Vector<3> position_sigma() const { return relative_position.diagonal().cwiseSqrt(); }  ///< m
  std::optional<Vector<3>> rotation_sigma() const {                                      ///< rad
    if (!relative_rotation) return {};
    return relative_rotation->diagonal().cwiseSqrt();
  }
};

/// How a measurement that was held out compares with its prediction.
struct HeldOut {
  std::size_t sensor, index;   ///< in the data
  Eigen::VectorXd r;           ///< the residual, in the sensor's units
  Eigen::MatrixXd covariance;  ///< of r: the prediction's and the sensor's noise together

  /// Whether row i is within the 95 % interval of its own, |rᵢ| ≤ 1.96 σᵢ.
  bool row_inside(Eigen::Index i) const;
  int rows_inside() const;
  /// rᵀ S⁻¹ r, χ² with as many degrees of freedom as rows.
  double squared_distance() const;
  /// Whether all rows together are in their 95 % region: the squared distance against χ².
  bool inside() const;
};

struct Uncertainty {
  std::vector<FoundConstant> constants;  ///< of sensors with errors that stay
  std::vector<KeyframeUncertainty> keyframes;
  std::vector<HeldOut> held_out;  ///< in the problem's order
};

/// Chaser and target of each keyframe: what their covariance together is of.
std::vector<Marginals::Pair> pairs_at_keyframes(const TrackingProblem& tracking);

/// At the problem's values, by its marginals; see solvers/marginals.hpp. Throws Error when a direction is free, Stopped
/// when it is to stop.
Uncertainty uncertainty(TrackingProblem& tracking, const TrackingData& data, const Stop& stop = {});

}  // namespace tandem

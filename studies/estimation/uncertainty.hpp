#pragma once

#include <optional>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/studies/navigation/systematic_error_estimates.hpp>

namespace tandem {

/// Posterior covariances at one keyframe. Covariances of poses are 6 × 6, in the tangent space of right perturbations:
/// translation [m], then rotation [rad], along the body axes. In planar problems, entries out of the plane are zero.
struct KeyframeUncertainty {
  Matrix<6, 6> chaser = Matrix<6, 6>::Zero();
  Eigen::MatrixXd target;  ///< 6 × 6 as above for a pose; 3 × 3 along the world axes [m²] for a point
  Eigen::MatrixXd cross;   ///< covariance of the chaser (rows) with the target (columns); empty if unknown
  Matrix<3, 3> relative_position = Matrix<3, 3>::Zero();  ///< of the target's position along the chaser's axes [m²]
  std::optional<Matrix<3, 3>> relative_rotation;          ///< of the relative rotation about the target's axes [rad²]

  /// Returns the standard deviations of the relative position [m].
  Vector<3> position_sigma() const { return relative_position.diagonal().cwiseSqrt(); }
  /// Returns the standard deviations of the relative rotation [rad]; nothing if the target is a point.
  std::optional<Vector<3>> rotation_sigma() const {
    if (!relative_rotation) return {};
    return relative_rotation->diagonal().cwiseSqrt();
  }
};

/// Residual of a held-out measurement against its prediction.
struct HeldOut {
  std::size_t sensor, index;   ///< sensor in the data, and measurement of the sensor
  Eigen::VectorXd r;           ///< residual in the sensor's units
  Eigen::MatrixXd covariance;  ///< covariance S of r: prediction plus measurement noise

  /// Returns whether row i is within its 95 % interval, |rᵢ| ≤ 1.96 σᵢ.
  bool row_inside(Eigen::Index i) const;
  /// Returns the number of rows within their 95 % intervals.
  int rows_inside() const;
  /// Returns rᵀ S⁻¹ r, which is χ²-distributed with one degree of freedom per row.
  double squared_distance() const;
  /// Returns whether r is in its joint 95 % region: squared_distance() is at most the 95 % quantile of χ².
  bool inside() const;
};

/// Posterior uncertainty of a tracking problem.
struct Uncertainty {
  std::vector<SystematicErrorEstimate> constants;  ///< systematic errors of sensors
  std::vector<KeyframeUncertainty> keyframes;
  std::vector<HeldOut> held_out;  ///< in the problem's order of measurements
};

/// Returns the pairs of variables whose joint covariances uncertainty() needs: chaser and target at each keyframe, and
/// the variables of each held-out measurement.
std::vector<Marginals::Pair> pairs_at_keyframes(const TrackingProblem& tracking);

/// Gives infinite variances to the components of a position that change along `sight`, which is in the same axes, if
/// only the direction of the line of sight is known. The position is at the start of the covariance.
void add_unknown_range(const Vector<3>& sight, Eigen::Ref<Eigen::MatrixXd> covariance);

/// Computes the posterior uncertainty at the problem's current values from its marginals for pairs_at_keyframes().
/// Unobservable directions have infinite variances. Throws Stopped if `stop` requests it.
Uncertainty uncertainty(TrackingProblem& tracking, const TrackingData& data, const Marginals& marginals,
                        const Stop& stop = {});

}  // namespace tandem

#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/navigation/navigation_checks.hpp>
#include <tandem/problem/navigation/navigation_problem.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/studies/navigation/ego_covariance.hpp>
#include <tandem/studies/navigation/found_constants.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// What navigating a scenario by the chaser's own sensors gave, all in ENU-FLU.
struct Navigation {
  NavigationData data;  ///< cleaned by check()
  std::vector<NavigationFinding> findings;
  Alignment start;  ///< what the first state's prior is
  Summary summary;  ///< of the last solve
  int solves = 0;   ///< the samples are summed up anew at the biases that a solve has found
  int residual_blocks = 0;
  std::vector<Stamped<EgoState>> states;  ///< at the keyframes
  std::vector<EgoCovariance> covariance;  ///< one each a keyframe, or none
  std::string why_no_covariance;
  bool cut_short = false;                ///< the covariances were, by the solver's limits
  std::optional<double> dvl_scale;       ///< when estimated
  std::vector<FoundConstant> constants;  ///< of sensors with errors that stay
  std::vector<PlacedEgoMeasurement> placed;
  std::vector<double> weight;         ///< of each placed measurement: what a robust loss leaves of it
  std::vector<std::size_t> left_out;  ///< of each sensor
  std::vector<std::pair<double, double>> splits;
  double alignment_seconds = 0, seconds = 0;  ///< of computing: until the first guess was there, and in all
};

struct NavigationOptions {
  EgoOptions ego{};
  GaussNewtonOptions solver{};
  double alignment = 30.0;           ///< s of data that decide an unknown heading
  double first_pass = 20.0;          ///< s, window of the fixed-lag pass that gives the first guess
  bool covariance = true;            ///< else `why_no_covariance` says so
  std::optional<Alignment> start{};  ///< in place of an alignment
  /// The IMU's white noise is what its samples show, where that is far more than stated (NavigationFinding::vibration).
  bool vibration = false;
  /// Called with the batch problem before it is solved, once each solve: with other delays or biases it is another one.
  std::function<void(const Problem&)> built{};
};

/// Checks the data, finds a first guess by a fixed-lag pass, and solves the batch problem. Throws Error when the scenario
/// has no sensors of the chaser's own or they make no sense; a solve that does not converge is in the summary. The solver's
/// limits are of all this together: what is there by then is given, as far as the first pass had come, and Stopped is
/// thrown where that is not yet two keyframes.
Navigation navigate(const NavigationData& data, const NavigationOptions& options = {});

}  // namespace tandem

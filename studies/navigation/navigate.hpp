#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/navigation/navigation_checks.hpp>
#include <tandem/problem/navigation/navigation_problem.hpp>
#include <tandem/solvers/fit_report.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/studies/navigation/ego_covariance.hpp>
#include <tandem/studies/navigation/systematic_error_estimates.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/scenario/states_at.hpp>

namespace tandem {

/// Result of navigate(), in ENU-FLU.
struct Navigation {
  NavigationData data;  ///< cleaned by check()
  std::vector<NavigationFinding> findings;
  Alignment start;                        ///< Prior of the first state.
  Summary summary;                        ///< Result of the last solve.
  int solves = 0;                         ///< Number of solves; each preintegrates at the biases of the previous solve.
  int residual_blocks = 0;                ///< Number of soft blocks.
  std::vector<Stamped<EgoState>> states;  ///< At the keyframes.
  std::vector<EgoCovariance> covariance;  ///< At the keyframes, or empty.
  FitReport fit;                          ///< Agreement of the solution with the data and the stated noise.
  std::string why_no_covariance;          ///< Reason, if `covariance` is empty.
  bool cut_short = false;                 ///< Whether a time limit or interrupt stopped the covariances.
  std::optional<double> dvl_scale;        ///< Estimated scale factor s, if estimated; the DVL reads (1 + s) v.
  std::vector<SystematicErrorEstimate> constants;  ///< Systematic errors of sensors.
  std::vector<PlacedEgoMeasurement> placed;        ///< Measurements in the problem.
  std::vector<double> weight;                      ///< Weight by the robust loss, of each entry of `placed`.
  std::vector<std::size_t> discarded;              ///< Number of discarded measurements of each sensor.
  std::vector<std::pair<double, double>> splits;   ///< Gaps of the IMU: begin, end [s].
  std::vector<StateAt> at;                         ///< States at NavigationOptions::at, in their order.
  double alignment_seconds = 0, seconds = 0;       ///< Computing time until the initial guess, and in total.
};

struct NavigationOptions {
  EgoOptions ego{};
  GaussNewtonOptions solver{};
  double alignment = 30.0;           ///< Duration of the data that determine an unknown heading [s].
  double first_pass = 20.0;          ///< Window of the fixed-lag smoother that computes the initial guess [s].
  bool covariance = true;            ///< Computes covariances.
  bool north_east = false;           ///< World positions of the files are north, east, down; only names components.
  std::optional<Alignment> start{};  ///< Prior of the first state; if absent, align() computes it.
  /// Uses the white noise of the IMU samples if it is far above the stated noise (NavigationFinding::vibration).
  bool vibration = false;
  /// Rejects measurements that contradict the others (GrossErrors).
  bool reject_gross_errors = true;
  /// The fixed-lag smoother rejects measurements outside its gate, restarts, and excludes a wrong IMU. If false, it uses
  /// all data, which is faster if they contradict each other.
  bool gated_first_pass = true;
  std::vector<double> at{};  ///< Times of Navigation::at [s].
  /// Called with the batch problem before each solve. Problems differ in delays and in the biases of the
  /// preintegration.
  std::function<void(const Problem&)> built{};
};

/// Prepares the data of the chaser's sensors: drops implausible values (check()), applies NavigationOptions::vibration,
/// and averages fast readings if there is no IMU. Returns what it found.
std::vector<NavigationFinding> prepare(NavigationData& data, const NavigationOptions& options);

/// Navigates the chaser by its own sensors: prepares the data, computes an initial guess by fixed-lag smoothing, and
/// solves the batch problem.
///
/// Throws Error if there are no sensors or they are not sufficient. A solve that does not converge is not an error; see
/// `summary`. The solver's time limit covers all steps. If it is reached, the result ends at the last keyframe computed
/// so far; Stopped is thrown if there are fewer than two.
Navigation navigate(const NavigationData& data, const NavigationOptions& options = {});

}  // namespace tandem

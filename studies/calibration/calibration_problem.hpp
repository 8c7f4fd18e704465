#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <tandem/problem/navigation/navigation_problem.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace tandem {

/// A noise entry of a scenario, and where its rows are in the problem.
struct CalibratedEntry {
  std::string name;                     ///< A sensor ("usbl") or another noise entry ("constant_twist").
  std::string kind;                     ///< Sensor type, "" for other entries; must agree between scenarios.
  std::vector<std::string> components;  ///< "x", "roll", "range", …; "" for a single component.
  std::vector<bool> angle;              ///< Whether each component is an angle [rad].
  std::vector<double> sigmas;           ///< Given values, in the axes of the files like `components`.
  std::vector<int> row;                 ///< Index of each component among the rows in the problem.
  bool sensor = false;                  ///< Whether it is the noise of a sensor.
  /// Whether it is the noise of a sensor of the chaser that gives no position fixes. If the sensor has a bias state,
  /// only the noise of the bias has the flag. Between fixes, only this noise can account for slow errors of the
  /// position.
  bool dead_reckoning = false;

  /// Returns the name of a parameter: "usbl.x", or "depth" for a single component.
  std::string parameter(std::size_t component) const;
};

/// A residual block and its noise entry. Row i has the standard deviation of row (first + i) mod n of the entry's n
/// rows.
struct EntryBlock {
  std::size_t entry;  ///< index in CalibrationProblem::entries
  Block block;
  int first = 0;
  std::optional<double> measured_at = {};  ///< Time stamp [s], if the block is a measurement.
  double share = 1;                        ///< NoiseRows::share of the first `shared` rows; the others have 1.
  int shared = -1;                         ///< −1: all rows.
  bool primary = true;                     ///< False for a second block of a measurement.
};

/// The problem of one scenario, and the noise entries of its blocks.
class CalibrationProblem {
 public:
  /// With a target, builds the problem of make_tracking_problem(); a chaser with its own sensors is navigated first.
  /// Without a target, builds the problem of make_navigation_problem(), with the result of navigate() as initial guess.
  /// `similar` is a navigation of the same recording with other noise or errors. If it is given, its states are the
  /// initial guess of the chaser, and its gross errors are rejected. Throws the exceptions of these functions, and
  /// Stopped.
  CalibrationProblem(Scenario scenario, const TrackingOptions& target, const NavigationOptions& own,
                     const Stop& stop = {}, const EgoTrack* similar = nullptr);

  std::string scenario;
  std::vector<CalibratedEntry> entries;
  std::vector<EntryBlock> blocks;
  /// Navigation of the chaser that gave the initial guess; null if the chaser moves by odometry.
  std::shared_ptr<const EgoTrack> navigation;
  /// Longest time between position fixes of the chaser, including the ends of the recording [s]; 0 without navigation.
  double longest_without_fix = 0;
  /// Longest time between measured positions of the target, including the ends of the recording [s]; 0 without target.
  double longest_without_target_position = 0;
  /// Number of the target's measurements that are rejected as gross outliers, with
  /// TrackingOptions::robust_initial_guess.
  std::size_t num_gross_outliers = 0;
  /// Sensors with systematic errors but without measurements.
  std::vector<std::string> without_measurements{};

  /// Returns the times of the first and the last measurement [s]; the first is later if there is none.
  std::pair<double, double> measured_span() const;
  /// Estimates the constant systematic errors at the current values. Throws Error if they have no covariance, and
  /// Stopped.
  std::vector<SystematicErrorEstimate> constants(const Stop& stop);
  /// Returns CalibratedConstant::profile. Empty for a constant with several rows, and with hard constraints. Throws
  /// Stopped.
  std::vector<std::pair<double, double>> evidence_along(const SystematicErrorEstimate& constant, const Stop& stop);
  const std::vector<SensorConstant>& sensor_constants() const {
    return std::visit([](const auto& p) -> const std::vector<SensorConstant>& { return p.constants; }, built_);
  }
  /// Returns whether the named constant belongs to one of the chaser's own sensors.
  bool is_own(const std::string& constant) const;
  Problem& problem() {
    return std::visit([](auto& p) -> Problem& { return p.problem; }, built_);
  }

 private:
  template <class Sensors, class Placed>
  void record_unmeasured(const Sensors& sensors, const Placed& placed);
  void add_target(const Scenario& scenario, const TrackingOptions& options, const TrackingProblem& built);
  void add_own(const NavigationData& data, const std::vector<PlacedEgoMeasurement>& placed);

  std::vector<std::string> own_sensors_;
  std::variant<TrackingProblem, NavigationProblem> built_;
};

using CalibrationProblems = std::vector<std::unique_ptr<CalibrationProblem>>;

/// Returns the noise entries of a scenario that can be calibrated, sensors first.
std::vector<CalibratedEntry> calibrated_entries(const Scenario& scenario);

}  // namespace tandem

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

/// An entry of a scenario's noise whose rows stand in its problem.
struct CalibratedEntry {
  std::string name;                     ///< of a sensor, or of another entry: "usbl", "constant_twist"
  std::string kind;                     ///< of the sensor, "" of other entries: what has to agree between scenarios
  std::vector<std::string> components;  ///< "x", "roll", "range", …; "" where there is one alone
  std::vector<bool> angle;              ///< of each, whether it is one [rad]
  std::vector<double> sigmas;           ///< as given, in the axes of the scenario's files, as components are
  std::vector<int> row;                 ///< of each component, its place among the entry's rows in the problem
  bool sensor = false;
  /// Of the chaser's own, what its position rests on between fixes: an error that stays would be in this noise alone.
  bool carries = false;

  /// "usbl.x", or "depth" where there is one component alone.
  std::string parameter(std::size_t component) const;
};

/// A block whose row i has the standard deviation of its entry's row (first + i) mod their number.
struct EntryBlock {
  std::size_t entry;
  Block block;
  int first = 0;
  std::optional<double> measured_at = {};  ///< s, of a measurement
  double share = 1;                        ///< of a datum, that its rows are (NoiseRows), or
  int shared = -1;                         ///< so many of the first of them; the rest are data of their own
  bool whole = true;                       ///< false: another block of the same measurement says more
};

/// The problem of one scenario, and which noise its blocks have.
class CalibrationProblem {
 public:
  /// With a target: as make_tracking_problem, a chaser that moves by its own sensors navigated first; else the chaser's
  /// own problem, from where navigate() has led. Throws Error as these do, and Stopped when it is to stop.
  CalibrationProblem(Scenario scenario, const TrackingOptions& target, const NavigationOptions& own,
                     const Stop& stop = {});

  std::string scenario;
  std::vector<CalibratedEntry> entries;
  std::vector<EntryBlock> blocks;
  /// Of the chaser's position, the recording's ends included [s]; 0: it does not navigate.
  double longest_without_fix = 0;
  /// Sensors with errors that stay of which nothing is measured.
  std::vector<std::string> without_measurements{};

  /// Of sensors with errors that stay, at the problem's values. Throws Error where they have no covariance, and
  /// Stopped.
  std::vector<FoundConstant> constants(const Stop& stop);
  /// CalibratedConstant::profile; none where it has several rows, or there are hard constraints. Throws Stopped.
  std::vector<std::pair<double, double>> evidence_along(const FoundConstant& constant, const Stop& stop);
  const std::vector<SensorConstant>& sensor_constants() const {
    return std::visit([](const auto& p) -> const std::vector<SensorConstant>& { return p.constants; }, built_);
  }
  /// Whether a constant, by its name, is one of the chaser's own sensors.
  bool is_own(const std::string& constant) const;
  Problem& problem() {
    return std::visit([](auto& p) -> Problem& { return p.problem; }, built_);
  }

 private:
  template <class Sensors, class Placed>
  void note_unmeasured(const Sensors& sensors, const Placed& placed);
  void add_target(const Scenario& scenario, const TrackingOptions& options, const TrackingProblem& built);
  void add_own(const NavigationData& data, const std::vector<PlacedEgoMeasurement>& placed);

  std::vector<std::string> own_sensors_;  // that measure

  std::variant<TrackingProblem, NavigationProblem> built_;
};

using CalibrationProblems = std::vector<std::unique_ptr<CalibrationProblem>>;

/// The entries of a scenario's noise that calibration knows, sensors' first; of a scenario that is not built yet, too.
std::vector<CalibratedEntry> calibrated_entries(const Scenario& scenario);

}  // namespace tandem

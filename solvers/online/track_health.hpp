#pragma once

#include <cmath>
#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/lie/types.hpp>
#include <tandem/solvers/online/shift_detector.hpp>
#include <tandem/solvers/residual_series.hpp>

namespace tandem {

/// Thresholds for rejecting measurements and for resetting an online estimator. Times are in seconds of the data.
struct ResetOptions {
  /// A measurement is rejected if its innovation exceeds this many standard deviations in any row; for a pose, in any
  /// row of the position. Infinite: uses all finite measurements.
  double gate = 5.0;
  /// The estimate is reset to a sensor that contradicts it: if at least `rejections` of its last `rejection_window`
  /// measurements were rejected, over at least `reset_after`, and no other sensor that can show the error was used
  /// meanwhile. After 30 s without a used measurement, only sensors of the same quantity count.
  int rejection_window = 4, rejections = 3;
  double reset_after = 7.0;
  /// After a longer gap in the measurements, the estimate is suspended until the next one.
  double max_gap = 60.0;
  double unconverged_after = 30.0;  ///< The estimate is reset after at least 10 unconverged updates over this time.
  // For OutputHealth:
  double lost_after = 20.0;     ///< An output is lost after a longer gap in the used measurements.
  double invalid_after = 40.0;  ///< An output is invalid after a longer gap, or this time without a converged update.

  /// Returns options that use all finite measurements, never reset and report all outputs as aided.
  static ResetOptions never() {
    return {.gate = HUGE_VAL,
            .reset_after = HUGE_VAL,
            .max_gap = HUGE_VAL,
            .unconverged_after = HUGE_VAL,
            .lost_after = HUGE_VAL,
            .invalid_after = HUGE_VAL};
  }
};

/// Throws Error on invalid options.
void check(const ResetOptions& options);

/// Counts of one sensor's measurements since the start.
struct SensorHealth {
  std::string name;
  std::size_t used = 0, rejected = 0;  ///< inside and outside the gate
  std::size_t rejected_in_a_row = 0;
  std::optional<double> last_received, last_used;  ///< time of the newest measurement received, and used [s]
  std::optional<double> sigmas;                    ///< normalised innovation of the newest; empty if unknown
  /// Sum of the NIS of the used measurements whose innovation has a covariance, and the number of their rows.
  double nis = 0;
  std::size_t nis_rows = 0;
  /// Used measurements whose NIS the robust loss gives a weight below kDownweightThreshold, and their expected number.
  std::size_t down_weighted = 0;
  double expected_down_weighted = 0;
  /// Standardised innovations νᵢ / √Sᵢᵢ of the used measurements that are not down-weighted, by row.
  std::vector<ResidualMoments> innovations{};
  std::vector<WorstMeasurement> worst{};  ///< at most five used measurements, that with the largest innovation first
};

/// Reliability of the newest state.
enum class OutputState {
  none,     ///< no state
  aided,    ///< recent measurements were used
  lost,     ///< no recent measurement: dead reckoning or prediction
  invalid,  ///< lost for too long, or updates do not converge: do not use
  /// Recent measurements were used, but the estimate was reset to a sensor that contradicted it, and no other sensor
  /// has confirmed this one since. Or a position, height or heading comes from a single sensor that now contradicts it.
  /// Or the innovations of a used sensor have shifted.
  unconfirmed,
};

/// Returns "none", "aided", "lost", "invalid" or "unconfirmed".
std::string_view name(OutputState state);

struct OutputHealth {
  OutputState state = OutputState::none;
  /// Time since the last aiding measurement [s]. Odometry, GPS and DVL aid the chaser, but not depth or heading alone.
  /// Any sensor aids the target. Rejected measurements do not count.
  double age = 0;
  /// Whether recent measurements of at least two sensors, the IMU included, agree, so that each shows gross errors of
  /// the other. Odometry has no other sensor.
  bool confirmed = false;
};

struct TrackHealth {
  OutputHealth chaser, target;
  std::vector<SensorHealth> sensors;        ///< first those of the chaser, then those of the target
  std::size_t resets = 0;                   ///< resets, without suspensions
  std::size_t suspensions = 0;              ///< resets because of missing measurements
  bool converged = true;                    ///< whether the last update converged
  std::optional<double> unconverged_since;  ///< start of the current run of unconverged updates [s]
};

/// A reset of the estimate.
struct TrackReset {
  enum class Kind {
    contradicted,  ///< by a sensor that was rejected repeatedly, or by a jump of the odometry
    unconverged,   ///< the window did not converge
    suspended,     ///< measurements are missing
    time_reset,    ///< OnlineEstimator::reset()
  };
  Kind kind;
  double t;         ///< newest keyframe [s]
  std::string why;  ///< one sentence
};

namespace detail {

/// The innovation ν of a measurement, normalised by its covariance S.
struct NormalizedInnovation {
  std::optional<double> sigmas{};     ///< largest |νᵢ| / √Sᵢᵢ; empty without a covariance
  double nis = 0;                     ///< νᵀ S⁻¹ ν
  std::size_t rows = 0;               ///< rows of ν; 0 without a covariance
  Eigen::VectorXd standardised{};     ///< νᵢ / √Sᵢᵢ; empty without a finite one
  bool down_weighted = false;         ///< the robust loss gives the NIS a weight below kDownweightThreshold
  double expected_down_weighted = 0;  ///< probability of that if the noise is as stated
};

/// Tracks the health of an OnlineEstimator and decides when to reset it.
class HealthMonitor {
 public:
  /// A sensor and the quantity that it measures. A used measurement of one sensor confirms the estimate against the
  /// others with the same subject, and against those that count its subject as confirming.
  struct Sensor {
    std::string name;
    int subject;
    unsigned confirmed_by = 0;  ///< bits of other subjects
    /// Whether it measures a position, height or orientation. Sensors of motion do not show which of its values are
    /// right if it jumps.
    bool absolute = false;
  };
  HealthMonitor(const std::vector<Sensor>& sensors, const ResetOptions& options);

  const TrackHealth& health() const { return health_; }

  // t: time at which the measurement was valid [s].
  void received(std::size_t sensor, double t);
  /// Returns a shift of the sensor's innovations when it becomes significant.
  std::optional<InnovationShift> used(std::size_t sensor, double t, const NormalizedInnovation& innovation);
  void rejected(std::size_t sensor, double t, double sigmas);
  /// Returns the time since which a sensor contradicts the estimate [s], or nothing.
  std::optional<double> contradicting_since(std::size_t sensor) const;
  /// Returns whether the estimate must be reset to a sensor that contradicts it. This is not the case if another sensor
  /// confirms the estimate: a sensor that was used before and now contradicts the others is wrong, no matter how long.
  /// Only sensors of the same subject count after an absence of the sensor, since the estimate had no measurement of
  /// this kind, and if the sensor outvotes its first measurements: more of them were rejected in a row, by a constant
  /// amount, than were used at all, and these were the first ones.
  bool must_reset_to(std::size_t sensor) const;

  /// Returns the time since which sensors of at least two subjects have contradicted the estimate without a break [s],
  /// or nothing. Only rejections within ResetOptions::reset_after before t [s] count.
  std::optional<double> all_contradicting_since(double t) const;
  /// Returns the names of the sensors that contradict the estimate now, e.g. "depth and dvl".
  std::string contradicting_sensors(double t) const;

  /// Must be called before a reset to a sensor that contradicts the estimate. Until another sensor confirms it, the
  /// output that it aids is unconfirmed. After an absence, the output is aided without confirmation, as at the start.
  void adopt(std::size_t sensor);

  void updated(double t, bool converged);
  /// Returns whether the window has not converged for too long at time t [s].
  bool is_stuck(double t) const;

  /// Updates the output states at time t [s], from the times when chaser and target were last aided (empty: no state).
  void update_outputs(double t, std::optional<double> chaser_aided, std::optional<double> target_aided);
  /// States whether the outputs are confirmed; call it after update_outputs().
  void set_confirmed(bool chaser, bool target);
  /// Returns whether the newest measurement of the sensor was used, and is within ResetOptions::lost_after before t
  /// [s].
  bool agrees(std::size_t sensor, double t) const;
  /// Returns the other sensors of the same subject that agree with the estimate, e.g. "optical and sonar".
  std::string other_agreeing_sensors(std::size_t sensor, double t) const;

  /// Returns the time of the last used measurement of sensors first to last − 1 [s]; −∞ if there is none.
  double last_used(std::size_t first, std::size_t last) const;

  /// Counts a reset and forgets the rejections of the old estimate. Other counts stay.
  void record_reset(TrackReset::Kind kind);
  /// Forgets all times, because the time base changes.
  void forget_times();
  /// Restores counts and times from another monitor of the same sensors; rejections of the current estimate stay.
  void restore(const TrackHealth& health) {
    if (health.sensors.size() != health_.sensors.size())
      throw BadInputError("health monitor: the checkpoint has a different number of sensors");
    health_ = health;
  }

 private:
  struct Verdict {
    double t;
    bool rejected;
  };
  bool contradicts(std::size_t sensor, double t) const;
  template <class F>
  std::string names(F chosen) const {
    std::string all;
    for (std::size_t i = 0; i < sensors_.size(); ++i)
      if (chosen(i)) all += (all.empty() ? "" : " and ") + sensors_[i].name;
    return all;
  }
  void add_verdict(std::size_t sensor, double t, bool rejected);
  OutputHealth output(double t, std::optional<double> aided, bool of_target);

  ResetOptions options_;
  /// Returns whether another sensor, or only one of the same subject, confirms the estimate against this one since
  /// time t [s].
  bool is_confirmed(std::size_t sensor, double t, bool only_same) const;

  struct Adopted {
    std::size_t sensor;
    double t;  // s
  };
  /// Returns whether the first measurements of the sensor were probably wrong.
  bool outvotes_its_start(std::size_t sensor) const;
  /// Returns whether an own sensor contradicts measurements of itself that alone determine a position, height or
  /// orientation.
  bool is_disputed(double t) const;
  /// Returns whether the innovations of a recent sensor of the chaser, or of the target, have shifted.
  bool is_shifted(double t, bool of_target) const;

  /// Innovations of the measurements rejected in a row [standard deviations]. Those of one wrong offset change slowly,
  /// and do not grow, since the standard deviations grow without measurements.
  struct Offset {
    double least = 0;
    bool constant = true;
  };
  std::optional<Adopted> adopted_[2];  // by the chaser and by the target
  std::vector<Sensor> sensors_;
  std::vector<std::optional<double>>
      rejected_since_;                             // per sensor: first rejection after the last used measurement [s]
  std::vector<std::optional<double>> first_used_;  // per sensor [s]
  std::vector<Offset> rejected_by_;                // per sensor
  std::vector<ShiftDetector> shifts_;              // per sensor
  std::vector<std::deque<Verdict>> verdicts_;      // per sensor: the last rejection_window, or those within reset_after
  TrackHealth health_;
  std::size_t unconverged_ = 0;  // successive unconverged updates
};

}  // namespace detail
}  // namespace tandem

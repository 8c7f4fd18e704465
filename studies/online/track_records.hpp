#pragma once

#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/solvers/online/track_health.hpp>

namespace tandem {

/// Health of one sensor at an update; see SensorHealth.
struct SensorRecord {
  std::size_t used = 0, rejected = 0;  ///< numbers of measurements so far
  std::optional<double> sigmas{};      ///< innovation of the newest measurement in standard deviations
  std::optional<double> age{};         ///< time from the last used measurement to the newest keyframe [s]
  std::optional<double> nis{};         ///< mean NIS per row of the used measurements so far; 1 if consistent
};

/// Health of a track at an update; see TrackHealth.
struct RecordHealth {
  bool converged = true;
  std::size_t resets = 0, suspensions = 0;
  std::vector<SensorRecord> sensors{};
  OutputHealth chaser{}, target{};

  std::size_t rejected() const {
    std::size_t n = 0;
    for (const SensorRecord& sensor : sensors) n += sensor.rejected;
    return n;
  }
};

/// Returns the names of the sensors in a record's health, in order.
std::vector<std::string> sensor_names(const TrackHealth& health);

/// Estimate and health after one update, in ENU-FLU.
struct TrackRecord {
  double t;  ///< time of the newest keyframe [s]
  KeyframeType type;
  bool new_keyframe;                  ///< whether a keyframe was added; else a late measurement caused the update
  double seconds, processor_seconds;  ///< duration of the update: wall clock and processor time
  std::optional<double> memory;       ///< resident memory [MB], once per second of data
  std::size_t keyframes;              ///< number of keyframes in the window

  SE3 chaser{};
  Vector<3> chaser_velocity = Vector<3>::Zero();                  ///< in the world [m/s]; zero if it moves by odometry
  std::optional<double> chaser_sigma{}, chaser_rotation_sigma{};  ///< roots of the summed variances [m, rad]

  std::optional<TargetState> target{};
  Vector<3> target_velocity = Vector<3>::Zero();  ///< in the world [m/s]
  std::optional<Matrix<3, 3>> covariance{};       ///< of relative(), along the chaser's axes [m²]
  std::optional<Vector<3>> measured{};            ///< measured position of the target at t, in the chaser's body [m]
  std::optional<SO3> measured_rotation{};         ///< measured orientation, likewise
  RecordHealth health{};
  std::vector<std::optional<RelativeTarget>> ahead{};  ///< predicted target in the chaser's body at t, per horizon

  /// Known while the update is reported, but not stored in files of records.
  struct Reported {
    Vector<6> chaser_twist = Vector<6>::Zero();  ///< over the last second, in the chaser's body [m/s, rad/s]
    std::optional<Vector<6>> target_twist{};     ///< likewise in the target's body, if it has an orientation
    Eigen::MatrixXd covariance{};  ///< joint, of [chaser; target], right perturbations; empty after a failed update
    Eigen::Index chaser_rows = 0;  ///< rows of the chaser in it
    /// The target of the window, to which the covariance belongs, if motion hypotheses give the newest state instead.
    std::optional<TargetState> window_target{};
    std::optional<Vector<6>> window_twist{};  ///< of that target, if it has an orientation [m/s, rad/s]
  } reported{};

  /// Returns the position of the target in the chaser's body, t(C⁻¹T) [m]; requires a target.
  Vector<3> relative() const { return chaser.inverse().act(target->position); }
};

/// Returns the standard deviations along the axes of a covariance; zero for a negative variance.
inline Vector<3> sigmas(const Matrix<3, 3>& covariance) { return covariance.diagonal().cwiseMax(0).cwiseSqrt(); }

/// Serialises a record. The size depends only on the numbers of predictions and sensors.
std::string bytes_of(const TrackRecord& record);
/// Returns the size of a record with `ahead` predictions and `sensors` sensors [bytes].
std::size_t record_bytes(std::size_t ahead, std::size_t sensors);

/// Sequence of records in a temporary file, which is deleted with this object. Memory does not grow with its length.
class TrackRecords {
 public:
  /// `ahead` is the number of predictions of each record. Throws Error if the file cannot be created.
  explicit TrackRecords(std::size_t ahead);

  /// Appends a record, with the same number of sensors as all others.
  void add(const TrackRecord& record);
  /// Appends the first `n` records of a file that bytes_of() wrote, each with `sensors` sensors; call it before add().
  /// Throws Error if the file has fewer records.
  void load(const std::filesystem::path& file, std::size_t n, std::size_t sensors);
  std::size_t size() const { return size_; }
  /// Calls f with each record in order. Throws Error if the file cannot be read.
  void each(const std::function<void(const TrackRecord&)>& f) const;

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void write();

  std::size_t ahead_, size_ = 0, sensors_ = 0;
  std::unique_ptr<std::FILE, Close> file_;
  std::vector<double> buffer_;
};

}  // namespace tandem

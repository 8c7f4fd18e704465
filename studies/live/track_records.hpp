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

/// How one sensor's measurements have fared by an update: see SensorHealth.
struct SensorRecord {
  std::size_t used = 0, rejected = 0;
  std::optional<double> sigmas{};  ///< innovation of the newest, in standard deviations
  std::optional<double> age{};     ///< s, from the last that was used to the newest keyframe
};

/// See TrackHealth.
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

/// Of the sensors in a record's health.
std::vector<std::string> sensor_names(const TrackHealth& health);

/// What tracking had to say after one update; everything in ENU-FLU.
struct TrackRecord {
  double t;  ///< s, of the newest keyframe
  KeyframeType type;
  bool new_keyframe;                  ///< else a late measurement
  double seconds, processor_seconds;  ///< that the update took
  std::optional<double> memory;       ///< MB, once a second of data
  std::size_t keyframes;              ///< in the window

  SE3 chaser{};
  Vector<3> chaser_velocity = Vector<3>::Zero();                  ///< m/s, world; by its own sensors only
  std::optional<double> chaser_sigma{}, chaser_rotation_sigma{};  ///< m, rad: roots of the summed variances

  std::optional<TargetState> target{};
  Vector<3> target_velocity = Vector<3>::Zero();  ///< m/s, world
  std::optional<Matrix<3, 3>> covariance{};       ///< m², of relative() along the chaser's axes
  std::optional<Vector<3>> measured{};            ///< m: position of the target in the chaser's body, as measured here
  std::optional<SO3> measured_rotation{};         ///< likewise
  RecordHealth health{};
  std::vector<std::optional<RelativeTarget>> ahead{};  ///< where the target will be, seen from the chaser of now

  /// t(C⁻¹T) [m]; only with a target.
  Vector<3> relative() const { return chaser.inverse().act(target->position); }
};

/// Standard deviations along the axes of a covariance.
inline Vector<3> sigmas(const Matrix<3, 3>& covariance) { return covariance.diagonal().cwiseMax(0).cwiseSqrt(); }

/// A record as TrackRecords keeps it; as many bytes for each of as many predictions and sensors.
std::string bytes_of(const TrackRecord& record);
std::size_t record_bytes(std::size_t ahead, std::size_t sensors);

/// Records in a temporary file that is gone with this object, so that a long run takes no more memory than a short one.
class TrackRecords {
 public:
  /// `ahead`: how many predictions each record has. Throws Error when there is no room for the file.
  explicit TrackRecords(std::size_t ahead);

  /// Each of as many predictions and sensors as the first.
  void add(const TrackRecord& record);
  /// Before all others, the first `n` out of a file of bytes_of() those, of so many sensors each. Throws Error.
  void load(const std::filesystem::path& file, std::size_t n, std::size_t sensors);
  std::size_t size() const { return size_; }
  /// Calls f with each in turn. Throws Error when the file cannot be read back.
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

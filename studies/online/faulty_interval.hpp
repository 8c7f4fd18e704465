#pragma once

#include <optional>

#include <tandem/studies/online/track_records.hpp>

namespace tandem {

/// Detects intervals in which a track is unreliable: no update converges, or the gate rejects every measurement.
class FaultyIntervalDetector {
 public:
  /// Ignores intervals shorter than `min_duration` [s].
  explicit FaultyIntervalDetector(double min_duration) : min_duration_(min_duration) {}

  struct Interval {
    double since, until;  ///< first and last faulty update [s]
    bool ongoing;         ///< whether it includes the last update
  };

  /// Processes the health after an update at time t [s].
  void updated(double t, const RecordHealth& health);
  /// Returns the longest faulty interval, or nothing if none was long enough.
  std::optional<Interval> longest() const;

  /// Internal state, which restore() transfers to another detector.
  struct Checkpoint {
    std::size_t used = 0, rejected = 0;  ///< counts of measurements at the last update, all sensors
    bool rejecting = false;              ///< whether no measurement was used since the last rejection
    std::optional<Interval> now{}, longest{};
  };
  const Checkpoint& checkpoint() const { return state_; }
  void restore(const Checkpoint& checkpoint) { state_ = checkpoint; }

 private:
  double min_duration_;
  Checkpoint state_;
};

}  // namespace tandem

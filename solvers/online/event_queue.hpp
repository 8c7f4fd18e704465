#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include <tandem/problem/navigation/navigation_data.hpp>
#include <tandem/problem/tracking/target_sensor.hpp>

namespace tandem::detail {

/// A measurement of one of the chaser's own sensors, or of a sensor that observes the target.
struct OnlineEvent {
  std::size_t sensor;
  std::variant<EgoMeasurement, Measurement> measurement;

  bool of_target() const { return std::holds_alternative<Measurement>(measurement); }
};

/// A queue of measurements, ordered by the time at which they were valid, and a clock: the latest stamp of all streams.
class EventQueue {
 public:
  /// `max_ahead` [s]: a stamp further ahead of the clock must be confirmed by a second one.
  explicit EventQueue(double max_ahead) : max_ahead_(max_ahead) {}

  /// Checks the stamp of a new measurement. Returns the reason if it cannot be used: the stamp is not finite, or too
  /// far ahead of the clock while `started`. A single wrong stamp must not advance the estimate, so two successive
  /// stamps far ahead but close to each other are needed.
  std::optional<std::string> why_invalid_stamp(const std::string& name, double stamp, bool started);
  void advance(double stamp) { clock_ = std::max(clock_, stamp); }
  /// Returns the latest stamp [s]; −∞ before the first.
  double clock() const { return clock_; }

  void push(double valid, OnlineEvent event) { pending_.emplace(valid, std::move(event)); }
  struct Next {
    double t;  ///< time at which the measurement was valid [s]
    bool of_target;
  };
  /// Returns the earliest event. At equal times, measurements of the target come first, since they create the keyframe
  /// that the chaser's measurements attach to. The order of arrival then has no effect.
  std::optional<Next> next() const;
  /// Removes and returns the event of next(). The queue must not be empty.
  std::pair<double, OnlineEvent> take();
  void drop_before(double t);

 private:
  using Pending = std::multimap<double, OnlineEvent>;
  Pending::const_iterator first() const;

  double max_ahead_;
  double clock_ = -HUGE_VAL;
  std::optional<double> ahead_;  // the last stamp, if it was too far ahead
  Pending pending_;
};

/// Formats a time for the messages of the online estimator: "12.500000 s".
std::string seconds_text(double t);

}  // namespace tandem::detail

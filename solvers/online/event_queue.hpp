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

/// A measurement of one of the chaser's own sensors, or of one that observes the target.
struct OnlineEvent {
  std::size_t sensor;
  std::variant<EgoMeasurement, Measurement> measurement;

  bool of_target() const { return std::holds_alternative<Measurement>(measurement); }
};

/// Measurements that wait for their turn, by the time when they were valid, and the clock of all lines that came.
class EventQueue {
 public:
  /// `far` [s]: a stamp that is later than all others by more than this is not believed at once.
  explicit EventQueue(double far) : far_(far) {}

  /// A line stamped so has come. Returns why it cannot be used, a sentence: the stamp is not finite, or far ahead of all
  /// others (where some have been used). One wrong stamp must not carry the estimate off to its time: it takes a second
  /// line near it.
  std::optional<std::string> why_not_at(const std::string& name, double stamp, bool started);
  void advance(double stamp) { clock_ = std::max(clock_, stamp); }
  /// The latest stamp [s]; −∞ before the first.
  double clock() const { return clock_; }

  void push(double valid, OnlineEvent event) { pending_.emplace(valid, std::move(event)); }
  struct Next {
    double t;  ///< s, when it was valid
    bool of_target;
  };
  /// The earliest. Of one instant, the target's measurements come first: they make the keyframe that the chaser's own
  /// join, so that the order in which the lines came makes no difference.
  std::optional<Next> next() const;
  /// Takes out what next() is; there is one.
  std::pair<double, OnlineEvent> take();
  void drop_before(double t);

 private:
  using Pending = std::multimap<double, OnlineEvent>;
  Pending::const_iterator first() const;

  double far_;
  double clock_ = -HUGE_VAL;
  std::optional<double> ahead_;  // the stamp of a line that was far ahead of all others
  Pending pending_;
};

/// "12.500000 s", as all sentences of the online estimator write a time.
std::string seconds_text(double t);

}  // namespace tandem::detail

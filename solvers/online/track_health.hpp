#pragma once

#include <cmath>
#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/lie/error.hpp>

namespace tandem {

/// When an online estimator stops to believe a measurement, or itself. Times are of the data [s].
struct ResetOptions {
  /// A measurement whose innovation is more than this many of its own standard deviations is not used: per row, of a
  /// pose by its position. Infinite: all that are finite are.
  double gate = 5.0;
  /// So many of a sensor's last measurements rejected, over `reset_after` or longer, while no other sensor of the same
  /// thing was used: a new truth, the estimate begins anew from it.
  int rejected_of = 4, rejections = 3;
  double reset_after = 7.0;
  double max_gap = 60.0;            ///< without a measurement for longer, the estimate is suspended until the next one
  double unconverged_after = 30.0;  ///< updates that end unconverged for so long, ten or more: begins anew
  // What is told of an output meanwhile (OutputHealth):
  double lost_after = 20.0;     ///< without a measurement for longer, its aiding is lost
  double invalid_after = 40.0;  ///< likewise, or with no update that converged, it is invalid

  /// All that is a finite number is used, and the estimate kept and called good.
  static ResetOptions never() {
    return {.gate = HUGE_VAL,
            .reset_after = HUGE_VAL,
            .max_gap = HUGE_VAL,
            .unconverged_after = HUGE_VAL,
            .lost_after = HUGE_VAL,
            .invalid_after = HUGE_VAL};
  }
};

/// Throws Error on values that cannot work.
void check(const ResetOptions& options);

/// How the measurements of one sensor have fared since the start.
struct SensorHealth {
  std::string name;
  std::size_t used = 0, rejected = 0;  ///< by the gate
  std::size_t rejected_in_a_row = 0;
  std::optional<double> heard, last_used;  ///< s, when the newest was valid that came, and that was used
  std::optional<double> sigmas;            ///< innovation of the newest, in standard deviations; none while it has none
};

/// How far the newest state is to be relied on.
enum class OutputState {
  none,     ///< there is none
  aided,    ///< by measurements that are used
  lost,     ///< aiding is lost: dead reckoned, predicted
  invalid,  ///< for too long, or no update converges: not to be used
};

/// "none", "aided", "lost", "invalid".
std::string_view name(OutputState state);

struct OutputHealth {
  OutputState state = OutputState::none;
  /// s of data since it was aided last: the chaser by odometry, or by a sensor that measures where it is or how fast it moves
  /// (gps, DVL; not depth or heading alone); the target by any sensor. What was rejected aids nothing.
  double age = 0;
};

struct TrackHealth {
  OutputHealth chaser, target;
  std::vector<SensorHealth> sensors;        ///< the chaser's own, then those of the target
  std::size_t resets = 0;                   ///< to a new truth, or out of a window that did not converge
  std::size_t suspensions = 0;              ///< for want of measurements
  bool converged = true;                    ///< at the last update
  std::optional<double> unconverged_since;  ///< s, of the run of unconverged updates that the last one is in
};

/// An estimate that was given up.
struct TrackReset {
  enum class Kind { new_truth, unconverged, suspended, begun_anew };
  Kind kind;
  double t;         ///< s
  std::string why;  ///< a sentence
};

namespace detail {

/// Keeps an OnlineEstimator's health and says when it is to begin anew.
class HealthMonitor {
 public:
  /// A sensor and what it measures: sensors of one subject confirm one another.
  struct Sensor {
    std::string name;
    int subject;
  };
  HealthMonitor(const std::vector<Sensor>& sensors, const ResetOptions& options);

  const TrackHealth& health() const { return health_; }

  // t: s, when the measurement was valid.
  void heard(std::size_t sensor, double t);
  void used(std::size_t sensor, double t, std::optional<double> sigmas);
  void rejected(std::size_t sensor, double t, double sigmas);
  /// Whether what this sensor says is to be believed in place of the estimate.
  bool is_new_truth(std::size_t sensor) const;

  void updated(double t, bool converged);
  /// Whether the window has been unconverged for too long.
  bool is_stuck(double t) const;

  /// It is t; when chaser and target were aided last [s], nothing where there is none.
  void at(double t, std::optional<double> chaser_aided, std::optional<double> target_aided);

  /// When the last measurement of these sensors was used [s]; −∞ before the first.
  double last_used(std::size_t first, std::size_t last) const;

  /// It begins anew: what was held against the old estimate is forgotten, counts are not.
  void restarted(TrackReset::Kind kind);
  /// Time begins anew: when something was is forgotten too.
  void forget_times();
  /// Counts and times go on from these, of the same sensors; what is held against the estimate stays.
  void go_on_from(const TrackHealth& health) {
    if (health.sensors.size() != health_.sensors.size()) throw Error("the health is of other sensors");
    health_ = health;
  }

 private:
  struct Verdict {
    double t;
    bool rejected;
  };
  void judge(std::size_t sensor, double t, bool rejected);
  OutputHealth output(double t, std::optional<double> aided) const;

  ResetOptions options_;
  std::vector<int> subject_;
  std::vector<std::deque<Verdict>> verdicts_;  // of each sensor, the last rejected_of or those of reset_after
  TrackHealth health_;
  std::size_t unconverged_ = 0;  // updates in a row
};

}  // namespace detail
}  // namespace tandem

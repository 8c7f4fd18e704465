#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace tandem {

/// Tolerances for time stamps, in seconds of the common time.
struct ClockOptions {
  double max_lead = 2.0;  ///< lines further ahead of the common time are held; at least five periods of the motion
  double max_lag = 60.0;  ///< lines further behind the common time are held
  /// Held lines are evidence of a clock step once at least `confirm_lines` successive ones of their stream continue at
  /// the pace of the common time over at least `confirm_time`. Two lines suffice up to `max_lag` ahead of the common
  /// time: the motion lags.
  std::size_t confirm_lines = 5;
  double confirm_time = 3.0;
  double max_pause = 86400;   ///< a longer jump of all streams is a clock step, a shorter one a pause
  double settling_time = 10;  ///< if the motion jumps back while the common time is younger, it is reset
};

/// Synchronises the clocks of several streams, line by line, to a common time in seconds. Detects stamps in milli-,
/// micro- or nanoseconds. Stamps are used as long as they are consistent within their stream: lines may be late by up
/// to `max_lag`, also in disorder. If the clock of a stream steps, its lines are timed by arrival until its stamps
/// agree with the others again. A stamp far from the common time is held until later lines of its stream confirm or
/// contradict it, so a single wrong stamp costs only its own line.
class StreamClocks {
 public:
  struct Stream {
    std::string name;
    bool may_repeat;            ///< whether several lines may have the same stamp
    bool motion;                ///< whether it is the motion of the chaser, the reference for the other streams
    double longest_period = 5;  ///< a motion with a longer period has stamps in another unit than seconds [s]
  };
  explicit StreamClocks(std::vector<Stream> streams, const ClockOptions& options = {});

  /// Called with a sentence about each finding, e.g. a clock step.
  std::function<void(const std::string&)> on_notice;

  enum class Verdict {
    use,       ///< use the line at time(), which may be before that of earlier lines
    wait,      ///< keep this and all following lines until is_ready(), then classify them
    hold,      ///< keep the line until its stream is in released() or dropped()
    repeated,  ///< discard the line: the same stamp as the last one
    invalid,   ///< discard the line: the stamp is not finite
  };
  /// Classifies the next line of a stream by its stamp.
  Verdict classify(std::size_t stream, double stamp);
  /// Converts a stamp to the common time [s].
  double time(std::size_t stream, double stamp) const;

  /// Returns whether the unit of the stamps is known.
  bool is_ready() const { return ready_; }
  /// Sets the unit of the stamps [s] instead of detecting it.
  void set_unit(double seconds);
  /// Ends the detection of the unit, because no more lines will arrive.
  void finish() { ready_ = true; }

  // The decisions of the last classify() about held lines, including the classified one.

  struct Dropped {
    std::size_t stream, lines;
  };
  /// Returns how many of the oldest held lines of a stream must be discarded.
  const std::vector<Dropped>& dropped() const { return dropped_; }
  /// Returns the streams whose held lines must be used now.
  const std::vector<std::size_t>& released() const { return released_; }
  /// Returns whether the common time was reset, so that it may run backwards.
  bool time_was_reset() const { return time_was_reset_; }

  /// The state of a stream's clock. The time of a stamp is stamp · unit + offset.
  struct Clock {
    double unit = 1, offset = 0;   ///< s
    std::optional<double> last{};  ///< time of the last used line [s]
    double period = 0, lag = 0;    ///< time between its lines, and lag behind the common time [s]
    int agreeing = 0;              ///< number of successive lines that agree without the offset
  };
  /// The state of all clocks, without held lines.
  struct Checkpoint {
    double clock = -HUGE_VAL, base = -HUGE_VAL;  ///< common time and its start [s]
    std::vector<Clock> streams{};
  };
  Checkpoint checkpoint() const;
  /// Restores a checkpoint of the same streams and discards held lines. Throws Error if the number of streams differs.
  void restore(const Checkpoint& checkpoint);

 private:
  struct Held {
    double stamp, clock;  // clock: common time at its arrival
  };
  struct State : Clock {
    std::vector<Held> held{};
    double motion = -HUGE_VAL;  // time of the motion at the arrival of the last line [s]
  };

  bool find_unit(std::size_t stream, double stamp);
  double max_lead() const;
  bool agrees(const State& s, double t) const;
  bool agrees_again(State& s, double stamp) const;
  bool continues(const Held& before, double stamp) const;
  bool is_confirmed(std::size_t stream, double unit) const;
  void hold(std::size_t stream, double stamp);
  bool adopt_offset(std::size_t stream);
  void confirm_shift(std::size_t stream, double unit);
  void release_consistent();
  void release(std::size_t stream);
  void drop(std::size_t stream, std::size_t lines);
  void use(std::size_t stream, double t);
  void notice(const std::string& text) const {
    if (on_notice) on_notice(text);
  }

  std::vector<Stream> streams_;
  ClockOptions options_;
  std::vector<State> states_;
  bool ready_ = false;
  std::size_t waiting_ = 0;
  std::size_t first_motion_ = 0;
  std::vector<double> first_stamps_;  // first stamps of the stream first_motion_
  double clock_ = -HUGE_VAL, base_ = -HUGE_VAL;
  double motion_ = -HUGE_VAL;  // newest time of the motion [s]
  std::vector<Dropped> dropped_;
  std::vector<std::size_t> released_;
  bool time_was_reset_ = false;
};

}  // namespace tandem

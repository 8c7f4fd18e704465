#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace tandem {

/// Tolerances for time stamps, in seconds of the common time.
struct ClockOptions {
  double max_lead = 2.0;      ///< Lines further ahead of the common time are held; at least five periods of the motion.
  double max_lag = 60.0;      ///< Lines further behind the common time are held.
  double confirm_time = 1.0;  ///< Held lines are released once at least two of them continue over this time.
  double max_pause = 86400;   ///< A longer jump of all streams is a clock step, a shorter one a pause.
  double settling_time = 10;  ///< A jump back of the motion within this time resets the common time.
};

/// Synchronises the clocks of several streams, line by line, to a common time in seconds. Detects stamps in milli-,
/// micro- or nanoseconds. If the clock of a stream steps, its lines are timed by arrival until its stamps agree with
/// the others again. A stamp far from the common time is held until later lines of its stream confirm or contradict it,
/// so a single wrong stamp costs only its own line.
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
    use,             ///< Use the line at time().
    wait,            ///< Keep this and all following lines until is_ready(), then classify them.
    hold,            ///< Keep the line until its stream is in released() or dropped().
    not_increasing,  ///< Discard the line: earlier than the last one of its stream.
    repeated,        ///< Discard the line: the same stamp as the last one.
    invalid,         ///< Discard the line: the stamp is not finite.
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
  std::vector<Dropped> dropped_;
  std::vector<std::size_t> released_;
  bool time_was_reset_ = false;
};

}  // namespace tandem

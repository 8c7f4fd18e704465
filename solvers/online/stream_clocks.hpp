#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace tandem {

/// When a stamp is believed. All in s of the streams' common time, but for what it says of lines.
struct ClockOptions {
  double leap = 2.0;     ///< or five periods of the chaser's motion: what is further ahead of the others is held back
  double late = 60.0;    ///< what is further behind them likewise
  double confirm = 1.0;  ///< a leap is believed once lines go on from it for so long, two of them or more
  double pause = 86400;  ///< a leap of everything up to so far is a pause; beyond, a clock that was set
  double settled = 10;   ///< a common time that is younger is given up where the chaser's motion goes on before it
};

/// The clocks of streams that come together, line by line, and the common time that they are brought to: in seconds, also
/// where stamps are in milli-, micro- or nanoseconds; by the order of arrival where a stream's clock has been set, until its
/// stamps agree with the others' again. A stamp that is far from what the streams have come to is held back until the next
/// lines of its stream go on from it, or do not: one wrong stamp costs its own line.
class StreamClocks {
 public:
  struct Stream {
    std::string name;
    bool may_repeat;            ///< stamps
    bool motion;                ///< of the chaser's: what the others are held against
    double longest_period = 5;  ///< s: a motion that comes more seldom by its stamps has them in another unit
  };
  explicit StreamClocks(std::vector<Stream> streams, const ClockOptions& options = {});

  /// Told what has been found out about a clock, a sentence.
  std::function<void(const std::string&)> on_notice;

  enum class Verdict {
    use,        ///< at time()
    wait,       ///< keep it and all that come, in order, until is_ready(), then judge them
    hold,       ///< keep it until it is in released() or dropped()
    backwards,  ///< it is of no use: before the stream's last one
    repeats,    ///< likewise: its stamp again
    wrong,      ///< likewise: no time
  };
  Verdict judge(std::size_t stream, double stamp);
  /// The stamp in the common time [s].
  double time(std::size_t stream, double stamp) const;

  /// Whether the unit of stamps is known; finish() makes it so, when no more lines come.
  bool is_ready() const { return ready_; }
  /// One stamp is so many seconds: nothing is to be found out.
  void set_unit(double seconds);
  void finish() { ready_ = true; }

  /// What the last judge() has decided of held lines, the judged one included: streams all of whose are to be used now, and
  /// how many of the oldest of a stream are not to be.
  struct Dropped {
    std::size_t stream, lines;
  };
  const std::vector<Dropped>& dropped() const { return dropped_; }
  const std::vector<std::size_t>& released() const { return released_; }
  /// Whether the last judge() has begun the common time anew: it may run backwards.
  bool began_anew() const { return began_anew_; }

  /// What is known of one stream's clock. The time of a stamp is stamp · unit + offset.
  struct Clock {
    double unit = 1, offset = 0;   ///< s
    std::optional<double> last{};  ///< time of the last line that was used [s]
    double period = 0, lag = 0;    ///< s, between its lines, and behind the others
    int agreeing = 0;              ///< lines in a row whose stamps agree without the offset
  };
  /// All that is known of the clocks, but for the lines that are held: for another object to go on from.
  struct Memory {
    double clock = -HUGE_VAL, base = -HUGE_VAL;  ///< s: the common time, and where it began
    std::vector<Clock> streams{};
  };
  Memory memory() const;
  /// Of the same streams; no line is held then.
  void go_on_from(const Memory& memory);

 private:
  struct Held {
    double stamp, clock;  // the common time when it came
  };
  struct State : Clock {
    std::vector<Held> held{};
  };

  bool find_unit(std::size_t stream, double stamp);
  double leap() const;
  bool agrees(const State& s, double t) const;
  bool agrees_again(State& s, double stamp) const;
  bool goes_on(const Held& before, double stamp) const;
  bool is_confirmed(std::size_t stream, double unit) const;
  void hold(std::size_t stream, double stamp);
  bool adopt_offset(std::size_t stream);
  void settle(std::size_t stream, double unit);
  void release_reached();
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
  std::vector<double> first_stamps_;  // of that stream
  double clock_ = -HUGE_VAL, base_ = -HUGE_VAL;
  std::vector<Dropped> dropped_;
  std::vector<std::size_t> released_;
  bool began_anew_ = false;
};

}  // namespace tandem

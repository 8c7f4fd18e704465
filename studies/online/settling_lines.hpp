#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <utility>

namespace tandem {

/// Delays the lines of all streams by a fixed time, and brings them into the order of their times. A line with which
/// the time restarts follows after those that wait.
template <class Line>
class SettlingLines {
 public:
  void set_delay(double seconds) { delay_ = seconds; }
  double delay() const { return delay_; }
  bool empty() const { return waiting_.empty() && !restart_; }

  /// Adds a line. With `must_advance`, returns false if a line of the stream with its time waits, or if one with its
  /// time or a later one has been taken.
  bool add(Line line, bool must_advance) {
    if (line.time_reset) {
      restart_ = std::move(line);
      return true;
    }
    if (must_advance) {
      if (const auto taken = taken_.find(line.stream); taken != taken_.end() && line.t <= taken->second) return false;
      const auto [first, last] = waiting_.equal_range(line.t);
      for (auto other = first; other != last; ++other)
        if (other->second.stream == line.stream) return false;
    }
    waiting_.emplace(line.t, std::move(line));
    return true;
  }
  /// Returns whether take() need not wait for other lines.
  bool is_ready() const {
    return restart_ || (!waiting_.empty() && waiting_.begin()->first <= waiting_.rbegin()->first - delay_);
  }
  /// Returns the next line in order, if there is one.
  std::optional<Line> take() {
    std::optional<Line> line;
    if (!waiting_.empty()) {
      line = std::move(waiting_.extract(waiting_.begin()).mapped());
    } else if (restart_) {
      line = std::exchange(restart_, {});
      taken_.clear();
    }
    if (line) taken_[line->stream] = line->t;
    return line;
  }

 private:
  double delay_ = 0;  // s
  std::multimap<double, Line> waiting_;
  std::optional<Line> restart_;
  std::map<std::size_t, double> taken_;  // time of the last line of each stream
};

}  // namespace tandem

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <vector>

namespace tandem {

/// Brings the lines of one stream into the order of their times. While lines arrive in order, each is released at once.
/// After a line that is late by D, lines wait until a line D later has arrived, for as long as lines are late. The
/// buffer is bounded: D is at most 60 s, and 16,384 lines wait.
template <class Line>
class ReorderBuffer {
 public:
  /// Adds a line. Returns false if it is too late: a line with its time or a later one is released.
  bool add(double t, Line line) {
    ++lines_;
    if (t < newest_) {
      delay_ = std::max(delay_, std::min(newest_ - t, kMaxDelay));
      last_late_ = newest_;
    } else if (t > last_late_ + kMaxDelay) {
      delay_ = 0;
    }
    newest_ = std::max(newest_, t);
    if (t <= released_ || waiting_.contains(t)) return false;
    waiting_.emplace(t, Waiting{lines_, std::move(line)});
    return true;
  }
  /// Returns the next line in order, if it need not wait.
  std::optional<Line> take(bool all = false) {
    if (waiting_.empty()) return {};
    const auto first = waiting_.begin();
    if (!all && first->first > newest_ - delay_ && waiting_.size() <= kMaxWaiting) return {};
    released_ = first->first;
    std::optional<Line> line(std::move(first->second.line));
    waiting_.erase(first);
    return line;
  }
  bool empty() const { return waiting_.empty(); }
  /// Returns the number of lines added since the oldest waiting one, including it.
  std::size_t since_oldest() const {
    std::size_t first = lines_ + 1;
    for (const auto& [t, waiting] : waiting_) first = std::min(first, waiting.number);
    return lines_ + 1 - first;
  }

 private:
  static constexpr double kMaxDelay = 60;  // s
  static constexpr std::size_t kMaxWaiting = 16384;
  struct Waiting {
    std::size_t number;
    Line line;
  };

  std::map<double, Waiting> waiting_;
  double newest_ = -HUGE_VAL, released_ = -HUGE_VAL, last_late_ = -HUGE_VAL, delay_ = 0;  // s
  std::size_t lines_ = 0;
};

}  // namespace tandem

#include <algorithm>

#include <tandem/studies/online/replay_log.hpp>

namespace tandem {
namespace {

constexpr double kBefore = 2;                // s of inertial samples kept before the first state
constexpr std::size_t kMaxLines = 1u << 18;  // gives a snapshot of tens of megabytes

}  // namespace

ReplayLog::ReplayLog(const Options& options, const std::optional<Alignment>& start) : options_(options) {
  if (!start) return;
  states_.push_back(*start);
  from_the_beginning_ = false;
}

void ReplayLog::add(const FeedLine& line) {
  if (line.time_reset) {
    lines_.clear();
    states_.clear();
    from_the_beginning_ = true;
  }
  lines_.push_back(line);
  while (lines_.size() > kMaxLines || lines_.front().t < line.t - options_.reach) {
    lines_.pop_front();
    from_the_beginning_ = false;
  }
  while (!states_.empty() && !from_the_beginning_ && states_.front().t < lines_.front().t) states_.pop_front();
}

void ReplayLog::add_state(const Alignment& state) {
  states_.push_back(state);
  if (states_.size() <= 2) return;
  states_.pop_front();
  from_the_beginning_ = false;
  while (!lines_.empty() && lines_.front().t < states_.front().t - kBefore) lines_.pop_front();
}

std::optional<Alignment> ReplayLog::start() const {
  if (options_.odometry || from_the_beginning_ || states_.empty()) return {};
  return states_.front();
}

}  // namespace tandem

#include <algorithm>

#include <tandem/solvers/online/event_queue.hpp>

namespace tandem::detail {

std::string seconds_text(double t) { return std::to_string(t) + " s"; }

std::optional<std::string> EventQueue::why_invalid_stamp(const std::string& name, double stamp, bool started) {
  if (!std::isfinite(stamp)) return name + ": the time stamp is not finite";
  const bool ahead = started && stamp > clock_ + max_ahead_;
  if (!ahead || (ahead_ && std::abs(stamp - *ahead_) <= max_ahead_)) {
    ahead_.reset();  // a good stamp came between them, so equal wrong stamps do not confirm each other
    return {};
  }
  ahead_ = stamp;
  return name + ": time stamp " + seconds_text(stamp) + " is " + seconds_text(stamp - clock_) +
         " ahead of all other streams";
}

EventQueue::Pending::const_iterator EventQueue::first() const {
  const auto begin = pending_.begin();
  for (auto it = begin; it != pending_.end() && it->first <= begin->first + kSameInstant; ++it)
    if (it->second.of_target()) return it;
  return begin;
}

std::optional<EventQueue::Next> EventQueue::next() const {
  const auto it = first();
  if (it == pending_.end()) return {};
  return Next{it->first, it->second.of_target()};
}

std::pair<double, OnlineEvent> EventQueue::take() {
  auto node = pending_.extract(first());
  return {node.key(), std::move(node.mapped())};
}

void EventQueue::drop_before(double t) { pending_.erase(pending_.begin(), pending_.lower_bound(t)); }

}  // namespace tandem::detail

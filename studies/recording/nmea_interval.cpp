#include <algorithm>
#include <cmath>
#include <utility>

#include <tandem/studies/recording/nmea_interval.hpp>

namespace tandem {
namespace {

constexpr std::size_t kMostLines = 65536;  // kept until the next fix
constexpr double kLargestInterval = 60;    // s, between fixes
constexpr double kLargestStretch = 2;      // of the step between sentences, from one interval to the next
constexpr double kLargestJitter = 1;       // s, of receive times
constexpr int kMeanOf = 50;                // receive times

}  // namespace

void NmeaInterval::add(NmeaLine line, const NmeaClock::Stamp& stamp) {
  // A receiver that is late does not end the interval.
  const bool ends =
      std::isfinite(stamp.time) && !(std::abs(stamp.time - fix_) < kLargestInterval && stamp.time <= fix_);
  if (ends) {
    if (differences_ == 0) add_difference(stamp.time - line.received);
    pass_on(stamp.time);
    fix_ = stamp.time;
    for (auto& [type, series] : series_) series.count = series.next = 0;
    add_difference(stamp.time - line.received);
  } else if (entries_.size() >= kMostLines) {
    pass_on(std::numeric_limits<double>::quiet_NaN());
  }
  entries_.push_back({std::move(line), stamp});
}

void NmeaInterval::add_difference(double difference) {
  if (std::isnan(difference)) return;
  if (!(std::abs(difference - difference_) < kLargestJitter)) differences_ = 0;
  differences_ = std::min(differences_ + 1, kMeanOf);
  difference_ += (difference - difference_) / differences_;
}

void NmeaInterval::pass_on(double next_fix) {
  for (const Entry& entry : entries_)
    if (!entry.stamp.has_time) ++series_[entry.line.type].count;
  for (const Entry& entry : entries_)
    row_(entry.line, entry.stamp.has_time ? entry.stamp.time : time_of(entry.line, series_[entry.line.type], next_fix));
  entries_.clear();
}

double NmeaInterval::time_of(const NmeaLine& line, Series& series, double next_fix) const {
  if (!settings_.fixes) return line.received;
  const double length = next_fix - fix_;
  const bool whole = length > 0 && length <= kLargestInterval;
  double step = whole ? length / static_cast<double>(series.count) : series.step;
  if (series.step > 0) step = std::min(step, kLargestStretch * series.step);
  const double spread = fix_ + static_cast<double>(series.next++) * step;
  if (whole && series.next == series.count) series.step = step;
  if (!settings_.receive_times || std::isnan(line.received) || differences_ == 0) return spread;
  // A receive time far from the fixes is that of a clock that was set.
  const double shifted = line.received + difference_;
  const double last = whole ? next_fix : fix_ + kLargestInterval;
  return std::isnan(fix_) || (shifted > fix_ - kLargestJitter && shifted < last + kLargestJitter) ? shifted : spread;
}

}  // namespace tandem

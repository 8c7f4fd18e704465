#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/problem/quantile.hpp>
#include <tandem/solvers/online/stream_clocks.hpp>

namespace tandem {
namespace {

struct Unit {
  double seconds;
  const char* name;
  double epoch;  // stamps of this size count from 1970, in this unit or a smaller one
};
constexpr std::array<Unit, 4> kUnits = {
    {{1, "seconds", 0}, {1e-3, "milliseconds", 1e11}, {1e-6, "microseconds", 1e14}, {1e-9, "nanoseconds", 1e17}}};
constexpr std::array kUsualPeriod = {1e-3, 2.0};  // range of usual periods of the motion [s]
constexpr std::size_t kFirstStamps = 6, kMostWaiting = 1000, kMostHeld = 4096;
constexpr double kSameStep = 5;  // largest difference of equal clock steps [s]
const std::string kAgreesAgain = ": time stamps agree with the other streams again";
const std::string kByArrival = "; its lines are timed by arrival";

const char* name_of(double unit) {
  return std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) { return u.seconds == unit; })->name;
}

/// Detects the unit from the size of the stamps if they count from 1970, else from their spacing. Returns it in
/// seconds.
double unit_of(const std::vector<double>& stamps, double longest_period) {
  for (auto unit = kUnits.rbegin(); unit->epoch > 0; ++unit)
    if (std::abs(stamps.back()) >= unit->epoch) return unit->seconds;
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    if (stamps[i] > stamps[i - 1]) steps.push_back(stamps[i] - stamps[i - 1]);
  if (steps.empty()) return 1;
  const double step = detail::median(std::move(steps));
  if (step > longest_period)
    for (const Unit& unit : kUnits)
      if (step * unit.seconds >= kUsualPeriod[0] && step * unit.seconds <= kUsualPeriod[1]) return unit.seconds;
  return 1;
}

std::string duration_text(double s) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.10g s", s);
  return text.data();
}

}  // namespace

StreamClocks::StreamClocks(std::vector<Stream> streams, const ClockOptions& options)
    : streams_(std::move(streams)), options_(options), states_(streams_.size()) {}

double StreamClocks::time(std::size_t stream, double stamp) const {
  return stamp * states_[stream].unit + states_[stream].offset;
}

StreamClocks::Verdict StreamClocks::classify(std::size_t stream, double stamp) {
  dropped_.clear();
  released_.clear();
  time_was_reset_ = false;
  if (!std::isfinite(stamp)) return Verdict::invalid;
  if (!ready_ && !find_unit(stream, stamp)) return Verdict::wait;
  State& s = states_[stream];
  if (s.offset != 0 && agrees_again(s, stamp)) {
    s.offset = 0;
    notice(streams_[stream].name + kAgreesAgain);
    if (!s.held.empty()) {
      s.held.push_back({stamp, clock_});
      release(stream);
      return Verdict::hold;
    }
  }
  const double t = time(stream, stamp);
  if (s.last && t == *s.last && !streams_[stream].may_repeat) return Verdict::repeated;
  // While lines of the motion are held, the common time stands still.
  const bool resumes = streams_[stream].motion && s.last && t >= *s.last &&
                       t <= *s.last + 2 * s.period * double(s.held.size()) + max_lead();
  if (resumes || agrees(s, t)) {
    if (!s.held.empty()) drop(stream, s.held.size());
    use(stream, t);
    release_consistent();
    return Verdict::use;
  }
  hold(stream, stamp);
  return Verdict::hold;
}

/// Detects the unit of the stamps. Returns false if this line must wait for the line that decides the unit.
bool StreamClocks::find_unit(std::size_t stream, double stamp) {
  if (streams_[stream].motion && (first_stamps_.empty() || stream == first_motion_)) {
    first_motion_ = stream;
    first_stamps_.push_back(stamp);
  }
  const double longest = streams_[first_motion_].longest_period;
  const std::size_t n = first_stamps_.size();
  const bool plain = n >= 2 && first_stamps_[n - 1] > first_stamps_[n - 2] &&
                     first_stamps_[n - 1] - first_stamps_[n - 2] <= longest && unit_of(first_stamps_, longest) == 1;
  ready_ = plain || n >= kFirstStamps || ++waiting_ > kMostWaiting;
  if (!ready_) return false;
  if (const double unit = n > 0 ? unit_of(first_stamps_, longest) : 1; unit != 1) {
    for (State& s : states_) s.unit = unit;
    notice(std::string("time stamps are in ") + name_of(unit));
  }
  return false;  // the earlier lines come first
}

void StreamClocks::set_unit(double seconds) {
  for (State& s : states_) s.unit = seconds;
  ready_ = true;
}

StreamClocks::Checkpoint StreamClocks::checkpoint() const {
  Checkpoint checkpoint{clock_, base_};
  checkpoint.streams.assign(states_.begin(), states_.end());
  return checkpoint;
}

void StreamClocks::restore(const Checkpoint& checkpoint) {
  if (checkpoint.streams.size() != states_.size())
    throw BadInputError("stream clocks: the checkpoint has a different number of streams");
  clock_ = checkpoint.clock;
  base_ = checkpoint.base;
  motion_ = -HUGE_VAL;
  for (std::size_t i = 0; i < states_.size(); ++i) states_[i] = {checkpoint.streams[i], {}};
  ready_ = true;
}

double StreamClocks::max_lead() const {
  double lead = options_.max_lead;
  for (std::size_t i = 0; i < streams_.size(); ++i)
    if (streams_[i].motion) lead = std::max(lead, 5 * states_[i].period);
  return lead;
}

bool StreamClocks::agrees(const State& s, double t) const {
  if (clock_ == -HUGE_VAL) return true;
  // A stream that is ahead of a lagging motion continues at its pace.
  const double passed = s.last && std::isfinite(s.motion) ? *s.last + (motion_ - s.motion) : clock_;
  return t <= std::max(clock_, passed) + max_lead() && t >= clock_ - options_.max_lag;
}

/// Counts successive stamps that agree with the common time without the offset. Returns whether there are two.
bool StreamClocks::agrees_again(State& s, double stamp) const {
  const double t = stamp * s.unit;
  const bool agrees = std::abs(t - (clock_ - s.lag)) <= options_.max_lead && (!s.last || t >= *s.last);
  s.agreeing = agrees ? s.agreeing + 1 : 0;
  return s.agreeing >= 2;
}

/// Returns whether a stamp continues from a held one at the pace of the common time, in any unit.
bool StreamClocks::continues(const Held& before, double stamp) const {
  const double passed = clock_ - before.clock, step = stamp - before.stamp;
  return std::any_of(kUnits.begin(), kUnits.end(), [&](const Unit& unit) {
    const double own = step * unit.seconds;
    return own >= 0 && own >= passed - options_.max_lead && own <= passed + 10 * max_lead();
  });
}

void StreamClocks::hold(std::size_t stream, double stamp) {
  auto& held = states_[stream].held;
  if (!held.empty() && !continues(held.back(), stamp)) drop(stream, held.size());
  if (held.size() >= kMostHeld) drop(stream, 1);
  held.push_back({stamp, clock_});
  const double own = states_[stream].unit;
  if (adopt_offset(stream)) return;
  if (!streams_[stream].motion)
    for (const Unit& unit : kUnits)  // tries whether the stamp agrees with the common time in another unit
      if (unit.seconds != own &&
          std::abs(held.front().stamp * unit.seconds - held.front().clock) <= options_.max_lead + max_lead() &&
          std::abs(stamp * unit.seconds - clock_) <= options_.max_lead + max_lead() &&
          is_confirmed(stream, unit.seconds))
        return confirm_shift(stream, unit.seconds);
  if (is_confirmed(stream, own)) confirm_shift(stream, own);
}

bool StreamClocks::is_confirmed(std::size_t stream, double unit) const {
  const State& s = states_[stream];
  if (s.held.size() < 2) return false;
  const bool given_unit = unit == s.unit, motion = streams_[stream].motion;
  const double ahead = time(stream, s.held.front().stamp) - s.held.front().clock;
  if (given_unit && !motion && ahead > 0 && ahead <= options_.max_lag) return true;
  if (s.held.size() < options_.confirm_lines ||
      (s.held.back().stamp - s.held.front().stamp) * unit < options_.confirm_time)
    return false;
  return motion || !given_unit || ahead < 0 || clock_ > s.held.front().clock;
}

/// Releases the held lines of a stream if they agree with the offset of another stream, i.e. if both clocks made the
/// same step.
bool StreamClocks::adopt_offset(std::size_t stream) {
  State& s = states_[stream];
  for (const State& other : states_) {
    const State as_other{{.unit = s.unit, .offset = other.offset, .last = s.last}};
    const auto agree = [&](const Held& line) { return agrees(as_other, line.stamp * s.unit + other.offset); };
    if (other.offset == s.offset || !agree(s.held.front()) || !agree(s.held.back())) continue;
    s.offset = other.offset;
    notice(streams_[stream].name + (s.offset == 0 ? kAgreesAgain : ": clock stepped by the same amount" + kByArrival));
    release(stream);
    return true;
  }
  return false;
}

/// Releases held lines that agree with the common time by now.
void StreamClocks::release_consistent() {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const auto& held = states_[i].held;
    if (held.size() >= 2 && agrees(states_[i], time(i, held.front().stamp)) &&
        agrees(states_[i], time(i, held.back().stamp)))
      release(i);
  }
}

/// Accepts the held lines of a stream: as a unit, a pause, an earlier start of time, or a clock step.
void StreamClocks::confirm_shift(std::size_t stream, double unit) {
  State& s = states_[stream];
  const std::string& name = streams_[stream].name;
  const Held first = s.held.front();
  const double step = time(stream, first.stamp) - first.clock;
  const bool motion = streams_[stream].motion;
  if (unit != s.unit) {
    s.unit = unit;
    s.offset = 0;
    notice(name + ": time stamps are in " + name_of(unit));
  } else if (!motion && step > 0 && step <= options_.max_lag) {  // the motion lags
  } else if (motion && step > 0 && step <= options_.max_pause && clock_ == first.clock) {
    if (step > options_.max_lag) notice("no time stamps for " + duration_text(step) + ": treated as a pause");
  } else if (motion && step < 0 && clock_ - base_ < options_.settling_time) {
    notice(name + ": time stamps continue " + duration_text(-step) + " before the first ones; the time base is reset");
    for (std::size_t i = 0; i < states_.size(); ++i) {
      states_[i].last.reset();
      states_[i].offset = 0;
    }
    clock_ = motion_ = -HUGE_VAL;
    time_was_reset_ = true;
  } else {
    const double next = s.last ? *s.last + s.period : first.clock;
    double offset = std::max(first.clock - s.lag, next) - first.stamp * s.unit;
    if (std::abs(offset) <= options_.max_lead) offset = 0;
    for (const State& other : states_)
      if (&other != &s && std::abs(other.offset - offset) <= kSameStep && other.offset != 0 &&
          first.stamp * s.unit + other.offset > s.last.value_or(-HUGE_VAL))
        offset = other.offset;
    s.offset = offset;
    notice(offset == 0 ? name + kAgreesAgain
                       : name + ": clock is " + duration_text(std::abs(offset)) + (offset < 0 ? " ahead" : " behind") +
                             kByArrival);
  }
  s.agreeing = 0;
  release(stream);
  for (std::size_t i = 0; i < states_.size(); ++i) {  // other streams held for the same reason
    const auto& held = states_[i].held;
    if (held.empty()) continue;
    if (agrees(states_[i], time(i, held.front().stamp)) && agrees(states_[i], time(i, held.back().stamp)))
      release(i);
    else
      adopt_offset(i);
  }
}

void StreamClocks::release(std::size_t stream) {
  State& s = states_[stream];
  for (const Held& line : s.held) use(stream, time(stream, line.stamp));
  s.held.clear();
  released_.push_back(stream);
}

void StreamClocks::drop(std::size_t stream, std::size_t lines) {
  auto& held = states_[stream].held;
  held.erase(held.begin(), held.begin() + std::ptrdiff_t(lines));
  dropped_.push_back({stream, lines});
}

void StreamClocks::use(std::size_t stream, double t) {
  State& s = states_[stream];
  if (clock_ == -HUGE_VAL) base_ = t;
  clock_ = std::max(clock_, t);
  if (streams_[stream].motion) motion_ = std::max(motion_, t);
  if (s.last && t < *s.last) return;  // late
  if (s.last && t > *s.last) s.period = s.period > 0 ? std::min(t - *s.last, 2 * s.period) : t - *s.last;
  s.last = t;
  s.lag = clock_ - t;
  s.motion = motion_;
}

}  // namespace tandem

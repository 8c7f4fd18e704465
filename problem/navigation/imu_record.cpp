#include <algorithm>

#include <tandem/problem/navigation/imu_record.hpp>

namespace tandem {

ImuRecord::ImuRecord(const ImuSensor& sensor) : mount_(sensor.mount), noise_(sensor.noise), max_gap_(sensor.max_gap) {}

ImuRecord record_of(const ImuSensor& sensor) {
  ImuRecord record(sensor);
  for (const ImuSample& sample : sensor.samples) record.add(sample);
  return record;
}

bool ImuRecord::add(const ImuSample& sample) {
  if (!samples_.empty() && !(sample.t > samples_.back().t)) return false;
  samples_.push_back(sample);
  return true;
}

void ImuRecord::drop_before(double t) {
  while (samples_.size() > 1 && samples_[1].t <= t) samples_.pop_front();
}

std::deque<ImuSample>::const_iterator ImuRecord::after(double t) const {
  return std::upper_bound(samples_.begin(), samples_.end(), t, [](double x, const ImuSample& s) { return x < s.t; });
}

bool ImuRecord::covers(double from, double to) const {
  if (samples_.empty()) return false;
  const auto near_sample = [&](double t) {
    const auto next = after(t);
    return (next != samples_.end() && next->t - t <= max_gap_) ||
           (next != samples_.begin() && t - (next - 1)->t <= max_gap_);
  };
  if (!near_sample(from) || !near_sample(to)) return false;
  // Ignores samples after `to`: online data do not have them yet, but must give the same result as a recording.
  double t = from;
  for (auto next = after(from); next != samples_.end() && next->t < to; ++next) {
    if (next->t - t > max_gap_) return false;
    t = next->t;
  }
  return to - t <= max_gap_;
}

ImuSample ImuRecord::at(std::deque<ImuSample>::const_iterator next, double t) const {
  ImuSample result = next == samples_.end() ? samples_.back() : *next;
  if (next != samples_.begin() && next != samples_.end()) {
    const ImuSample& before = *(next - 1);
    const double s = (t - before.t) / (next->t - before.t);
    result.specific_force = before.specific_force + s * (next->specific_force - before.specific_force);
    result.angular_rate = before.angular_rate + s * (next->angular_rate - before.angular_rate);
  } else {
    result.gap = 0;  // held, not interpolated
  }
  result.t = t;
  return result;
}

void ImuRecord::integrate(double from, double to, ImuPreintegrator& sum) const {
  each_interval(from, to, [&](const ImuSample& a, const ImuSample& b) { sum.integrate(a, b); });
}

ImuPreintegrator ImuRecord::start(const Vector<6>& bias) const { return ImuPreintegrator(mount_, noise_, bias); }

std::optional<ImuSample> ImuRecord::mean(double from, double to) const {
  ImuSample sum{0.5 * (from + to), Vector<3>::Zero(), Vector<3>::Zero()};
  double n = 0;
  const auto first =
      std::lower_bound(samples_.begin(), samples_.end(), from, [](const ImuSample& s, double t) { return s.t < t; });
  for (auto it = first; it != samples_.end() && it->t <= to; ++it) {
    const ImuSample& s = *it;
    sum.specific_force += s.specific_force;
    sum.angular_rate += s.angular_rate;
    ++n;
  }
  if (n == 0) return std::nullopt;
  sum.specific_force = mount_.rotation().act(sum.specific_force / n);
  sum.angular_rate = mount_.rotation().act(sum.angular_rate / n);
  return sum;
}

}  // namespace tandem

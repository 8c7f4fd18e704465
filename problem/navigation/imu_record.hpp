#pragma once

#include <deque>

#include <tandem/problem/navigation/navigation_data.hpp>

namespace tandem {

/// Buffer of IMU samples in time order, which integrates them between any two times.
class ImuRecord {
 public:
  /// Copies mount, noise and max_gap of the sensor, but no samples.
  explicit ImuRecord(const ImuSensor& sensor);

  /// Adds a sample. Returns false, without adding it, if it is not later than the last one.
  bool add(const ImuSample& sample);
  /// Removes the samples that are not needed to integrate from t onwards.
  void drop_before(double t);

  bool empty() const { return samples_.empty(); }
  const SE3& mount() const { return mount_; }
  const ImuNoise& noise() const { return noise_; }
  double first() const { return samples_.front().t; }
  double last() const { return samples_.back().t; }
  /// Returns whether the samples cover [from, to]: consecutive samples are at most max_gap apart, and there is a sample
  /// within max_gap of either end.
  bool covers(double from, double to) const;
  /// Adds the interval [from, to] to `sum`. Interpolates samples at both ends; holds the first and the last sample.
  void integrate(double from, double to, ImuPreintegrator& sum) const;
  /// Calls f(sample, next sample) for each interval that integrate() adds.
  template <class F>
  void each_interval(double from, double to, F f) const {
    if (samples_.empty() || !(to > from)) return;
    auto next = after(from);
    ImuSample start = at(next, from);
    for (; next != samples_.end() && next->t < to; ++next) {
      f(start, *next);
      start = *next;
    }
    f(start, at(next, to));
  }
  /// Returns an empty preintegrator that is linearised at this bias.
  ImuPreintegrator start(const Vector<6>& bias) const;
  /// Returns the mean sample in [from, to] along body axes, without lever-arm correction; nullopt if there is none.
  std::optional<ImuSample> mean(double from, double to) const;

 private:
  std::deque<ImuSample>::const_iterator after(double t) const;
  ImuSample at(std::deque<ImuSample>::const_iterator next, double t) const;

  SE3 mount_;
  ImuNoise noise_;
  double max_gap_;
  std::deque<ImuSample> samples_;
};

/// Returns a record of all samples of a sensor.
ImuRecord record_of(const ImuSensor& sensor);

}  // namespace tandem

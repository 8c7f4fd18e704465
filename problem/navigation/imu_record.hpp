#pragma once

#include <deque>

#include <tandem/problem/navigation/navigation_data.hpp>

namespace tandem {

/// An inertial sensor's samples in time order, as far back as they are wanted, to be integrated between any two instants.
class ImuRecord {
 public:
  /// `sensor`: its mount, noise and max_gap; not its samples.
  explicit ImuRecord(const ImuSensor& sensor);

  /// Samples that are not later than the last are left out: false.
  bool add(const ImuSample& sample);
  /// Forgets what lies before t, but for the sample that is needed there.
  void drop_before(double t);

  bool empty() const { return samples_.empty(); }
  const SE3& mount() const { return mount_; }
  const ImuNoise& noise() const { return noise_; }
  double first() const { return samples_.front().t; }
  double last() const { return samples_.back().t; }
  /// Whether no two samples in [from, to] are further apart than the sensor's max_gap, nor the ends from a sample.
  bool covers(double from, double to) const;
  /// Integrates on from one instant to a later one: sample to sample, interpolated at the ends, the first and last one
  /// held beyond.
  void integrate(double from, double to, ImuPreintegrator& sum) const;
  /// The intervals that takes: f(sample, next sample).
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
  /// A fresh sum at this bias.
  ImuPreintegrator start(const Vector<6>& bias) const;
  /// The mean reading between two instants, by body axes without lever arm; nothing without a sample there.
  std::optional<ImuSample> mean(double from, double to) const;

 private:
  std::deque<ImuSample>::const_iterator after(double t) const;
  ImuSample at(std::deque<ImuSample>::const_iterator next, double t) const;

  SE3 mount_;
  ImuNoise noise_;
  double max_gap_;
  std::deque<ImuSample> samples_;
};

}  // namespace tandem

#include <algorithm>
#include <cmath>

#include <tandem/problem/navigation/imu_screen.hpp>
#include <tandem/problem/quantile.hpp>

namespace tandem {
namespace {

constexpr double kMaxReadForce = 1000, kMaxReadRate = 100;  // m/s², rad/s; no vehicle's sensor reads more
constexpr double kBeyondLimit = 1.5;  // times a declared limit; scale factors may exceed it slightly
constexpr double kNoGravity = 1;      // m/s²
constexpr double kUnusual = 5;        // typical deviations
// Deviations from the level that a vehicle reaches within a sample.
constexpr double kForceStep = 20, kRateStep = 5;       // m/s², rad/s
constexpr double kLevelTime = 1, kDeviationTime = 10;  // s, averaging times
constexpr std::size_t kSamplesForLevel = 50;           // accepted samples before spikes are judged
constexpr double kNewLevelTime = 0.5;                  // s; spikes over this time and kSamplesForLevel are a new level
constexpr double kMinSteadyForce = 3, kMaxSteadyForce = 30;  // m/s²; possible magnitudes of a new level
constexpr std::size_t kFrozenSamples = 10;
constexpr double kFrozenTime = 0.05;  // s
constexpr double kRunRatio = 20;      // a run of equal samples is unusual if it exceeds this multiple of the mean run

constexpr double kLoneSteps = 20;                     // typical steps; real recordings have lone samples up to 6
constexpr double kLoneForce = 0.5, kLoneRate = 0.05;  // m/s², rad/s; smaller ones do no harm

double with_default(double limit, double otherwise) { return limit > 0 ? kBeyondLimit * limit : otherwise; }

bool equal(const ImuSample& a, const ImuSample& b) {
  return a.specific_force == b.specific_force && a.angular_rate == b.angular_rate;
}

using Triad = Vector<3> ImuSample::*;

/// Marks single samples of a triad far from both neighbours. A step to a new level is far from one neighbour only.
void mark_lone_samples(const std::vector<ImuSample>& samples, Triad triad, double least,
                       std::vector<std::optional<ImuFault>>& faults) {
  const std::size_t n = samples.size();
  const auto distance = [&](std::size_t i, std::size_t j) { return (samples[i].*triad - samples[j].*triad).norm(); };
  std::vector<double> steps;
  for (std::size_t i = 1; i < n; ++i)
    if (const double step = distance(i - 1, i); std::isfinite(step)) steps.push_back(step);
  if (steps.size() < kSamplesForLevel) return;
  const double limit = std::max(least, kLoneSteps * detail::median(std::move(steps)));
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = i > 0 ? i - 1 : 2, after = i + 1 < n ? i + 1 : n - 3;
    const double away = std::min(distance(before, i), distance(i, after)), between = distance(before, after);
    if (away - between > limit) faults[i] = ImuFault::spike;
  }
}

/// Marks the samples at the start that repeat the first one, unless the quantisation of later samples explains them.
void mark_frozen_start(const std::vector<ImuSample>& samples, std::vector<std::optional<ImuFault>>& faults) {
  std::size_t run = 1, changes = 0;
  while (run < samples.size() && equal(samples[run], samples[0])) ++run;
  for (std::size_t i = run + 1; i < samples.size(); ++i) changes += !equal(samples[i], samples[i - 1]);
  if (run <= kFrozenSamples || changes <= kFrozenSamples || samples[run - 1].t - samples[0].t <= kFrozenTime) return;
  const double mean = double(samples.size() - run) / double(changes);
  if (double(run) > kRunRatio * mean) std::fill_n(faults.begin() + 1, run - 1, ImuFault::frozen);
}

}  // namespace

std::vector<std::optional<ImuFault>> faults_beside_neighbours(const std::vector<ImuSample>& samples) {
  std::vector<std::optional<ImuFault>> faults(samples.size());
  if (samples.size() < kSamplesForLevel) return faults;
  mark_lone_samples(samples, &ImuSample::specific_force, kLoneForce, faults);
  mark_lone_samples(samples, &ImuSample::angular_rate, kLoneRate, faults);
  mark_frozen_start(samples, faults);
  return faults;
}

std::string_view text(ImuFault fault) {
  switch (fault) {
    case ImuFault::missing:
      return "without a value";
    case ImuFault::out_of_range:
      return "beyond the range of the sensor";
    case ImuFault::no_gravity:
      return "without gravity";
    case ImuFault::frozen:
      return "with repeated values of all axes";
    case ImuFault::spike:
      break;
  }
  return "far from the samples before";
}

ImuScreen::ImuScreen(const ImuSensor& sensor)
    : max_force_(with_default(sensor.max_specific_force, kMaxReadForce)),
      max_rate_(with_default(sensor.max_angular_rate, kMaxReadRate)),
      saturated_force_(sensor.max_specific_force > 0 ? sensor.max_specific_force : HUGE_VAL),
      saturated_rate_(sensor.max_angular_rate > 0 ? sensor.max_angular_rate : HUGE_VAL) {
  force_.limit = kForceStep;
  rate_.limit = kRateStep;
}

void ImuScreen::Level::add(const Vector<3>& value, double weight, double slow_weight) {
  deviation += slow_weight * ((value - mean).norm() - deviation);
  mean += weight * (value - mean);
}

std::optional<ImuFault> ImuScreen::judge(ImuSample& sample, std::optional<ImuFault> known) {
  auto found = fault(sample);
  if (!found && !(known == ImuFault::spike && is_saturated(sample))) found = known;
  if (found != ImuFault::missing) last_ = sample;
  if (found) {
    gap_ = true;
    return found;
  }
  sample.gap = last_used_ && gap_ ? sample.t - last_used_->t : 0;
  gap_ = false;
  learn(sample);
  last_used_ = sample;
  return {};
}

std::optional<ImuFault> ImuScreen::fault(const ImuSample& sample) {
  if (!sample.specific_force.allFinite() || !sample.angular_rate.allFinite()) return ImuFault::missing;
  const bool frozen = is_frozen(sample);
  if (sample.specific_force.cwiseAbs().maxCoeff() > max_force_ || sample.angular_rate.cwiseAbs().maxCoeff() > max_rate_)
    return ImuFault::out_of_range;
  if (lacks_gravity(sample)) return ImuFault::no_gravity;
  if (frozen) return ImuFault::frozen;
  if (!is_saturated(sample) && is_spike(sample)) return ImuFault::spike;
  return {};
}

/// Returns whether the specific force is so small that the sensor does not work. Under strong vibration, small values
/// occur.
bool ImuScreen::lacks_gravity(const ImuSample& sample) const {
  if (sample.specific_force.isZero(0)) return true;
  if (!(sample.specific_force.norm() < kNoGravity)) return false;
  return used_ < kSamplesForLevel || (sample.specific_force - force_.mean).norm() > kUnusual * force_.deviation;
}

/// Returns whether an axis is at its declared limit. Such samples are wrong, but better than none.
bool ImuScreen::is_saturated(const ImuSample& sample) const {
  return sample.specific_force.cwiseAbs().maxCoeff() >= saturated_force_ ||
         sample.angular_rate.cwiseAbs().maxCoeff() >= saturated_rate_;
}

/// Returns whether the sample is in a run of equal samples that quantisation does not explain. A recording that never
/// changes is synthetic, not frozen.
bool ImuScreen::is_frozen(const ImuSample& sample) {
  ++samples_;
  if (!last_ || !equal(*last_, sample)) {
    ++runs_;
    run_ = 1;
    run_begin_ = sample.t;
    return false;
  }
  ++run_;
  const double mean = double(samples_ - run_) / double(std::max<std::size_t>(runs_ - 1, 1));
  return runs_ > kFrozenSamples && run_ > kFrozenSamples && sample.t - run_begin_ > kFrozenTime &&
         double(run_) > kRunRatio * mean;
}

bool ImuScreen::is_spike(const ImuSample& sample) {
  if (used_ < kSamplesForLevel || !(force_.is_far(sample.specific_force) || rate_.is_far(sample.angular_rate))) {
    spikes_ = 0;
    return false;
  }
  if (spikes_++ == 0) first_spike_ = sample.t;
  const double force = sample.specific_force.norm();
  if (spikes_ <= kSamplesForLevel || sample.t - first_spike_ < kNewLevelTime || force < kMinSteadyForce ||
      force > kMaxSteadyForce)
    return true;
  used_ = spikes_ = 0;
  return false;
}

void ImuScreen::learn(const ImuSample& sample) {
  if (used_++ == 0) {
    force_.mean = sample.specific_force;
    rate_.mean = sample.angular_rate;
    return;
  }
  const double dt = last_used_ ? sample.t - last_used_->t : 0;
  const double start = 1.0 / double(used_);  // a plain mean at the start
  const double fast = std::max(start, std::min(1.0, dt / kLevelTime));
  const double slow = std::max(start, std::min(1.0, dt / kDeviationTime));
  force_.add(sample.specific_force, fast, slow);
  rate_.add(sample.angular_rate, fast, slow);
}

}  // namespace tandem

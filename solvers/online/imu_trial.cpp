#include <algorithm>

#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/solvers/online/imu_trial.hpp>

namespace tandem::detail {
namespace {

constexpr double kHistory = 30;       // s
constexpr double kMaxRejected = 0.1;  // share of a sensor's measurements in a trial
constexpr std::size_t kMinUsed = 3;   // measurements in a trial, all sensors together

bool agrees(const SensorHealth& sensor) {
  return sensor.rejected_in_a_row == 0 &&
         double(sensor.rejected) <= kMaxRejected * double(sensor.used + sensor.rejected);
}

}  // namespace

ImuTrial::ImuTrial(const NavigationData& settings, const OnlineOptions& options) : settings_(settings) {
  options_.ego = options.ego;
  options_.lag = options.lag;
  options_.lag.before_marginalize = {};  // hooks are for the actual estimate only
  options_.lag.window = std::min(options.lag.window, kHistory);
  options_.reset = ResetOptions::never();
  options_.reset.gate = options.reset.gate;
}

void ImuTrial::add(const ImuSample& sample) {
  samples_.push_back(sample);
  while (samples_.front().t < sample.t - kHistory) samples_.pop_front();
}

void ImuTrial::add(std::size_t sensor, const EgoMeasurement& m) {
  measurements_.emplace_back(sensor, m);
  while (measurements_.front().second.t < m.t - kHistory) measurements_.pop_front();
}

std::optional<ImuTrial::Agreement> ImuTrial::run(const Alignment& start, bool with_imu) const {
  OnlineOptions options = options_;
  options.start = start;
  OnlineEstimator estimator(TrackingData(), settings_, options);
  Agreement agreement;
  estimator.on_leave = [&](const Stamped<EgoState>& state) { agreement.states.push_back(state); };
  NavigationData data = settings_;
  if (with_imu) data.imu->samples.assign(samples_.begin(), samples_.end());
  for (const auto& [sensor, m] : measurements_)
    if (data.sensors[sensor].valid_at(m) >= start.t) data.sensors[sensor].measurements.push_back(m);
  replay(data, HUGE_VAL, estimator, Stop());
  const std::vector<SensorHealth>& sensors = estimator.health().sensors;
  std::size_t used = 0;
  for (const SensorHealth& sensor : sensors) used += sensor.used;
  const auto newest = estimator.handover_start();
  if (!newest || used < kMinUsed || !estimator.health().converged ||
      !std::all_of(sensors.begin(), sensors.end(), agrees))
    return {};
  agreement.newest = *newest;
  const std::vector<Stamped<EgoState>> rest = estimator.window();
  agreement.states.insert(agreement.states.end(), rest.begin(), rest.end());
  return agreement;
}

}  // namespace tandem::detail

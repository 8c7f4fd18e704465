#include <algorithm>
#include <cmath>
#include <numbers>

#include <tandem/problem/navigation/navigation_problem.hpp>
#include <tandem/solvers/online/heading_alignment.hpp>

namespace tandem {
namespace {

constexpr int kHeadings = 8;
constexpr double kLargeBias = 0.02;  // rad/s: causes a large rotation during an alignment

/// Estimates the gyroscope bias as the mean angular rate, assuming that the rotation averages out.
Vector<6> mean_rate(const NavigationData& data, double from, double seconds) {
  Vector<6> bias = Vector<6>::Zero();
  double n = 0;
  for (const ImuSample& sample : data.imu->samples) {
    if (sample.t > from + seconds) break;
    bias.tail<3>() += sample.angular_rate;
    ++n;
  }
  return n > 0 ? Vector<6>(bias / n) : bias;
}

/// Returns the cost of estimating the data from this start, in one window.
double cost_from(const NavigationData& data, const Alignment& start, double seconds, const OnlineOptions& options,
                 const Stop& stop) {
  OnlineOptions own;
  own.ego = options.ego;
  own.lag = options.lag;
  own.lag.window = 2 * seconds;
  own.lag.max_keyframes = 0;
  own.lag.before_marginalize = {};  // hooks are for the actual estimate only
  own.start = start;
  own.reset = ResetOptions::never();
  OnlineEstimator estimator(TrackingData(), online_settings(data), own);
  replay(data, start.t + seconds, estimator, stop);
  return estimator.started() && !stop.reached() ? estimator.solve_to_convergence().cost : HUGE_VAL;
}

}  // namespace

NavigationData online_settings(const NavigationData& data) {
  NavigationData settings = data;
  if (settings.imu) settings.imu->samples.clear();
  for (EgoSensor& sensor : settings.sensors) {
    sensor.measurements.clear();
    sensor.error.reset();
  }
  return settings;
}

void replay(const NavigationData& data, double until, OnlineEstimator& estimator, const Stop& stop) {
  static const std::vector<ImuSample> none;
  const std::vector<ImuSample>& samples = data.imu ? data.imu->samples : none;
  auto sample = samples.begin();
  const auto samples_to = [&](double t) {
    for (; sample != samples.end() && sample->t <= t; ++sample) estimator.add_imu(*sample);
  };
  std::vector<EgoEvent> arrivals = in_time_order(data.sensors);
  const auto measurement = [&](const EgoEvent& e) -> const EgoMeasurement& {
    return data.sensors[e.sensor].measurements[e.index];
  };
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [&](const EgoEvent& a, const EgoEvent& b) { return measurement(a).t < measurement(b).t; });
  for (const EgoEvent& event : arrivals) {
    const EgoMeasurement& m = measurement(event);
    if (m.t > until || stop.reached()) break;
    samples_to(m.t);
    estimator.add_ego(event.sensor, m);
  }
  if (!stop.reached()) samples_to(until);
  estimator.finish();
}

Alignment align(const NavigationData& data, double seconds, const OnlineOptions& options, const Stop& stop) {
  const Alignment coarse = coarse_alignment(data);
  if (!coarse.heading_unknown) return coarse;
  std::vector<Vector<6>> biases = {coarse.state.bias};
  if (data.imu && data.imu->gyroscope_bias_sigma() > kLargeBias) biases.push_back(mean_rate(data, coarse.t, seconds));
  Alignment best = coarse;
  double least = HUGE_VAL;
  for (const Vector<6>& bias : biases)
    for (int i = 0; i < kHeadings; ++i) {
      Alignment candidate = coarse;
      candidate.state = coarse.rotated_about_vertical(2 * std::numbers::pi * i / kHeadings);
      candidate.state.bias = bias;
      const double cost = cost_from(data, candidate, seconds, options, stop);
      if (!(cost < least)) continue;
      least = cost;
      best = candidate;
    }
  return best;
}

}  // namespace tandem

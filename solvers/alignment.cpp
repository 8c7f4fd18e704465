#include <cmath>

#include <tandem/problem/navigation.hpp>
#include <tandem/solvers/online_estimator.hpp>

namespace tandem {
namespace {

constexpr int kHeadings = 8;

/// Cost of estimating the data from this start, all of it in one window.
double cost_from(const NavigationData& data, const Alignment& start, double seconds, const OnlineOptions& options) {
  OnlineOptions own;
  own.ego = options.ego;
  own.lag = options.lag;
  own.lag.window = 2 * seconds;
  own.lag.max_keyframes = 0;
  own.start = start;
  OnlineEstimator estimator(TrackingData(), data, own);
  const double end = start.t + seconds;
  if (data.imu)
    for (const ImuSample& sample : data.imu->samples)
      if (sample.t <= end) estimator.add_imu(sample);
  for (const EgoEvent& event : in_time_order(data.sensors))
    if (event.t <= end) estimator.add_ego(event.sensor, data.sensors[event.sensor].measurements[event.index]);
  estimator.finish();
  return estimator.cost();
}

}  // namespace

Alignment align(const NavigationData& data, double seconds, const OnlineOptions& options) {
  const Alignment coarse = coarse_alignment(data);
  if (!coarse.heading_unknown) return coarse;
  Alignment best = coarse;
  double least = HUGE_VAL;
  for (int i = 0; i < kHeadings; ++i) {
    Alignment candidate = coarse;
    candidate.state = coarse.turned(2 * M_PI * i / kHeadings);
    const double cost = cost_from(data, candidate, seconds, options);
    if (!(cost < least)) continue;
    least = cost;
    best = candidate;
  }
  return best;
}

}  // namespace tandem

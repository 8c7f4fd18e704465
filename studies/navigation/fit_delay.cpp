#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include <tandem/solvers/stop.hpp>
#include <tandem/studies/navigation/fit_delay.hpp>

namespace tandem {
namespace {

constexpr int kFinest = 5;   // ms
constexpr int kCoarse = 80;  // ms: the first steps, halved until the finest

}  // namespace

DelayFit fit_delay(const NavigationData& data, std::size_t sensor, const NavigationOptions& options, double most) {
  NavigationData tried = data;
  NavigationOptions own = options;
  own.covariance = false;
  DelayFit fit;
  fit.sensor = data.sensors[sensor].name;
  const Stop stop(options.solver);
  const std::string what = "fitting the delay of " + fit.sensor;
  const auto navigated = [&](double delay) {
    stop.check(what);
    stop.limit(own.solver);
    tried.sensors[sensor].delay = delay;
    ++fit.solves;
    return navigate(tried, own);
  };
  own.start = navigated(data.sensors[sensor].delay).start;
  std::erase_if(tried.sensors[sensor].measurements, [&](const EgoMeasurement& m) { return m.t < own.start->t + most; });

  std::map<int, double> known;  // by ms
  const auto cost = [&](int ms) {
    if (ms < 0 || ms > 1000 * most) return HUGE_VAL;
    const auto [it, isnew] = known.try_emplace(ms);
    if (isnew) {
      const Summary summary = navigated(1e-3 * ms).summary;
      stop.check(what);  // a navigation that was cut short says nothing about the delay
      it->second = summary.converged() ? summary.cost : HUGE_VAL;
    }
    return it->second;
  };
  fit.cost_before = cost(int(std::lround(1000 * data.sensors[sensor].delay)));
  int best = 0;
  for (int ms = 0; ms <= 1000 * most; ms += kCoarse)
    if (cost(ms) < cost(best)) best = ms;
  for (int step = kCoarse / 2; step >= kFinest; step /= 2)
    for (const int ms : {best - step, best + step})
      if (cost(ms) < cost(best)) best = ms;
  fit.delay = 1e-3 * best;
  fit.cost = known.at(best);
  return fit;
}

}  // namespace tandem

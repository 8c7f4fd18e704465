#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/navigation/averaged_readings.hpp>
#include <tandem/studies/navigation/fit_delay.hpp>

namespace tandem {
namespace {

/// Range and steps of the search for a delay [ms].
struct DelayGrid {
  int min, max;
  int coarse, fine;  // the step is halved from coarse to fine
};
constexpr DelayGrid kSensorGrid{0, 1000, 80, 5}, kImuGrid{-96, 96, 16, 1};  // for the IMU, relative to the given delay

/// Returns the delay with the lowest cost on a grid relative to `origin` [s]. `cost` returns that of a delay [s].
DelayFit profile_delay(const DelayGrid& grid, double origin, double given, const std::function<double(double)>& cost) {
  DelayFit fit;
  std::map<int, double> costs;  // by delay [ms]
  const auto at = [&](int ms) {
    if (ms < grid.min || ms > grid.max) return HUGE_VAL;
    const auto [it, is_new] = costs.try_emplace(ms);
    if (is_new) it->second = cost(origin + 1e-3 * ms);
    return it->second;
  };
  fit.cost_before = at(int(std::lround(1000 * (given - origin))));
  int best = grid.min <= 0 ? 0 : grid.min;
  for (int ms = grid.min; ms <= grid.max; ms += grid.coarse)
    if (at(ms) < at(best)) best = ms;
  for (int step = grid.coarse / 2; step >= grid.fine; step /= 2)
    for (const int ms : {best - step, best + step})
      if (at(ms) < at(best)) best = ms;
  fit.delay = origin + 1e-3 * best;
  fit.cost = at(best);
  fit.solves = int(costs.size());
  const int step = grid.coarse / 4;  // large against the solver's tolerance, small against the parabolic range
  const double rise = at(best - step) + at(best + step) - 2 * fit.cost;  // (step/σ)²
  if (std::isfinite(rise) && rise > 0) fit.sigma = 1e-3 * step / std::sqrt(rise);
  return fit;
}

bool is_imu(const NavigationData& data, const std::string& sensor) { return data.imu && data.imu->name == sensor; }

EgoSensor& own_sensor(NavigationData& data, const std::string& name) {
  for (EgoSensor& sensor : data.sensors)
    if (sensor.name == name) return sensor;
  throw Error("cannot fit the delay of " + name + ": the chaser has no sensor of that name");
}

/// Discards measurements that some delay of the grid shifts out of [start, end]. They are valid `delay` before their
/// stamps.
void keep_common(const DelayGrid& grid, double start, double end, double delay, EgoSensor& sensor) {
  const double first = start + 1e-3 * grid.max, last = end - 1e-3 * grid.max;
  std::erase_if(sensor.measurements,
                [&](const EgoMeasurement& m) { return m.t - delay < first || m.t - delay > last; });
}

}  // namespace

void set_delay(NavigationData& data, const std::string& sensor, double delay) {
  if (!is_imu(data, sensor))
    own_sensor(data, sensor).delay = delay;
  else
    data.imu->set_delay(delay);
}

void report_delay_solve(const DelayFitProgress& progress, const std::string& sensor, int solve, double delay) {
  if (progress) progress(fmt::format("delay of {}: solve {}, at {:.3f} s", sensor, solve, delay));
}

std::string text(const DelayFit& fit) {
  return fmt::format(
      "Delay of {} by maximum likelihood: {:.3f}{} s (cost {:.2f}, with the given delay {:.2f}; {} solves).\n",
      fit.sensor, fit.delay, fit.sigma ? fmt::format(" ± {:.2g}", *fit.sigma) : "", fit.cost, fit.cost_before,
      fit.solves);
}

DelayFit fit_delay(const NavigationData& data, const std::string& sensor, const NavigationOptions& options,
                   const DelayFitProgress& progress) {
  NavigationData tried = data;
  check(tried);
  average_readings(tried);  // once: costs of different averages are not comparable
  const bool of_imu = is_imu(data, sensor);
  const DelayGrid grid = of_imu ? kImuGrid : kSensorGrid;
  const double before = of_imu ? data.imu->delay : own_sensor(tried, sensor).delay;
  NavigationOptions own = options;
  own.covariance = false;
  own.reject_gross_errors = false;  // a wrong delay makes correct measurements contradict each other
  DelayFit fit;
  fit.sensor = sensor;
  const Stop stop(options.solver);
  const std::string what = "fitting the delay of " + sensor;
  const auto navigated = [&](double delay) {
    stop.check(what);
    stop.limit(own.solver);
    set_delay(tried, sensor, delay);
    report_delay_solve(progress, sensor, ++fit.solves, delay);
    return navigate(tried, own);
  };
  const double origin = of_imu ? before : 0.0;  // origin of the grid
  own.start = navigated(before).start;
  const double end = of_imu ? data.imu->samples.back().t + before : HUGE_VAL;  // stamp of the last sample
  for (EgoSensor& s : tried.sensors)
    if (of_imu || s.name == sensor) keep_common(grid, own.start->t, end, of_imu ? s.delay : 0.0, s);

  const DelayFit found = profile_delay(grid, origin, before, [&](double delay) {
    const Summary summary = navigated(delay).summary;
    stop.check(what);  // the cost of a navigation that was stopped early is not comparable
    return summary.converged() ? summary.cost : HUGE_VAL;
  });
  const int solves = fit.solves;
  fit = found;
  fit.sensor = sensor;
  fit.solves = solves;
  return fit;
}

}  // namespace tandem

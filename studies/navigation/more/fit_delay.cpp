#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/navigation/more/fit_delay.hpp>

namespace tandem {
namespace {

/// What is tried: ms, of the IMU about the delay that it is said to have.
struct Grid {
  int least, most;
  int coarse;  // the first steps, halved until the finest
  int finest;
};
constexpr Grid kOfOthers{0, 1000, 80, 5}, kOfImu{-96, 96, 16, 1};

bool is_imu(const NavigationData& data, const std::string& sensor) { return data.imu && data.imu->name == sensor; }

EgoSensor& own_sensor(NavigationData& data, const std::string& name) {
  for (EgoSensor& sensor : data.sensors)
    if (sensor.name == name) return sensor;
  throw Error("there is no sensor " + name + " of the chaser's own whose delay could be found");
}

/// Leaves out what not every delay of the grid has a start and, of the inertial sensor, samples for; measurements are valid
/// `delay` before their stamps.
void keep_common(const Grid& grid, double start, double end, double delay, EgoSensor& sensor) {
  const double first = start + 1e-3 * grid.most, last = end - 1e-3 * grid.most;
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

DelayFit fit_delay(const NavigationData& data, const std::string& sensor, const NavigationOptions& options) {
  NavigationData tried = data;
  const bool of_imu = is_imu(data, sensor);
  const Grid grid = of_imu ? kOfImu : kOfOthers;
  const double before = of_imu ? data.imu->delay : own_sensor(tried, sensor).delay;
  NavigationOptions own = options;
  own.covariance = false;
  DelayFit fit;
  fit.sensor = sensor;
  const Stop stop(options.solver);
  const std::string what = "fitting the delay of " + sensor;
  const auto navigated = [&](double delay) {
    stop.check(what);
    stop.limit(own.solver);
    set_delay(tried, sensor, delay);
    ++fit.solves;
    return navigate(tried, own);
  };
  const double about = of_imu ? before : 0.0;  // of the grid
  own.start = navigated(before).start;
  const double end = of_imu ? data.imu->samples.back().t + before : HUGE_VAL;  // as stamped
  for (EgoSensor& s : tried.sensors)
    if (of_imu || s.name == sensor) keep_common(grid, own.start->t, end, of_imu ? s.delay : 0.0, s);

  std::map<int, double> known;  // by ms
  const auto cost = [&](int ms) {
    if (ms < grid.least || ms > grid.most) return HUGE_VAL;
    const auto [it, isnew] = known.try_emplace(ms);
    if (isnew) {
      const Summary summary = navigated(about + 1e-3 * ms).summary;
      stop.check(what);  // a navigation that was cut short says nothing about the delay
      it->second = summary.converged() ? summary.cost : HUGE_VAL;
    }
    return it->second;
  };
  fit.cost_before = cost(int(std::lround(1000 * (before - about))));
  int best = 0;
  for (int ms = grid.least; ms <= grid.most; ms += grid.coarse)
    if (cost(ms) < cost(best)) best = ms;
  for (int step = grid.coarse / 2; step >= grid.finest; step /= 2)
    for (const int ms : {best - step, best + step})
      if (cost(ms) < cost(best)) best = ms;
  fit.delay = about + 1e-3 * best;
  fit.cost = known.at(best);
  const int step = grid.coarse / 4;  // wide enough to rise above where solves end, and within the parabola
  const double rise = cost(best - step) + cost(best + step) - 2 * fit.cost;  // step²/σ²
  if (std::isfinite(rise) && rise > 0) fit.deviation = 1e-3 * step / std::sqrt(rise);
  return fit;
}

}  // namespace tandem

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include <Eigen/LU>
#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/solvers/heading_search/solve_tracking.hpp>
#include <tandem/studies/estimation/fit_target_delay.hpp>

namespace tandem {
namespace {

constexpr int kLongest = 3200, kCoarse = 160, kFinest = 5;  // range and steps of the search [ms]
constexpr double kRise = 8;            // rise of the cost over its minimum within which it is a parabola: four sigmas
constexpr std::size_t kMinPoints = 7;  // minimum number of points for a parabola

/// A parabola c0 + c1 x + c2 x², fitted to costs by delay [s].
struct Parabola {
  Vector<3> c;
  Matrix<3, 3> covariance;  // covariance of c, from the scatter of the costs

  explicit Parabola(const std::vector<std::pair<double, double>>& points) {
    Eigen::MatrixX3d X(points.size(), 3);
    Eigen::VectorXd y(points.size());
    for (Eigen::Index i = 0; i < y.size(); ++i) {
      const auto [x, cost] = points[std::size_t(i)];
      X.row(i) << 1, x, x * x;
      y[i] = cost;
    }
    const Matrix<3, 3> inverse = (X.transpose() * X).inverse();
    c = inverse * (X.transpose() * y);
    covariance = (y - X * c).squaredNorm() / double(y.size() - 3) * inverse;
  }
  double lowest() const { return -0.5 * c[1] / c[2]; }
  double sigma() const {
    const Vector<3> slope(0, -0.5 / c[2], 0.5 * c[1] / (c[2] * c[2]));  // gradient of lowest() with respect to c
    return std::sqrt(0.5 / c[2] + slope.dot(covariance * slope));
  }
};

/// Finds the minimum of a profile of costs. The keyframes depend on the delay, so the costs scatter by a few tenths
/// about a smooth profile. A parabola is therefore fitted to all costs near the lowest one.
DelayFit lowest_of_profile(double given, const std::function<double(int)>& cost) {
  std::map<int, double> costs;  // key: delay [ms]
  const auto add = [&](int ms) {
    if (ms >= 0 && ms <= kLongest && !costs.contains(ms)) costs.emplace(ms, cost(ms));
  };
  DelayFit fit;
  for (int ms = 0; ms <= kLongest; ms += kCoarse) add(ms);
  const auto known = costs.find(int(std::lround(1e3 * given)));
  const bool on_grid = known != costs.end();
  fit.cost_before = on_grid ? known->second : cost(int(std::lround(1e3 * given)));
  std::vector<std::pair<double, double>> points;
  for (int step = kCoarse;; step /= 2) {
    const auto best =
        std::min_element(costs.begin(), costs.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    points.clear();
    for (const auto& [ms, c] : costs)
      if (c <= best->second + kRise) points.emplace_back(1e-3 * ms, c);
    fit.delay = 1e-3 * best->first;
    fit.cost = best->second;
    if (points.size() >= kMinPoints || step / 2 < kFinest) break;
    for (int k = -3; k <= 3; ++k) add(best->first + k * step / 2);
  }
  fit.solves = int(costs.size()) + !on_grid;
  if (points.size() < 5) return fit;
  const Parabola parabola(points);
  if (!(parabola.c[2] > 0)) return fit;
  const double lowest = parabola.lowest();
  if (lowest <= 0 || lowest >= 1e-3 * kLongest) return fit;
  fit.delay = lowest;
  fit.cost = parabola.c.dot(Vector<3>(1, lowest, lowest * lowest));
  fit.sigma = parabola.sigma();
  return fit;
}

TargetSensor& target_sensor(TrackingData& data, const std::string& name) {
  const auto sensor =
      std::find_if(data.sensors.begin(), data.sensors.end(), [&](const TargetSensor& s) { return s.name == name; });
  if (sensor == data.sensors.end())
    throw Error(fmt::format("cannot fit the delay of {}: no sensor of that name observes the target", name));
  return *sensor;
}

}  // namespace

DelayFit fit_target_delay(const TrackingData& data, const std::string& sensor, const TrackingOptions& options,
                          const AnySolver& solver, bool graduated, const DelayFitProgress& progress) {
  TrackingData tried = data;
  TargetSensor& of = target_sensor(tried, sensor);
  const double given = of.delay, from = data.odometry.front().t + 1e-3 * kLongest, to = data.odometry.back().t;
  std::erase_if(of.measurements, [&](const Measurement& m) { return m.t < from || m.t > to; });
  if (of.measurements.empty())
    throw Error(fmt::format("cannot fit the delay of {}: all of its measurements are in the first {:g} s", sensor,
                            1e-3 * kLongest));
  const Stop stop(common(solver));
  const std::string what = "fitting the delay of " + sensor;
  AnySolver limited = solver;
  int solves = 0;
  DelayFit fit = lowest_of_profile(given, [&](int ms) {
    stop.check(what);
    stop.limit(common(limited));
    of.delay = 1e-3 * ms;
    report_delay_solve(progress, sensor, ++solves, of.delay);
    TrackingProblem tracking = make_tracking_problem(tried, options, stop);
    const Summary summary = std::visit(
        [&](const auto& own) {
          if (const std::string why = why_unsupported(tracking.problem, own); !why.empty()) throw Error(why);
          return solve_tracking(tracking, own, graduated);
        },
        limited);
    stop.check(what);
    return summary.converged() ? summary.cost : HUGE_VAL;
  });
  fit.sensor = sensor;
  return fit;
}

}  // namespace tandem

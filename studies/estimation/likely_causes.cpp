#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/studies/estimation/likely_causes.hpp>

namespace tandem {
namespace {

constexpr std::size_t kMeasurements = 60;      // measurements of the misfit sensor in the part that is solved
constexpr std::size_t kAllMeasurements = 300;  // measurements of all sensors in that part
constexpr int kIterations = 30;                // iterations of each trial, whose cost needs little accuracy
constexpr double kMinGain = 1.0 / 3;
constexpr std::size_t kMaxCauses = 3;

/// A mistake that users make: its text, and the change of the sensor that corrects it.
struct Hypothesis {
  std::string text;
  std::function<void(TargetSensor&)> mend;
};

template <class Change>
Hypothesis by_measurement(std::string text, Change change) {
  return {std::move(text), [change](TargetSensor& sensor) {
            for (Measurement& m : sensor.measurements) change(m);
          }};
}

/// Axes that the data of a sensor may have instead of forward, left, up. Each row is a signed unit vector.
std::vector<std::pair<std::string, Matrix<3, 3>>> axes() {
  const auto rows = [](const Vector<3>& a, const Vector<3>& b, const Vector<3>& c) {
    Matrix<3, 3> A;
    A << a.transpose(), b.transpose(), c.transpose();
    return A;
  };
  const Vector<3> x = Vector<3>::UnitX(), y = Vector<3>::UnitY(), z = Vector<3>::UnitZ();
  return {{"y and z are negated (axes forward, right, down)", rows(x, -y, -z)},
          {"z is negated", rows(x, y, -z)},
          {"y is negated", rows(x, -y, z)},
          {"x is negated", rows(-x, y, z)},
          {"x and y are negated", rows(-x, -y, z)},
          {"x and z are negated", rows(-x, y, -z)},
          {"x and y are swapped", rows(y, x, z)},
          {"x and y are swapped and z is negated (north, east, down)", rows(y, x, -z)},
          {"the axes are right, down, forward (a camera's)", rows(z, -x, -y)},
          {"the axes are right, forward, up", rows(y, -x, z)},
          {"x and z are swapped", rows(z, y, x)},
          {"y and z are swapped", rows(x, z, y)}};
}

std::vector<Hypothesis> hypotheses(const TargetSensor& sensor, bool planar) {
  std::vector<Hypothesis> all;
  const SensorType type = sensor.type;
  const bool position = type->has(measured::position), rotation = type->has(measured::rotation);
  const bool angles = type->has(measured::direction | measured::angles);
  if (rotation && !planar) {
    all.push_back(by_measurement("quaternions are ordered w x y z", [](Measurement& m) {
      const Eigen::Quaterniond q = m.rotation.quaternion();
      m.rotation = SO3(Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()));  // read as x y z w
    }));
    all.push_back(by_measurement("quaternions are inverted (sensor in target)",
                                 [](Measurement& m) { m.rotation = m.rotation.inverse(); }));
  }
  if (rotation && position)
    all.push_back(by_measurement("poses are inverted (sensor in target)", [](Measurement& m) {
      const SE3 inverse = SE3(m.rotation, m.position).inverse();
      m.rotation = inverse.rotation();
      m.position = inverse.translation();
    }));
  if (position)
    for (const auto& [text, A] : axes()) {
      if (planar && A.col(2) != Vector<3>(0, 0, 1)) continue;
      all.push_back(by_measurement(text, [A = A](Measurement& m) { m.position = A * m.position; }));
      if (rotation && A.determinant() > 0)
        all.push_back(by_measurement(text + ", also of orientations", [A = A](Measurement& m) {
          const SO3 turn = SO3(A);
          m.position = A * m.position;
          m.rotation = turn * m.rotation * turn.inverse();
        }));
    }
  if (angles) {
    const auto change = [&](const char* text, auto azimuth, auto elevation) {
      all.push_back(by_measurement(text, [azimuth, elevation](Measurement& m) {
        m.azimuth = azimuth(m.azimuth);
        m.elevation = elevation(m.elevation);
      }));
    };
    const auto same = [](double a) { return a; };
    const auto negated = [](double a) { return -a; };
    const auto radians = [](double a) { return a * std::numbers::pi / 180; };
    const auto compass = [](double a) { return std::numbers::pi / 2 - a; };
    change("angles are in degrees", radians, radians);
    change("angles increase clockwise", negated, same);
    change("elevations have the opposite sign", same, negated);
    change("angles increase clockwise and elevations have the opposite sign", negated, negated);
    change("angles are measured clockwise from the y axis", compass, same);
  }
  for (const double delay : {0.2, -0.2, 0.5, -0.5, 1.0, -1.0, 2.0, -2.0, 4.0})
    all.push_back({fmt::format("its stamps are {:.1f} s too {}", std::abs(delay), delay > 0 ? "late" : "early"),
                   [delay](TargetSensor& s) { s.delay += delay; }});
  const auto with_error = [&](const char* text, const SystematicError& error) {
    TargetSensor trial = sensor;
    trial.error = error;
    if (!sensor.error && why_unsupported(trial).empty())
      all.push_back({text, [error](TargetSensor& s) { s.error = error; }});
  };
  constexpr double kWide = 30;  // prior of the bias, relative to the sensor's noise
  with_error("it has a constant bias, or a wrong lever arm", {.bias_sigma = kWide * sensor.sigma});
  with_error("it is misaligned", {.misalignment_sigma = 0.5});
  return all;
}

/// Returns the recording around the sensor's first measurements.
TrackingData part_with(const TrackingData& data, std::size_t sensor) {
  const std::vector<Measurement>& of_sensor = data.sensors[sensor].measurements;
  const double begin = of_sensor.front().t - 5;
  double end = of_sensor[std::min(kMeasurements, of_sensor.size()) - 1].t + 5;
  std::vector<double> times;
  for (const TargetSensor& s : data.sensors)
    for (const Measurement& m : s.measurements)
      if (m.t >= begin) times.push_back(m.t);
  if (times.size() > kAllMeasurements) {
    std::nth_element(times.begin(), times.begin() + kAllMeasurements, times.end());
    end = std::min(end, times[kAllMeasurements]);
  }
  TrackingData part = data;
  std::erase_if(part.odometry, [&](const auto& at) { return at.t < begin || at.t > end; });
  for (TargetSensor& s : part.sensors)
    std::erase_if(s.measurements, [&](const Measurement& m) { return m.t < begin || m.t > end || m.held_out; });
  return part;
}

/// Returns the cost at the solution, or nothing if there is none.
std::optional<double> solved_cost(const TrackingData& data, const TrackingOptions& options, const Stop& stop) {
  try {
    TrackingProblem built = make_tracking_problem(data, options, stop);
    GaussNewtonOptions solver;
    solver.max_iterations = kIterations;
    stop.limit(solver);
    const Summary summary = solve(built.problem, solver);
    return std::isfinite(summary.cost) ? std::optional(summary.cost) : std::nullopt;
  } catch (const Stopped&) {
    throw;
  } catch (const Error&) {  // the changed data may give no valid problem
    return {};
  }
}

}  // namespace

std::vector<LikelyCause> likely_causes(const Scenario& scenario, const TrackingOptions& given, const FitReport& fit,
                                       const Stop& stop) {
  TrackingOptions options = given;
  options.max_keyframes = 0;
  if (options.non_holonomic == Role::hard) options.non_holonomic = Role::soft;
  if (options.roll_pitch == Role::hard) options.roll_pitch = Role::soft;
  options.limits = Role::soft;
  std::vector<LikelyCause> causes;
  for (std::size_t i = 0; i < scenario.data.sensors.size() && i < fit.sensors.size(); ++i) {
    if (fit.sensors[i].misfit().empty() || scenario.data.sensors[i].measurements.empty() || scenario.data.ego) continue;
    std::vector<LikelyCause> of_sensor;
    try {
      const TrackingData part = part_with(scenario.data, i);
      const std::optional<double> before = solved_cost(part, options, stop);
      if (!before) continue;
      for (const Hypothesis& hypothesis : hypotheses(scenario.data.sensors[i], scenario.data.planar)) {
        TrackingData changed = part;
        hypothesis.mend(changed.sensors[i]);
        const std::optional<double> after = solved_cost(changed, options, stop);
        if (after && *after < (1 - kMinGain) * *before)
          of_sensor.push_back({scenario.data.sensors[i].name, hypothesis.text, *before, *after});
      }
    } catch (const Stopped&) {  // the causes found so far are returned
    }
    std::stable_sort(of_sensor.begin(), of_sensor.end(),
                     [](const LikelyCause& a, const LikelyCause& b) { return a.after < b.after; });
    of_sensor.resize(std::min(of_sensor.size(), kMaxCauses));
    causes.insert(causes.end(), of_sensor.begin(), of_sensor.end());
  }
  return causes;
}

}  // namespace tandem

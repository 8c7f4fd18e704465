#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/studies/estimation/likely_causes.hpp>

namespace tandem {
namespace {

constexpr std::size_t kMeasurements = 60;      // measurements of the misfit sensor in the part that is solved
constexpr std::size_t kAllMeasurements = 300;  // measurements of all sensors in that part
constexpr int kIterations = 30;                // iterations of each trial, whose cost needs little accuracy
// Residuals without a misfit are suspicious if their root mean square exceeds 1 by this value and by this number of
// standard errors. A flexible motion model may hide wrong axes so far.
constexpr double kSuspiciousExcess = 0.25, kSuspiciousErrors = 5;
constexpr double kHiddenGain = 10, kHiddenShare = 0.05;  // minimum gains by the correction of a hidden mistake

/// Returns mistakes that users make with sensor `i`. `with_parameters` adds those that fit other mistakes, too.
std::vector<Mistake<TrackingData>> mistakes(const TrackingData& data, std::size_t i, const Frame& frame,
                                            bool with_parameters) {
  const TargetSensor& sensor = data.sensors[i];
  const bool planar = data.planar;
  std::vector<Mistake<TrackingData>> all;
  const auto add = [&](std::string text, auto mend) {
    all.push_back({sensor.name, std::move(text), [i, mend](TrackingData& d) { mend(d.sensors[i]); }});
  };
  const auto by_measurement = [&](std::string text, auto change) {
    add(std::move(text), [change](TargetSensor& s) {
      for (Measurement& m : s.measurements) change(m);
    });
  };
  const SensorType type = sensor.type;
  const bool position = type->has(measured::position), rotation = type->has(measured::rotation);
  const bool angles = type->has(measured::direction | measured::angles);
  if (rotation && !planar) {
    by_measurement(kQuaternionOrder,
                   [frame](Measurement& m) { m.rotation = frame.body(ordered_w_first(frame.body(m.rotation))); });
    by_measurement("quaternions are inverted (sensor in target)",
                   [](Measurement& m) { m.rotation = m.rotation.inverse(); });
  }
  if (rotation && position)
    by_measurement("poses are inverted (sensor in target)", [](Measurement& m) {
      const SE3 inverse = SE3(m.rotation, m.position).inverse();
      m.rotation = inverse.rotation();
      m.position = inverse.translation();
    });
  if (position)
    for (const auto& [text, A] : mistaken_axes(frame.body_axes())) {
      if (planar && A.col(2) != Vector<3>(0, 0, 1)) continue;
      by_measurement(text, [A = A](Measurement& m) { m.position = A * m.position; });
      if (rotation && A.determinant() > 0)
        by_measurement(text + ", also of orientations", [A = A](Measurement& m) {
          const SO3 turn = SO3(A);
          m.position = A * m.position;
          m.rotation = turn * m.rotation * turn.inverse();
        });
    }
  if (angles) {
    const auto change = [&](const char* text, auto azimuth, auto elevation) {
      by_measurement(text, [azimuth, elevation](Measurement& m) {
        m.azimuth = azimuth(m.azimuth);
        m.elevation = elevation(m.elevation);
      });
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
  if (!with_parameters) return all;
  for (const double delay : kMistakenDelays)
    add(mistaken_delay_text(delay), [delay](TargetSensor& s) { s.delay += delay; });
  const auto with_error = [&](const char* text, const SystematicError& error) {
    TargetSensor trial = sensor;
    trial.error = error;
    if (!sensor.error && why_unsupported(trial).empty()) add(text, [error](TargetSensor& s) { s.error = error; });
  };
  with_error(kMistakenLeverArm, {.bias_sigma = kWideBias * sensor.sigma});
  with_error(kMisaligned, {.misalignment_sigma = kWideMisalignment});
  return all;
}

bool is_suspicious(const SensorFit& sensor) {
  return std::any_of(sensor.series.begin(), sensor.series.end(), [](const ResidualSeries& series) {
    const double excess = series.rms() - 1;
    return excess > kSuspiciousExcess && excess * std::sqrt(2.0 * double(series.value.size())) > kSuspiciousErrors;
  });
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
  if (scenario.data.ego) return {};
  TrackingOptions options = given;
  options.max_keyframes = 0;
  if (options.non_holonomic == Role::hard) options.non_holonomic = Role::soft;
  if (options.roll_pitch == Role::hard) options.roll_pitch = Role::soft;
  options.limits = Role::soft;
  // A sensor with a misfit distorts the residuals of others, and only marginals show how large residuals should be.
  const bool hidden_ones = fit.by_marginals && std::none_of(fit.sensors.begin(), fit.sensors.end(),
                                                            [](const SensorFit& s) { return !s.misfit().empty(); });
  std::vector<LikelyCause> causes;
  for (std::size_t i = 0; i < scenario.data.sensors.size() && i < fit.sensors.size(); ++i) {
    if (scenario.data.sensors[i].measurements.empty()) continue;
    const bool misfit = !fit.sensors[i].misfit().empty();
    if (!misfit && !(hidden_ones && is_suspicious(fit.sensors[i]))) continue;
    const double noise = std::max(1.0, fit.cost / fit.expected_cost);  // larger than stated
    const RequiredGain gain = misfit ? RequiredGain{} : RequiredGain{kHiddenShare, kHiddenGain * noise};
    const std::vector<LikelyCause> of_sensor = explaining(
        mistakes(scenario.data, i, scenario.frame, misfit), part_with(scenario.data, i),
        [&](const TrackingData& part) { return solved_cost(part, options, stop); }, gain);
    causes.insert(causes.end(), of_sensor.begin(), of_sensor.end());
  }
  return causes;
}

}  // namespace tandem

#include <algorithm>
#include <cmath>
#include <numbers>

#include <tandem/studies/navigation/likely_own_causes.hpp>

namespace tandem {
namespace {

constexpr double kFirstPass = 5;     // s; window of the first pass of a trial
constexpr double kPart = 80;         // s of data in a trial
constexpr int kIterations = 30;      // of a trial
constexpr double kTolerance = 1e-4;  // of a trial's cost, of which only large differences matter
constexpr double kMaxSquare = 100;   // of one residual, since a single one is no mistake of this kind
using OwnMistake = Mistake<NavigationData>;

/// Adds a mistake of the measurements of sensor `i`.
template <class Change>
void by_measurement(const EgoSensor& sensor, std::size_t i, std::string text, Change change,
                    std::vector<OwnMistake>& all) {
  all.push_back({sensor.name, std::move(text), [i, change](NavigationData& d) {
                   for (EgoMeasurement& m : d.sensors[i].measurements) change(m);
                 }});
}

/// Adds mistakes of an orientation's yaw ψ in the files: ±ψ + k 90°.
void add_yaw_mistakes(const EgoSensor& sensor, std::size_t i, const Frame& frame, std::vector<OwnMistake>& all) {
  constexpr double kRight = std::numbers::pi / 2;
  const auto turned = [&](std::string text, double sign, double offset) {
    by_measurement(
        sensor, i, std::move(text),
        [=](EgoMeasurement& m) {
          const SO3 file = frame.world(m.rotation);
          const Matrix<3, 3> R = file.matrix();
          const double yaw = std::atan2(R(1, 0), R(0, 0));
          const SO3 turn = SO3::Exp({0, 0, sign * yaw + offset - yaw});
          m.rotation = frame.world(turn * file);
        },
        all);
  };
  turned("headings are negated", -1, 0);
  turned("headings are measured clockwise from the y axis", -1, kRight);
  turned("headings are negated and off by 180°", -1, 2 * kRight);
  turned("headings are negated and off by 90°", -1, -kRight);
  turned("headings are 90° too small", 1, kRight);
  turned("headings are 90° too large", 1, -kRight);
  turned("headings are off by 180°", 1, 2 * kRight);
}

/// Adds mistakes without free parameters.
void add_fixed_mistakes(const EgoSensor& sensor, std::size_t i, const Frame& frame, std::vector<OwnMistake>& all) {
  switch (sensor.type->reading) {
    case EgoReading::body_vector:
    case EgoReading::world_vector: {
      const bool body = sensor.type->reading == EgoReading::body_vector;
      for (const auto& [text, A] : mistaken_axes(body ? frame.body_axes() : frame.world_axes()))
        by_measurement(
            sensor, i, text, [A = A](EgoMeasurement& m) { m.value = A * m.value; }, all);
      break;
    }
    case EgoReading::world_height:
      by_measurement(
          sensor, i, "depths have the opposite sign", [](EgoMeasurement& m) { m.value = -m.value; }, all);
      break;
    case EgoReading::orientation:
      by_measurement(
          sensor, i, kQuaternionOrder,
          [frame](EgoMeasurement& m) { m.rotation = frame.world(ordered_w_first(frame.world(m.rotation))); }, all);
      by_measurement(
          sensor, i, "quaternions are inverted (world in sensor)",
          [](EgoMeasurement& m) { m.rotation = m.rotation.inverse(); }, all);
      add_yaw_mistakes(sensor, i, frame, all);
      break;
  }
}

void add_imu_mistakes(const ImuSensor& imu, const Frame& frame, std::vector<OwnMistake>& all) {
  const auto add = [&](std::string text, const Matrix<3, 3>& force, const Matrix<3, 3>& rate) {
    all.push_back({imu.name, std::move(text), [force, rate](NavigationData& d) {
                     for (ImuSample& sample : d.imu->samples) {
                       sample.specific_force = force * sample.specific_force;
                       sample.angular_rate = rate * sample.angular_rate;
                     }
                   }});
  };
  const Matrix<3, 3> same = Matrix<3, 3>::Identity();
  for (const auto& [text, A] : mistaken_axes(frame.body_axes())) add(text, A, A);
  add("angular rates are negated", same, -same);
  add("specific forces are negated", -same, same);
}

/// Returns mistakes whose parameters may fit other ones, too.
std::vector<OwnMistake> flexible_mistakes(const NavigationData& data) {
  std::vector<OwnMistake> all;
  for (std::size_t i = 0; i < data.sensors.size(); ++i) {
    const EgoSensor& sensor = data.sensors[i];
    if (sensor.measurements.empty()) continue;
    const double rows = double(sensor.sigma.size()) * double(sensor.measurements.size());
    all.push_back({sensor.name, kContradicts, [i](NavigationData& d) { d.sensors[i].measurements.clear(); }, rows / 2});
    for (const double delay : kMistakenDelays)
      all.push_back({sensor.name, mistaken_delay_text(delay), [=](NavigationData& d) { d.sensors[i].delay += delay; }});
    if (sensor.error) continue;
    const auto with_error = [&](const char* text, const SystematicError& error) {
      all.push_back({sensor.name, text, [i, error](NavigationData& d) { d.sensors[i].error = error; }});
    };
    with_error(kMistakenLeverArm, {.bias_sigma = kWideBias * sensor.sigma});
    if (sensor.type->reading == EgoReading::body_vector)
      with_error(kMisaligned, {.misalignment_sigma = kWideMisalignment});
  }
  if (data.imu)
    for (const double delay : kMistakenDelays)
      all.push_back({data.imu->name, mistaken_delay_text(delay),
                     [delay](NavigationData& d) { d.imu->set_delay(d.imu->delay + delay); }});
  return all;
}

/// Returns whether a finding says that the IMU contradicts the other sensors and was left out.
bool excludes_imu(const NavigationFinding& finding, const NavigationData& data) {
  return finding.kind == NavigationFinding::Kind::rejected && data.imu && finding.sensor == data.imu->name;
}

/// Returns the start of the part of kPart seconds that has the largest share of the contradictions [s].
double worst_part(const Navigation& result) {
  struct Contradiction {
    double t, weight;
  };
  std::vector<Contradiction> all;
  const auto add = [&all](std::vector<Contradiction> of_sensor) {
    double sum = 0;
    for (const Contradiction& c : of_sensor) sum += c.weight;
    for (const Contradiction& c : of_sensor) all.push_back({c.t, c.weight / sum});
  };
  for (const SensorFit& sensor : result.fit.sensors) {
    if (sensor.misfit().empty()) continue;
    std::vector<Contradiction> of_sensor;
    for (const ResidualSeries& series : sensor.series)
      for (std::size_t k = 0; k < series.t.size(); ++k)
        of_sensor.push_back({series.t[k], std::min(kMaxSquare, series.value[k] * series.value[k])});
    for (const double t : sensor.rejected_at) of_sensor.push_back({t, kMaxSquare});
    add(std::move(of_sensor));
  }
  for (const NavigationFinding& finding : result.findings)
    if (excludes_imu(finding, result.data)) add({{finding.from, 1}, {finding.to, 1}});
  double best = -1, start = result.states.front().t;
  for (double from = start; from < result.states.back().t; from += kPart / 8) {
    double inside = 0;
    for (const Contradiction& c : all)
      if (c.t >= from && c.t <= from + kPart) inside += c.weight;
    if (inside > best * (1 + 1e-9)) {
      best = inside;
      start = from;
    }
  }
  return start;
}

NavigationData part_from(double begin, NavigationData data) {
  const auto outside = [begin](double t) { return t < begin || t > begin + kPart; };
  if (data.imu) std::erase_if(data.imu->samples, [&](const ImuSample& sample) { return outside(sample.t); });
  for (EgoSensor& sensor : data.sensors)
    std::erase_if(sensor.measurements, [&](const EgoMeasurement& m) { return outside(m.t); });
  return data;
}

}  // namespace

std::vector<LikelyCause> likely_own_causes(const NavigationData& data, const NavigationOptions& options,
                                           const Navigation& result, const Frame& frame) {
  const bool without_imu =
      std::any_of(result.findings.begin(), result.findings.end(),
                  [&](const NavigationFinding& finding) { return excludes_imu(finding, result.data); });
  if (result.fit.consistent() && !without_imu) return {};
  const Stop stop(options.solver);
  NavigationOptions trial = options;
  trial.covariance = false;
  trial.reject_gross_errors = false;  // a wrong sensor makes others look wrong
  trial.gated_first_pass = false;
  trial.first_pass = std::min(options.first_pass, kFirstPass);
  trial.built = {};
  trial.start.reset();
  trial.at.clear();
  trial.solver.max_iterations = std::min(options.solver.max_iterations, kIterations);
  trial.solver.cost_tolerance = std::max(options.solver.cost_tolerance, kTolerance);
  const auto cost = [&](const NavigationData& part) -> std::optional<double> {
    stop.check("search for likely causes of misfits");
    NavigationOptions limited = trial;
    stop.limit(limited.solver);
    try {
      const double found = navigate(part, limited).summary.cost;
      stop.check("search for likely causes of misfits");
      return std::isfinite(found) ? std::optional(found) : std::nullopt;
    } catch (const Stopped&) {
      throw;
    } catch (const Error&) {  // the changed data may give no valid problem
      return {};
    }
  };
  const NavigationData part = part_from(worst_part(result), data);
  std::vector<OwnMistake> fixed;
  for (std::size_t i = 0; i < part.sensors.size(); ++i)
    if (!part.sensors[i].measurements.empty()) add_fixed_mistakes(part.sensors[i], i, frame, fixed);
  if (part.imu) add_imu_mistakes(*part.imu, frame, fixed);
  std::vector<LikelyCause> causes = explaining(fixed, part, cost);
  return causes.empty() ? explaining(flexible_mistakes(part), part, cost) : causes;
}

}  // namespace tandem

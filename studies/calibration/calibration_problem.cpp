#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/quantile.hpp>
#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/solvers/profile_evidence.hpp>
#include <tandem/studies/calibration/calibration_problem.hpp>
#include <tandem/studies/fit/judged_measurements.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/scenario/named_noise.hpp>

namespace tandem {
namespace {

Components noise_components(const std::string& noise, bool planar) {
  if (noise == "constant_velocity") return point_components(planar);
  if (noise == "roll_pitch") return {{"roll", true}, {"pitch", true}};
  if (noise == "non_holonomic") return planar ? Components{{"sway"}} : Components{{"sway"}, {"heave"}};
  return pose_components(planar);
}

/// Returns whether a noise entry is an assumption (a prior, a boundary condition, a limit) and not estimated from data.
bool is_assumed(const std::string& noise) {
  return noise == "prior" || noise == "boundary" || noise == "surge" || noise == "yaw_rate" || noise == "twist_time" ||
         noise == "velocity_time";
}

CalibratedEntry entry_of(std::string name, const Components& components, std::vector<double> sigmas, bool turned) {
  CalibratedEntry entry{std::move(name), "", {}, {}, std::move(sigmas), {}};
  for (const auto& [component, angle] : components) {
    entry.components.push_back(component);
    entry.angle.push_back(angle);
  }
  entry.row.resize(entry.components.size());
  std::iota(entry.row.begin(), entry.row.end(), 0);
  if (turned) std::swap(entry.row[0], entry.row[1]);  // files have north first, the problem east
  if (entry.components.size() == 1 && !entry.name.ends_with("holonomic")) entry.components[0].clear();
  return entry;
}

CalibratedEntry own_entry(const EgoSensor& sensor, const Frame& frame, bool error) {
  const bool world = sensor.type->reading == EgoReading::world_vector;
  const Eigen::VectorXd& sigma = error ? sensor.error->bias_sigma : sensor.sigma;
  std::vector<double> sigmas(sigma.data(), sigma.data() + sigma.size());
  const bool turned = world && frame.is_ned();
  if (turned) std::swap(sigmas[0], sigmas[1]);
  CalibratedEntry entry =
      entry_of(error ? error_name(sensor.name) : sensor.name, ego_components(sensor), std::move(sigmas), turned);
  entry.kind = name(sensor.type);
  entry.sensor = !error;
  entry.dead_reckoning = !world && (error || !sensor.error || !sensor.error->has_bias());
  return entry;
}

/// Returns the longest time without a position fix, including before the first and after the last one [s].
double longest_gap(const NavigationData& data, const std::vector<PlacedEgoMeasurement>& placed) {
  if (placed.empty()) return 0;
  const auto [first, last] =
      std::minmax_element(placed.begin(), placed.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
  std::vector<double> times = {first->t, last->t};
  for (const PlacedEgoMeasurement& m : placed)
    if (data.sensors[m.sensor].type->reading == EgoReading::world_vector) times.push_back(m.t);
  std::sort(times.begin(), times.end());
  return detail::longest_step(times);
}

double longest_without_position(const std::vector<Keyframe>& keyframes) {
  std::vector<double> times = {keyframes.front().t};
  for (const Keyframe& k : keyframes)
    if (k.type == KeyframeType::position || k.type == KeyframeType::pose) times.push_back(k.t);
  times.push_back(keyframes.back().t);
  return detail::longest_step(times);
}

std::size_t entry_index(const std::vector<CalibratedEntry>& entries, std::string_view name) {
  const auto at =
      std::find_if(entries.begin(), entries.end(), [&](const CalibratedEntry& e) { return e.name == name; });
  if (at == entries.end()) throw Error(fmt::format("calibrate: unknown noise entry {}", name));
  return std::size_t(at - entries.begin());
}

/// Removes readings and IMU samples that are not in `kept`, data of the same recording.
void keep_common(NavigationData& data, const NavigationData& kept) {
  const auto erase = [](auto& values, const auto& others) {
    std::set<double> times;
    for (const auto& value : others) times.insert(value.t);
    std::erase_if(values, [&](const auto& value) { return !times.contains(value.t); });
  };
  if (data.imu && kept.imu) erase(data.imu->samples, kept.imu->samples);
  for (EgoSensor& sensor : data.sensors)
    for (const EgoSensor& other : kept.sensors)
      if (other.name == sensor.name) erase(sensor.measurements, other.measurements);
}

/// Navigates the chaser, or starts from a similar navigation. In a scenario with a target, sets the odometry to it.
std::shared_ptr<const EgoTrack> navigate_chaser(Scenario& scenario, const NavigationOptions& own,
                                                const EgoTrack* similar) {
  const bool has_target = !scenario.data.sensors.empty();
  if (!similar && has_target) {
    scenario = navigated(std::move(scenario), own).scenario;
    return scenario.data.ego;
  }
  EgoTrack track{{}, {}, {}, own.ego};
  if (similar) {
    track.data = std::move(*scenario.navigation);
    prepare(track.data, own);
    keep_common(track.data, similar->data);
    track.start = similar->start;
    track.states = similar->states;
  } else {
    NavigationOptions options = own;
    options.covariance = false;
    Navigation found = navigate(*scenario.navigation, options);
    track.data = std::move(found.data);
    track.start = found.start;
    track.states = std::move(found.states);
  }
  const auto navigation = std::make_shared<const EgoTrack>(std::move(track));
  if (has_target) set_navigation(navigation, scenario.data);
  return navigation;
}

}  // namespace

std::string CalibratedEntry::parameter(std::size_t component) const {
  return components[component].empty() ? name : name + "." + components[component];
}

std::vector<CalibratedEntry> calibrated_entries(const Scenario& scenario) {
  std::vector<CalibratedEntry> entries;
  TrackingData data = scenario.data;
  const bool target = !data.sensors.empty(), planar = data.planar;
  if (target) {
    convert_noise_axes(data.noise, scenario.frame);  // from ENU to the axes of the files
    for (const NamedNoise& noise : named_noise(data)) {
      if (is_assumed(noise.name)) continue;
      const auto sensor = std::find_if(data.sensors.begin(), data.sensors.end(), [&](const TargetSensor& s) {
        return s.name == noise.name || (s.error && s.error->has_bias() && error_name(s.name) == noise.name);
      });
      const bool is_sensor = sensor != data.sensors.end();
      const Components components =
          is_sensor ? sensor_components(sensor->type, planar) : noise_components(noise.name, planar);
      std::vector<double> sigmas(noise.sigmas.begin(), noise.sigmas.begin() + std::ptrdiff_t(components.size()));
      entries.push_back(entry_of(noise.name, components, std::move(sigmas),
                                 noise.name == "constant_velocity" && scenario.frame.is_ned()));
      entries.back().sensor = is_sensor && sensor->name == noise.name;
      if (is_sensor) entries.back().kind = name(sensor->type);
    }
  }
  if (scenario.navigation && (!target || needs_navigation(scenario) || data.ego))
    for (const EgoSensor& sensor : scenario.navigation->sensors)
      for (const bool error : {false, true})
        if (!error || (sensor.error && sensor.error->has_bias()))
          entries.push_back(own_entry(sensor, scenario.frame, error));
  std::stable_partition(entries.begin(), entries.end(), [](const CalibratedEntry& e) { return e.sensor; });
  return entries;
}

CalibrationProblem::CalibrationProblem(Scenario scenario, const TrackingOptions& target, const NavigationOptions& own,
                                       const Stop& stop, const EgoTrack* similar)
    : scenario(scenario.name), entries(calibrated_entries(scenario)) {
  const bool has_target = !scenario.data.sensors.empty();
  if (!has_target && !scenario.navigation)
    throw Error(fmt::format("{} has no sensors to calibrate, neither of the target nor of the chaser", scenario.name));
  if (!has_target || needs_navigation(scenario)) navigation = navigate_chaser(scenario, own, similar);
  if (!has_target) {
    NavigationProblem& built = built_.emplace<NavigationProblem>(
        make_navigation_problem(navigation->data, navigation->states, navigation->start, own.ego, stop));
    add_own(navigation->data, built.measurements);
    return;
  }
  TrackingProblem& built = built_.emplace<TrackingProblem>(make_tracking_problem(scenario.data, target, stop));
  add_target(scenario, target, built);
  if (scenario.data.ego) add_own(scenario.data.ego->data, built.ego_measurements);
}

std::pair<double, double> CalibrationProblem::measured_span() const {
  double from = HUGE_VAL, to = -HUGE_VAL;
  for (const EntryBlock& b : blocks)
    if (b.measured_at) {
      from = std::min(from, *b.measured_at);
      to = std::max(to, *b.measured_at);
    }
  return {from, to};
}

std::vector<SystematicErrorEstimate> CalibrationProblem::constants(const Stop& stop) {
  const auto of = [&stop]<class Built>(Built& built) -> std::vector<SystematicErrorEstimate> {
    if (built.constants.empty()) return {};
    const Marginals marginals(built.problem, {}, stop);
    if constexpr (std::same_as<Built, TrackingProblem>)
      return systematic_error_estimates_by_evidence(built.problem, built.constants, marginals, stop);
    return systematic_error_estimates(built.problem, built.constants, &marginals);
  };
  return std::visit(of, built_);
}

std::vector<std::pair<double, double>> CalibrationProblem::evidence_along(const SystematicErrorEstimate& constant,
                                                                          const Stop& stop) {
  constexpr int kPoints = 7;
  constexpr double kReach = 2.4;  // standard errors
  for (const SensorConstant& c : sensor_constants()) {
    const auto* const x = std::get_if<Variable<Rn<1>>>(&c.state);
    if (!x || (c.name != constant.name && c.name + ".1" != constant.name)) continue;
    const double reach = kReach * (constant.sigma > 0 ? constant.sigma : constant.prior_sigma);
    std::vector<double> values;
    for (int k = 0; k < kPoints; ++k) values.push_back(constant.value + reach * (2.0 * k / (kPoints - 1) - 1));
    const std::vector<double> along = tandem::profile_evidence(problem(), *x, values, stop);
    const auto prior = [&](double value) { return -0.5 * std::pow(value / constant.prior_sigma, 2); };
    std::vector<std::pair<double, double>> of_data;
    for (std::size_t k = 0; k < along.size(); ++k)
      if (std::isfinite(along[k])) of_data.emplace_back(values[k], along[k] - prior(values[k]) + prior(constant.value));
    return of_data;
  }
  return {};
}

bool CalibrationProblem::is_own(const std::string& constant) const {
  return std::any_of(own_sensors_.begin(), own_sensors_.end(),
                     [&](const std::string& sensor) { return constant.starts_with(sensor + "."); });
}

template <class Sensors, class Placed>
void CalibrationProblem::record_unmeasured(const Sensors& sensors, const Placed& placed) {
  for (std::size_t i = 0; i < sensors.size(); ++i)
    if (sensors[i].error && std::none_of(placed.begin(), placed.end(), [&](const auto& m) { return m.sensor == i; }))
      without_measurements.push_back(sensors[i].name);
}

void CalibrationProblem::add_target(const Scenario& scenario, const TrackingOptions& options,
                                    const TrackingProblem& built) {
  longest_without_target_position = longest_without_position(built.keyframes);
  for (const NoiseBlock& noised : built.noise_blocks) {
    if (is_assumed(std::string(noised.noise))) continue;
    const bool triple = noised.noise == "constant_twist" || noised.noise == "constant_velocity";
    blocks.push_back({entry_index(entries, noised.noise),
                      noised.block,
                      0,
                      {},
                      triple ? 1.0 / double(options.horizons.size()) : 1.0});
  }
  record_unmeasured(scenario.data.sensors, built.measurements);
  const int rotation = scenario.data.planar ? 2 : 3;  // first orientation row of a pose
  for (const PlacedMeasurement& m : built.measurements) {
    const TargetSensor& sensor = scenario.data.sensors[m.sensor];
    const std::size_t entry = entry_index(entries, sensor.name);
    const double t = sensor.measurements[m.index].t;
    // A position split into two blocks counts once in total; the orientation counts fully.
    const double share = m.position ? options.position_share : 0;
    if (m.block && share > 0) {
      blocks.push_back({entry, *m.block, 0, t, 1 - share, rotation});
      blocks.push_back({entry, *m.position, 0, t, share, -1, false});
      continue;
    }
    if (m.block) blocks.push_back({entry, *m.block, 0, t});
    if (m.orientation) blocks.push_back({entry, *m.orientation, rotation, t});
    if (!m.block && !m.innovation) ++num_gross_outliers;
  }
}

void CalibrationProblem::add_own(const NavigationData& data, const std::vector<PlacedEgoMeasurement>& placed) {
  longest_without_fix = longest_gap(data, placed);
  record_unmeasured(data.sensors, placed);
  for (const EgoSensor& sensor : data.sensors) own_sensors_.push_back(sensor.name);
  for (const PlacedEgoMeasurement& m : placed) {
    const std::string& sensor = data.sensors[m.sensor].name;
    if (m.block) blocks.push_back({entry_index(entries, sensor), *m.block, 0, m.t});
    if (m.bias_block) blocks.push_back({entry_index(entries, error_name(sensor)), *m.bias_block, 0, {}});
  }
}

}  // namespace tandem

#include <algorithm>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/calibration/scenario_numbers.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/sensor_numbers.hpp>

namespace tandem {
namespace {

struct NumberOrNone {
  ScenarioNumber number;
  std::string why_not;
};

SensorLosses losses_of(const TrackingOptions& target, const NavigationOptions& own) {
  return {.target = target.loss,
          .own = own.ego.loss,
          .orientation_apart = target.orientation_loss.has_value(),
          .by_parts = target.position_share > 0 || without_orientation(target.model)};
}

/// Of the target's motion, along the files' axes.
void add_times(const Scenario& scenario, const TrackingOptions& target, std::vector<NumberOrNone>& all) {
  if (scenario.data.sensors.empty()) return;
  const bool planar = scenario.data.planar;
  const bool twist = target.model == MotionModel::damped_twist;
  const bool velocity = target.model == MotionModel::damped_velocity || (twist && target.mode == Mode::B);
  const auto add = [&](const char* entry, Eigen::VectorXd TrackingNoise::*times, std::vector<std::string> components,
                       bool turned, const std::string& why_not) {
    for (std::size_t c = 0; c < components.size(); ++c) {
      const auto row = Eigen::Index(turned && c < 2 ? 1 - c : c);
      const auto set = [times, row](Scenario& s, double time) { (s.data.noise.*times)[row] = time; };
      all.push_back(
          {{fmt::format("{}.{}", entry, components[c]), entry, c, (scenario.data.noise.*times)[row], true, set},
           why_not});
    }
  };
  std::vector<std::string> axes = {"x", "y"}, pose = axes;
  if (!planar) axes.push_back("z");
  for (const char* more : {"z", "rx", "ry", "rz"})
    if (!planar) pose.emplace_back(more);
  if (planar) pose.emplace_back("yaw");
  const std::string no =
      fmt::format("the model {}{} forgets no ", name(target.model), target.mode == Mode::B ? " in mode B" : "");
  add("twist_time", &TrackingNoise::twist_time, pose, false,
      twist ? "" : no + "twist: give --model damped-twist, or leave it out");
  add("velocity_time", &TrackingNoise::velocity_time, axes, scenario.frame.is_ned(),
      velocity ? "" : no + "velocity: give --model damped-velocity, or damped-twist with --mode B, or leave it out");
}

std::vector<NumberOrNone> all_numbers(const Scenario& scenario, const TrackingOptions& target,
                                      const NavigationOptions& own) {
  std::vector<NumberOrNone> all;
  add_times(scenario, target, all);
  const SensorLosses losses = losses_of(target, own);
  Scenario copy = scenario;
  for (const SensorNumber& n : sensor_numbers(copy, losses)) {
    const auto set = [name = n.name, losses](Scenario& s, double value) {
      for (const SensorNumber& other : sensor_numbers(s, losses))
        if (other.name == name) other.set(value);
    };
    all.push_back({{n.name, n.name, 0, n.value, n.name.ends_with(".time"), set}, n.why_not});
  }
  return all;
}

}  // namespace

std::vector<ScenarioNumber> take_numbers(const Scenario& scenario, const TrackingOptions& target,
                                         const NavigationOptions& own, std::vector<std::string>& free) {
  std::vector<ScenarioNumber> taken;
  std::vector<std::string> known;
  for (const NumberOrNone& one : all_numbers(scenario, target, own)) {
    const ScenarioNumber& number = one.number;
    bool named = false;
    for (const std::string& name : free) {
      if (name != number.name && name != number.entry) continue;
      if (!one.why_not.empty()) throw Error(fmt::format("--free {}: {}", name, one.why_not));
      named = true;
    }
    known.insert(known.end(), {number.name, number.entry});
    if (named) taken.push_back(number);
  }
  std::erase_if(free,
                [&](const std::string& name) { return std::find(known.begin(), known.end(), name) != known.end(); });
  return taken;
}

std::vector<NoiseEntry> entries_of(const std::vector<ScenarioNumber>& numbers, const Scenario& scenario) {
  std::vector<NoiseEntry> entries;
  for (const ScenarioNumber& number : numbers) {
    if (!entries.empty() && entries.back().name == number.entry) continue;
    TrackingNoise noise = scenario.data.noise;
    turn_noise(noise, scenario.frame);
    NoiseEntry& entry = entries.emplace_back(NoiseEntry{number.entry, {number.given}});
    for (const auto& [name, times] :
         {std::pair{"twist_time", &noise.twist_time}, {"velocity_time", &noise.velocity_time}})
      if (number.entry == name) entry.sigmas.assign(times->data(), times->data() + times->size());
  }
  return entries;
}

std::vector<NumberEntry> number_entries(const Scenario& scenario, const TrackingOptions& target,
                                        const NavigationOptions& own) {
  std::vector<NumberEntry> entries;
  for (const auto& [number, why_not] : all_numbers(scenario, target, own)) {
    if (entries.empty() || entries.back().name != number.entry) entries.push_back({number.entry, {}, why_not.empty()});
    if (number.name != number.entry) entries.back().components.push_back(number.name.substr(number.entry.size() + 1));
  }
  return entries;
}

}  // namespace tandem

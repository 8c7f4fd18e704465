#include <algorithm>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/calibration/model_parameters.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/sensor_parameters.hpp>

namespace tandem {
namespace {

struct MaybeParameter {
  ModelParameter parameter;
  std::string why_not;  // the reason if the scenario or its motion model does not have it
};

SensorLosses losses_of(const TrackingOptions& target, const NavigationOptions& own) {
  return {.target = target.loss,
          .own = own.ego.loss,
          .separate_orientation = target.orientation_loss.has_value(),
          .split_poses = target.position_share > 0 || is_point_model(target.model)};
}

/// Adds the time constants of the target's motion, in the axes of the files.
void add_times(const Scenario& scenario, const TrackingOptions& target, std::vector<MaybeParameter>& all) {
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
  const std::string no = fmt::format("the model {}{} has no time constant of the ", name(target.model),
                                     target.mode == Mode::B ? " in mode B" : "");
  add("twist_time", &TrackingNoise::twist_time, pose, false,
      twist ? "" : no + "twist; use --model damped-twist, or remove it from --free");
  add("velocity_time", &TrackingNoise::velocity_time, axes, scenario.frame.is_ned(),
      velocity ? ""
               : no + "velocity; use --model damped-velocity, or damped-twist with --mode B, or remove it from --free");
}

std::vector<MaybeParameter> all_model_parameters(const Scenario& scenario, const TrackingOptions& target,
                                                 const NavigationOptions& own) {
  std::vector<MaybeParameter> all;
  add_times(scenario, target, all);
  const SensorLosses losses = losses_of(target, own);
  Scenario copy = scenario;
  for (const SensorParameter& p : sensor_parameters(copy, losses)) {
    const auto set = [name = p.name, losses](Scenario& s, double value) {
      for (const SensorParameter& other : sensor_parameters(s, losses))
        if (other.name == name) other.set(value);
    };
    all.push_back({{p.name, p.name, 0, p.value, p.name.ends_with(".time"), set}, p.why_not});
  }
  return all;
}

}  // namespace

std::vector<ModelParameter> take_model_parameters(const Scenario& scenario, const TrackingOptions& target,
                                                  const NavigationOptions& own, std::vector<std::string>& free) {
  std::vector<ModelParameter> taken;
  std::vector<std::string> known;
  for (const MaybeParameter& one : all_model_parameters(scenario, target, own)) {
    const ModelParameter& parameter = one.parameter;
    bool named = false;
    for (const std::string& name : free) {
      if (name != parameter.name && name != parameter.entry) continue;
      if (!one.why_not.empty()) throw Error(fmt::format("--free {}: {}", name, one.why_not));
      named = true;
    }
    known.insert(known.end(), {parameter.name, parameter.entry});
    if (named) taken.push_back(parameter);
  }
  std::erase_if(free,
                [&](const std::string& name) { return std::find(known.begin(), known.end(), name) != known.end(); });
  return taken;
}

std::vector<NoiseEntry> entries_of(const std::vector<ModelParameter>& parameters, const Scenario& scenario) {
  std::vector<NoiseEntry> entries;
  for (const ModelParameter& parameter : parameters) {
    if (!entries.empty() && entries.back().name == parameter.entry) continue;
    TrackingNoise noise = scenario.data.noise;
    convert_noise_axes(noise, scenario.frame);
    NoiseEntry& entry = entries.emplace_back(NoiseEntry{parameter.entry, {parameter.given}});
    for (const auto& [name, times] :
         {std::pair{"twist_time", &noise.twist_time}, {"velocity_time", &noise.velocity_time}})
      if (parameter.entry == name) entry.sigmas.assign(times->data(), times->data() + times->size());
  }
  return entries;
}

std::vector<ModelParameterEntry> model_parameter_entries(const Scenario& scenario, const TrackingOptions& target,
                                                         const NavigationOptions& own) {
  std::vector<ModelParameterEntry> entries;
  for (const auto& [p, why_not] : all_model_parameters(scenario, target, own)) {
    if (entries.empty() || entries.back().name != p.entry) entries.push_back({p.entry, {}, why_not.empty()});
    if (p.name != p.entry) entries.back().components.push_back(p.name.substr(p.entry.size() + 1));
  }
  return entries;
}

}  // namespace tandem

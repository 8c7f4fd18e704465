#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/simulation/dive_parameters.hpp>
#include <tandem/studies/simulation/docking_parameters.hpp>
#include <tandem/studies/study/trial_settings.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

NewestBy parse_newest(const std::string& where, const std::string& text) {
  using Kind = NewestBy::Kind;
  if (text == "window") return {Kind::window};
  if (text == "hypotheses") return {Kind::hypotheses};
  const std::vector<std::string_view> parts = split(text, ':');
  if (parts.front() == "kalman" && parts.size() <= 3) {
    NewestBy by{Kind::kalman};
    if (parts.size() > 1) by.acceleration = parse_number(parts[1]).value_or(0);
    if (parts.size() > 2) by.velocity_time = parse_number(parts[2]).value_or(0);
    if (by.acceleration > 0 && by.velocity_time > 0) return by;
  }
  throw Error(
      fmt::format("{} is window, hypotheses or kalman[:ACCELERATION[:SECONDS]] with numbers above zero, as in "
                  "kalman:0.2:60, not {}",
                  where, quote(text)));
}

std::string newest_text(const NewestBy& by) {
  if (by.kind == NewestBy::Kind::window) return "window";
  if (by.kind == NewestBy::Kind::hypotheses) return "hypotheses";
  if (std::isinf(by.velocity_time)) return fmt::format("kalman:{}", by.acceleration);
  return fmt::format("kalman:{}:{}", by.acceleration, by.velocity_time);
}

NamedParameter<TrialSettings> loss_parameter(const char* doc) {
  return {"loss", "", doc,
          [](TrialSettings& s, const std::string& where, const std::string& text) { s.loss = parse_loss(where, text); },
          [](const TrialSettings& s) { return loss_text(s.loss); }};
}

std::vector<NamedParameter<TrialSettings>> make_docking_trial_parameters() {
  using S = TrialSettings;
  std::vector<NamedParameter<S>> all;
  for (const auto& parameter : docking_parameters()) all.push_back(parameter_of_part(parameter, &S::docking));
  const auto add = [&](auto... of) { all.push_back(number_parameter<S>(of...)); };
  add("twist_sigma_factor", "", "on the sigmas of the target's motion prior", &S::twist_sigma_factor, 1e-3, 1e3);
  add("usbl_sigma_factor", "", "on the USBL sigma that the estimator is told", &S::usbl_sigma_factor, 1e-3, 1e3);
  add("optical_sigma_factor", "", "on the optical sigmas that it is told", &S::optical_sigma_factor, 1e-3, 1e3);
  add("max_keyframes", "", "the first ones only; 0: all", &S::max_keyframes, 0, 1e9);
  add("window", "s", "fixed-lag smoothing, errors of the newest state; 0: all data at once", &S::window, 0, 1e6);
  add("start_position", "m", "sigma by which the target's start is displaced, anew each minute and smoothly between",
      &S::start_position, 0, 1e3);
  add("start_orientation", "deg", "sigma by which it is turned, likewise", &S::start_orientation, 0, 180);
  all.push_back(loss_parameter("on relative measurements, as --loss takes it"));
  all.push_back(
      {"roll_pitch", "", "soft or off: whether the target is said to be level; hard is a model, roll-pitch:hard",
       [](S& s, const std::string& where, const std::string& text) {
         if (text != "soft" && text != "off")
           throw Error(fmt::format("{} is soft or off (hard is a model, roll-pitch:hard), not {}", where, quote(text)));
         s.level = text == "soft";
       },
       [](const S& s) { return std::string(s.level ? "soft" : "off"); }});
  all.push_back(
      {"junction", "", "boundary or direct: how Mode B ties points to poses",
       [](S& s, const std::string& where, const std::string& text) { s.junction = parse_junction(where, text); },
       [](const S& s) { return std::string(s.junction == Junction::boundary ? "boundary" : "direct"); }});
  all.push_back(switch_parameter<S>("graduated", "0 or 1: robust losses by graduated non-convexity", &S::graduated));
  all.push_back(switch_parameter<S>("calibrated", "0 or 1: with noise calibrated on the trial's own measurements first",
                                    &S::calibrated));
  all.push_back({"newest", "",
                 "with a window: window, hypotheses, as track has it, or the baseline kalman:0.2[:SECONDS]",
                 [](S& s, const std::string& where, const std::string& text) { s.newest = parse_newest(where, text); },
                 [](const S& s) { return newest_text(s.newest); }});
  all.push_back({"rendezvous", "",
                 "decoupled, information, coupled or pursuit: simulate one in the place of an estimate; none",
                 [](S& s, const std::string& where, const std::string& text) {
                   s.rendezvous = text == "none" ? std::nullopt : std::optional(parse_rendezvous_method(where, text));
                 },
                 [](const S& s) { return std::string(s.rendezvous ? name(*s.rendezvous) : "none"); }});
  add("chance", "", "of a rendezvous: σ that keep-out and cones hold by", &S::chance, 0, 10);
  add("information", "", "of a rendezvous by information: cost of a nat that is missed", &S::information, 0, 1e6);
  return all;
}

std::vector<NamedParameter<OwnSensorSettings>> own_sensor_parameters() {
  using S = OwnSensorSettings;
  std::vector<std::pair<std::string, std::optional<std::string>>> sensors = {{"none", {}}, {"imu", "imu"}};
  for (const EgoSensorTraits& type : ego_sensor_types()) sensors.emplace_back(type.name, std::string(type.name));
  return {word_parameter<S, std::optional<std::string>>("without", "a sensor of the chaser's own that is left out",
                                                        &S::without, sensors),
          number_parameter<S>("imu_sigma_factor", "", "on the IMU's noise that the estimator is told",
                              &S::imu_sigma_factor, 1e-3, 1e3),
          number_parameter<S>("dvl_sigma_factor", "", "on the DVL's sigmas that it is told", &S::dvl_sigma_factor, 1e-3,
                              1e3),
          switch_parameter<S>("estimate_dvl_scale", "0 or 1: the DVL's scale factor is estimated", &S::dvl_scale),
          switch_parameter<S>("preintegrated_dvl", "0 or 1: DVL velocities summed up between keyframes",
                              &S::preintegrated)};
}

std::vector<NamedParameter<TrialSettings>> make_dive_trial_parameters() {
  using S = TrialSettings;
  std::vector<NamedParameter<S>> all;
  for (const auto& parameter : dive_parameters()) all.push_back(parameter_of_part(parameter, &S::dive));
  for (const auto& parameter : own_sensor_parameters()) all.push_back(parameter_of_part(parameter, &S::own));
  const auto add = [&](auto... of) { all.push_back(number_parameter<S>(of...)); };
  add("window", "s", "fixed-lag smoothing, errors of the newest state; 0: all data at once; not with a target",
      &S::window, 0, 1e6);
  add("twist_sigma_factor", "", "on the sigmas of the target's motion prior", &S::twist_sigma_factor, 1e-3, 1e3);
  add("usbl_sigma_factor", "", "on the USBL sigma that the estimator is told", &S::usbl_sigma_factor, 1e-3, 1e3);
  all.push_back(loss_parameter("on the measurements of all sensors but the IMU, as --loss takes it"));
  return all;
}

}  // namespace

std::string_view name(Simulated simulated) { return simulated == Simulated::dive ? "dive" : "docking"; }

const std::vector<NamedParameter<TrialSettings>>& trial_parameters(Simulated simulated) {
  static const auto docking = make_docking_trial_parameters(), dive = make_dive_trial_parameters();
  return simulated == Simulated::dive ? dive : docking;
}

bool is_of_the_start(const std::string& parameter) { return parameter.starts_with("start_"); }

}  // namespace tandem

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

NewestStateMethod parse_newest(const std::string& where, const std::string& text) {
  using Kind = NewestStateMethod::Kind;
  if (text == "window") return {Kind::window};
  if (text == "hypotheses") return {Kind::hypotheses};
  const std::vector<std::string_view> parts = split(text, ':');
  if (parts.front() == "kalman" && parts.size() <= 3) {
    NewestStateMethod by{Kind::kalman};
    if (parts.size() > 1) by.acceleration = parse_number(parts[1]).value_or(0);
    if (parts.size() > 2) by.velocity_time = parse_number(parts[2]).value_or(0);
    if (by.acceleration > 0 && by.velocity_time > 0) return by;
  }
  throw Error(
      fmt::format("{} must be window, hypotheses or kalman[:ACCELERATION[:SECONDS]] with positive numbers, as in "
                  "kalman:0.2:60, not {}",
                  where, quote(text)));
}

std::string newest_text(const NewestStateMethod& by) {
  if (by.kind == NewestStateMethod::Kind::window) return "window";
  if (by.kind == NewestStateMethod::Kind::hypotheses) return "hypotheses";
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
  add("twist_sigma_factor", "", "factor on the sigmas of the target's motion model", &S::twist_sigma_factor, 1e-3, 1e3);
  add("usbl_sigma_factor", "", "factor on the USBL sigmas that the estimator assumes", &S::usbl_sigma_factor, 1e-3,
      1e3);
  add("optical_sigma_factor", "", "factor on the optical sigmas that the estimator assumes", &S::optical_sigma_factor,
      1e-3, 1e3);
  add("max_keyframes", "", "use only the first keyframes; 0: all", &S::max_keyframes, 0, 1e9);
  add("window", "s", "fixed-lag smoothing, errors of the newest states; 0: batch estimate", &S::window, 0, 1e6);
  add("start_position", "m", "sigma of the displacement of the target's initial guess, redrawn each minute",
      &S::start_position, 0, 1e3);
  add("start_orientation", "deg", "sigma of the rotation of the target's initial guess, redrawn each minute",
      &S::start_orientation, 0, 180);
  all.push_back(loss_parameter("robust loss of relative measurements, as in --loss"));
  all.push_back({"roll_pitch", "",
                 "soft or off: prior of a level target; for a hard constraint use the model roll-pitch:hard",
                 [](S& s, const std::string& where, const std::string& text) {
                   if (text != "soft" && text != "off")
                     throw Error(fmt::format("{} must be soft or off (or use the model roll-pitch:hard), not {}", where,
                                             quote(text)));
                   s.level = text == "soft";
                 },
                 [](const S& s) { return std::string(s.level ? "soft" : "off"); }});
  all.push_back(
      {"junction", "", "connection of points and poses in Mode B: boundary or direct",
       [](S& s, const std::string& where, const std::string& text) { s.junction = parse_junction(where, text); },
       [](const S& s) { return std::string(s.junction == Junction::boundary ? "boundary" : "direct"); }});
  all.push_back(switch_parameter<S>("graduated", "0 or 1: robust losses by graduated non-convexity", &S::graduated));
  all.push_back(switch_parameter<S>("calibrated", "0 or 1: calibrate the noise on the trial's own measurements first",
                                    &S::calibrated));
  all.push_back({"newest", "",
                 "with window: newest state by window, hypotheses (as track) or the baseline kalman:0.2[:SECONDS]",
                 [](S& s, const std::string& where, const std::string& text) { s.newest = parse_newest(where, text); },
                 [](const S& s) { return newest_text(s.newest); }});
  all.push_back({"rendezvous", "",
                 "simulate a rendezvous: decoupled, information, coupled or pursuit; none: simulate an estimate",
                 [](S& s, const std::string& where, const std::string& text) {
                   s.rendezvous = text == "off" ? std::nullopt : std::optional(parse_rendezvous_method(where, text));
                 },
                 [](const S& s) { return std::string(s.rendezvous ? name(*s.rendezvous) : "off"); }});
  add("chance", "", "with rendezvous: margin of keep-out and cones in σ", &S::chance, 0, 10);
  add("information", "", "with rendezvous by information: cost per nat of missed information", &S::information, 0, 1e6);
  return all;
}

std::vector<NamedParameter<OwnSensorSettings>> own_sensor_parameters() {
  using S = OwnSensorSettings;
  std::vector<std::pair<std::string, std::optional<std::string>>> sensors = {{"none", {}}, {"imu", "imu"}};
  for (const EgoSensorTraits& type : ego_sensor_types()) sensors.emplace_back(type.name, std::string(type.name));
  return {word_parameter<S, std::optional<std::string>>("without", "sensor that the estimator does not use",
                                                        &S::without, sensors),
          number_parameter<S>("imu_sigma_factor", "", "factor on the IMU noise that the estimator assumes",
                              &S::imu_sigma_factor, 1e-3, 1e3),
          number_parameter<S>("dvl_sigma_factor", "", "factor on the DVL sigmas that the estimator assumes",
                              &S::dvl_sigma_factor, 1e-3, 1e3),
          switch_parameter<S>("estimate_dvl_scale", "0 or 1: estimate the DVL's scale factor", &S::dvl_scale),
          switch_parameter<S>("preintegrated_dvl", "0 or 1: preintegrate DVL velocities between keyframes",
                              &S::preintegrated)};
}

std::vector<NamedParameter<TrialSettings>> make_dive_trial_parameters() {
  using S = TrialSettings;
  std::vector<NamedParameter<S>> all;
  for (const auto& parameter : dive_parameters()) all.push_back(parameter_of_part(parameter, &S::dive));
  for (const auto& parameter : own_sensor_parameters()) all.push_back(parameter_of_part(parameter, &S::own));
  const auto add = [&](auto... of) { all.push_back(number_parameter<S>(of...)); };
  add("window", "s", "fixed-lag smoothing, errors of the newest states; 0: batch estimate; not with a target",
      &S::window, 0, 1e6);
  add("twist_sigma_factor", "", "factor on the sigmas of the target's motion model", &S::twist_sigma_factor, 1e-3, 1e3);
  add("usbl_sigma_factor", "", "factor on the USBL sigmas that the estimator assumes", &S::usbl_sigma_factor, 1e-3,
      1e3);
  all.push_back(loss_parameter("robust loss of all sensors except the IMU, as in --loss"));
  return all;
}

}  // namespace

std::string_view name(Simulated simulated) { return simulated == Simulated::dive ? "dive" : "docking"; }

const std::vector<NamedParameter<TrialSettings>>& trial_parameters(Simulated simulated) {
  static const auto docking = make_docking_trial_parameters(), dive = make_dive_trial_parameters();
  return simulated == Simulated::dive ? dive : docking;
}

bool is_initial_guess_parameter(const std::string& parameter) { return parameter.starts_with("start_"); }

}  // namespace tandem

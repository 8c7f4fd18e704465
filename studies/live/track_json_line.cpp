#include <nlohmann/json.hpp>

#include <tandem/studies/live/told_sigma.hpp>
#include <tandem/studies/live/track_json_line.hpp>

namespace tandem {
namespace {

using LineJson = nlohmann::ordered_json;

/// What is not finite is written null.
LineJson array(const Vector<3>& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

std::string track_json_line(const TrackRecord& r, const Frame& frame, const std::vector<std::string>& sensors,
                            const std::vector<double>& ahead) {
  LineJson json = {{"t", r.t},
                   {"type", name(r.type)},
                   {"new_keyframe", r.new_keyframe},
                   {"keyframes", r.keyframes},
                   {"update_ms", 1e3 * r.seconds},
                   {"converged", r.health.converged},
                   {"resets", r.health.resets},
                   {"suspensions", r.health.suspensions},
                   {"outputs", {{"chaser", name(r.health.chaser.state)}, {"target", name(r.health.target.state)}}},
                   {"chaser_m", array(frame.world(r.chaser).translation())}};
  if (r.chaser_sigma) json["chaser_sigma_m"] = told_sigma(*r.chaser_sigma);
  if (r.target) json["relative_m"] = array(frame.body(r.relative()));
  if (r.covariance) json["sigma_m"] = array(told_sigmas(frame, *r.covariance));
  for (std::size_t i = 0; i < r.ahead.size(); ++i) {
    const std::optional<RelativeTarget>& there = r.ahead[i];
    if (!there) continue;
    LineJson entry = {{"seconds", ahead[i]}, {"relative_m", array(frame.body(there->position))}};
    if (there->covariance) entry["sigma_m"] = array(told_sigmas(frame, *there->covariance, kUnobservedAhead));
    json["ahead"].push_back(std::move(entry));
  }
  json["sensors"] = LineJson::object();
  for (std::size_t i = 0; i < r.health.sensors.size(); ++i) {
    const SensorRecord& sensor = r.health.sensors[i];
    LineJson& entry = json["sensors"][sensors[i]] = {{"used", sensor.used}, {"rejected", sensor.rejected}};
    if (sensor.sigmas) entry["sigmas"] = *sensor.sigmas;
    if (sensor.age) entry["age_s"] = *sensor.age;
  }
  return json.dump(-1, ' ', false, LineJson::error_handler_t::replace) + "\n";
}

}  // namespace tandem

#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/online/reported_sigma.hpp>
#include <tandem/studies/online/track_json_line.hpp>
#include <tandem/studies/support/json_fields.hpp>

namespace tandem {
namespace {

using Numbers = std::vector<double>;

struct Line {
  const TrackRecord& record;
  const Frame& frame;
  const std::vector<std::string>& sensors;
  const std::vector<double>& ahead;
};

struct Prediction {
  double seconds;
  const RelativeTarget& target;
  const Frame& frame;
};

/// nlohmann::json writes infinite numbers as null.
Numbers numbers(const Vector<3>& v) { return {v.x(), v.y(), v.z()}; }

JsonFields<RecordHealth> output_fields() {
  using H = RecordHealth;
  return JsonFields<H>()
      .add("chaser", "aided, lost or invalid", [](const H& h) { return name(h.chaser.state); })
      .add("target", "aided, lost, invalid, or none: there is no target yet",
           [](const H& h) { return name(h.target.state); });
}

JsonFields<Prediction> line_prediction_fields() {
  using P = Prediction;
  return JsonFields<P>()
      .add("seconds", "prediction time [s]", [](const P& p) { return p.seconds; })
      .add("relative_m", "predicted position of the target in the chaser's body at t [m]",
           [](const P& p) { return numbers(p.frame.body(p.target.position)); })
      .add("sigma_m", "standard deviation of that prediction along the chaser's axes [m]",
           [](const P& p) -> std::optional<Numbers> {
             const auto& covariance = p.target.covariance;
             if (!covariance) return {};
             return numbers(reported_sigmas(p.frame, *covariance, kUnobservedAhead));
           });
}

JsonFields<SensorRecord> line_sensor_fields() {
  using S = SensorRecord;
  return JsonFields<S>()
      .add("used", "number of measurements used so far", [](const S& s) { return s.used; })
      .add("rejected", "number of measurements that the gate has rejected so far",
           [](const S& s) { return s.rejected; })
      .add("sigmas", "innovation of the newest measurement in standard deviations", [](const S& s) { return s.sigmas; })
      .add("age_s", "time since the last used measurement [s]", [](const S& s) { return s.age; });
}

std::vector<Prediction> predictions(const Line& line) {
  std::vector<Prediction> result;
  for (std::size_t i = 0; i < line.record.ahead.size(); ++i)
    if (const auto& target = line.record.ahead[i]) result.push_back({line.ahead[i], *target, line.frame});
  return result;
}

std::vector<std::pair<std::string, SensorRecord>> sensors_by_name(const Line& line) {
  std::vector<std::pair<std::string, SensorRecord>> result;
  for (std::size_t i = 0; i < line.record.health.sensors.size(); ++i)
    result.emplace_back(line.sensors[i], line.record.health.sensors[i]);
  return result;
}

JsonFields<Line> line_fields() {
  using L = Line;
  return JsonFields<L>()
      .add("t", "time of the newest keyframe [s]", [](const L& l) { return l.record.t; })
      .add("type", "measurement at the keyframe: position, pose, partial or none",
           [](const L& l) { return name(l.record.type); })
      .add("new_keyframe", "whether the update added a keyframe", [](const L& l) { return l.record.new_keyframe; })
      .add("keyframes", "number of keyframes in the window", [](const L& l) { return l.record.keyframes; })
      .add("update_ms", "duration of the update by the wall clock [ms]",
           [](const L& l) { return 1e3 * l.record.seconds; })
      .add("converged", "whether the update converged", [](const L& l) { return l.record.health.converged; })
      .add("resets", "number of resets so far", [](const L& l) { return l.record.health.resets; })
      .add("suspensions", "number of suspensions so far", [](const L& l) { return l.record.health.suspensions; })
      .add_object("outputs", "reliability of the newest states", output_fields(),
                  [](const L& l) -> const RecordHealth& { return l.record.health; })
      .add("chaser_m", "position of the chaser in the scenario's frame [m]",
           [](const L& l) { return numbers(l.frame.world(l.record.chaser).translation()); })
      .add("chaser_sigma_m", "standard deviation of that position: root of the summed variances [m]",
           [](const L& l) {
             return l.record.chaser_sigma ? std::optional(reported_sigma(*l.record.chaser_sigma)) : std::nullopt;
           })
      .add("relative_m", "position of the target in the chaser's body [m]",
           [](const L& l) -> std::optional<Numbers> {
             if (!l.record.target) return {};
             return numbers(l.frame.body(l.record.relative()));
           })
      .add("sigma_m", "standard deviation of that position along the chaser's axes [m]",
           [](const L& l) -> std::optional<Numbers> {
             if (!l.record.covariance) return {};
             return numbers(reported_sigmas(l.frame, *l.record.covariance));
           })
      .add_list("ahead", "predictions", line_prediction_fields(), predictions)
      .add_map("sensors", "SENSOR", "state of each sensor", line_sensor_fields(), sensors_by_name);
}

}  // namespace

std::string track_json_line(const TrackRecord& record, const Frame& frame, const std::vector<std::string>& sensors,
                            const std::vector<double>& ahead) {
  static const JsonFields<Line> fields = line_fields();
  return json_line(json_document("track-line", fields, Line{record, frame, sensors, ahead}));
}

FileDescription track_json_line_keys() { return describe_json("--json-lines", "track-line", line_fields()); }

}  // namespace tandem

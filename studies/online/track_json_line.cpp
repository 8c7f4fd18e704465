#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/online/reported_sigma.hpp>
#include <tandem/studies/online/track_json_line.hpp>
#include <tandem/studies/online/track_lines.hpp>
#include <tandem/studies/support/json_fields.hpp>

namespace tandem {
namespace {

using Numbers = std::vector<double>;

struct Line {
  const TrackRecord& record;
  const Frame& frame;
  const std::vector<std::string>& sensors;
  const std::vector<double>& ahead;
  LineCovariance covariance;
};

struct Prediction {
  double seconds;
  const RelativeTarget& target;
  const SE3& chaser;
  const Frame& frame;
};

/// nlohmann::json writes infinite numbers as null.
Numbers numbers(const Vector<3>& v) { return {v.x(), v.y(), v.z()}; }
Numbers numbers(const SO3& R) {
  const SO3::Quaternion& q = R.quaternion();
  return {q.x(), q.y(), q.z(), q.w()};
}
Numbers twist_numbers(const Frame& frame, const Vector<6>& twist) {
  Numbers all = numbers(frame.body(twist.head<3>()));
  const Numbers angular = numbers(frame.body(twist.tail<3>()));
  all.insert(all.end(), angular.begin(), angular.end());
  return all;
}

/// Returns a matrix as a list of rows.
std::vector<Numbers> rows(const Eigen::MatrixXd& M) {
  std::vector<Numbers> result;
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    result.emplace_back();
    for (Eigen::Index j = 0; j < M.cols(); ++j) result.back().push_back(M(i, j));
  }
  return result;
}

/// Returns the target to which the covariance belongs.
const TargetState& of_covariance(const TrackRecord& record) {
  return record.reported.window_target ? *record.reported.window_target : *record.target;
}

/// Returns the joint covariance in the axes of the scenario's files.
Eigen::MatrixXd in_axes(const Frame& frame, const TrackRecord& record) {
  const Eigen::MatrixXd& S = record.reported.covariance;
  if (!frame.is_ned() || S.size() == 0) return S;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(S.rows(), S.cols());
  const Eigen::Index chaser = record.reported.chaser_rows;
  const auto turn = [&](Eigen::Index first, Eigen::Index size) {  // of a pose or a point
    const Matrix<3, 3> body = frame.body_axes();
    if (size == 6) {
      A.block<3, 3>(first, first) = A.block<3, 3>(first + 3, first + 3) = body;
    } else if (first == 0 || (of_covariance(record).rotation && size == chaser)) {  // planar: x, y and the heading
      A.diagonal().segment<3>(first) << 1, -1, -1;
    } else {
      A.block(first, first, size, size) = frame.world_axes().topLeftCorner(size, size);
    }
  };
  turn(0, chaser);
  if (S.rows() > chaser) turn(chaser, S.rows() - chaser);
  return A * S * A.transpose();
}

using Rows = std::optional<std::vector<Numbers>>;

/// Returns `size` rows and columns of the covariance from `first` on, if a line has such covariances.
Rows covariance_rows(const Line& l, LineCovariance wanted, Eigen::Index first, Eigen::Index size) {
  if (l.covariance != wanted || l.record.reported.covariance.size() == 0 || size <= 0) return {};
  return rows(in_axes(l.frame, l.record).block(first, first, size, size));
}

std::optional<Numbers> quaternion(const Frame& frame, const TargetState& target) {
  if (!target.rotation) return {};
  return numbers(frame.world(*target.rotation));
}

constexpr const char* kJoint =
    "joint covariance of [chaser; target], by rows, for right perturbations: of a pose, the translation [m] then the "
    "rotation vector [rad] in its body's axes; of a target without orientation, its position in the scenario's axes; "
    "in the plane x, y and the heading";
constexpr const char* kTargetBlock = "block of the target in the joint covariance, with --covariance blocks";

Rows joint_rows(const Line& l) {
  return covariance_rows(l, LineCovariance::joint, 0, l.record.reported.covariance.rows());
}
Rows target_rows(const Line& l) {
  const Eigen::Index chaser = l.record.reported.chaser_rows;
  return covariance_rows(l, LineCovariance::blocks, chaser, l.record.reported.covariance.rows() - chaser);
}

/// The target of the window, if motion hypotheses give the newest state.
JsonFields<Line> window_fields() {
  using L = Line;
  return JsonFields<L>()
      .add("target_m", "position of the target in the scenario's frame [m]",
           [](const L& l) { return numbers(l.frame.world(l.record.reported.window_target->position)); })
      .add("target_quaternion", "orientation of the target in the scenario's frame, x y z w; if it is estimated",
           [](const L& l) { return quaternion(l.frame, *l.record.reported.window_target); })
      .add("target_twist", "body twist of the target over the last second [m/s, rad/s]",
           [](const L& l) -> std::optional<Numbers> {
             if (!l.record.reported.window_twist) return {};
             return twist_numbers(l.frame, *l.record.reported.window_twist);
           })
      .add("covariance", kJoint, joint_rows)
      .add("target_covariance", kTargetBlock, target_rows);
}

JsonFields<RecordHealth> output_fields() {
  using H = RecordHealth;
  return JsonFields<H>()
      .add("chaser", "aided, lost, invalid or unconfirmed", [](const H& h) { return name(h.chaser.state); })
      .add("target", "aided, lost, invalid, unconfirmed, or none: there is no target yet",
           [](const H& h) { return name(h.target.state); })
      .add("chaser_confirmed",
           "whether at least two sensors of the chaser agree, so that each shows gross errors of the other",
           [](const H& h) { return h.chaser.confirmed; })
      .add("target_confirmed", "likewise for the sensors of the target", [](const H& h) { return h.target.confirmed; });
}

JsonFields<Prediction> line_prediction_fields() {
  using P = Prediction;
  return JsonFields<P>()
      .add("seconds", "prediction time [s]", [](const P& p) { return p.seconds; })
      .add("relative_m", "predicted position of the target in the chaser's body at t [m]",
           [](const P& p) { return numbers(p.frame.body(p.target.position)); })
      .add("target_m", "that position in the scenario's frame [m]",
           [](const P& p) { return numbers(p.frame.world(p.chaser.act(p.target.position))); })
      .add("covariance_m2", "covariance of relative_m along the chaser's axes, by rows [m²]",
           [](const P& p) -> Rows {
             if (!p.target.covariance) return {};
             return rows(p.frame.body_axes() * *p.target.covariance * p.frame.body_axes().transpose());
           })
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
      .add("nis", "mean NIS per row of the measurements used so far; 1 if noise and model are consistent",
           [](const S& s) { return s.nis; })
      .add("age_s", "time since the last used measurement [s]", [](const S& s) { return s.age; });
}

std::vector<Prediction> predictions(const Line& line) {
  std::vector<Prediction> result;
  for (std::size_t i = 0; i < line.record.ahead.size(); ++i)
    if (const auto& target = line.record.ahead[i])
      result.push_back({line.ahead[i], *target, line.record.chaser, line.frame});
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
      .add("chaser_quaternion", "orientation of the chaser in the scenario's frame, x y z w",
           [](const L& l) { return numbers(l.frame.world(l.record.chaser).rotation()); })
      .add("chaser_twist", "body twist of the chaser over the last second [m/s, rad/s]",
           [](const L& l) { return twist_numbers(l.frame, l.record.reported.chaser_twist); })
      .add("chaser_sigma_m", "standard deviation of that position: root of the summed variances [m]",
           [](const L& l) {
             return l.record.chaser_sigma ? std::optional(reported_sigma(*l.record.chaser_sigma)) : std::nullopt;
           })
      .add("target_m", "position of the target in the scenario's frame [m]",
           [](const L& l) -> std::optional<Numbers> {
             if (!l.record.target) return {};
             return numbers(l.frame.world(l.record.target->position));
           })
      .add("target_quaternion", "orientation of the target in the scenario's frame, x y z w; if it is estimated",
           [](const L& l) -> std::optional<Numbers> {
             if (!l.record.target) return {};
             return quaternion(l.frame, *l.record.target);
           })
      .add("target_velocity", "velocity of the target in the scenario's frame over the last second [m/s]",
           [](const L& l) -> std::optional<Numbers> {
             if (!l.record.target) return {};
             return numbers(l.frame.world(l.record.target_velocity));
           })
      .add("target_twist", "body twist of the target predicted for the next second [m/s, rad/s]",
           [](const L& l) -> std::optional<Numbers> {
             if (!l.record.reported.target_twist) return {};
             return twist_numbers(l.frame, *l.record.reported.target_twist);
           })
      .add("speed_m_s", "speed of the target [m/s]",
           [](const L& l) { return l.record.target ? std::optional(l.record.target_velocity.norm()) : std::nullopt; })
      .add("heading_rad", "heading of the target, clockwise from north; its course if it has no orientation [rad]",
           [](const L& l) { return target_heading(l.record); })
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
      .add("covariance", kJoint + std::string("; of a chaser without a target, its block. See window"),
           [](const L& l) { return l.record.reported.window_target ? Rows() : joint_rows(l); })
      .add("chaser_covariance", "block of the chaser in the joint covariance, with --covariance blocks",
           [](const L& l) { return covariance_rows(l, LineCovariance::blocks, 0, l.record.reported.chaser_rows); })
      .add("target_covariance", kTargetBlock,
           [](const L& l) { return l.record.reported.window_target ? Rows() : target_rows(l); })
      .add_object("window",
                  "with motion hypotheses: the target of the window, to which the covariances belong. The other keys "
                  "have the newest state of the hypotheses",
                  window_fields(),
                  [](const L& l) { return l.record.reported.window_target ? std::optional(l) : std::nullopt; })
      .add_list("ahead", "predictions", line_prediction_fields(), predictions)
      .add_map("sensors", "SENSOR", "state of each sensor", line_sensor_fields(), sensors_by_name);
}

}  // namespace

std::string track_json_line(const TrackRecord& record, const Frame& frame, const std::vector<std::string>& sensors,
                            const std::vector<double>& ahead, LineCovariance covariance) {
  static const JsonFields<Line> fields = line_fields();
  return json_line(json_document("track-line", fields, Line{record, frame, sensors, ahead, covariance}));
}

FileDescription track_json_line_keys() { return describe_json("--json-lines", "track-line", line_fields()); }

}  // namespace tandem

#include <cmath>
#include <functional>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/operations.hpp>
#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/estimation/estimate_report.hpp>
#include <tandem/studies/support/output_folder.hpp>

namespace tandem {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

/// What is written of chaser or target; everything by keyframe.
struct Body {
  std::function<TargetState(std::size_t)> state;
  std::function<Eigen::MatrixXd(std::size_t)> covariance;
  const std::vector<Vector<6>>& twist;  ///< empty: from the poses
};

SE3 pose_in(const Frame& frame, const TargetState& x) {
  return frame.world(SE3(x.rotation.value_or(SO3()), x.position));
}

/// A trajectory in the scenario's frame; where there is no orientation, its quaternion is nan.
std::string tum(const Estimate& estimate, const Body& body) {
  std::string text = "# t[s] x[m] y[m] z[m] qx qy qz qw\n";
  for (std::size_t k = 0; k < estimate.keyframes.size(); ++k) {
    const TargetState x = body.state(k);
    const SE3 pose = pose_in(estimate.frame, x);
    const Vector<3> t = pose.translation();
    text += fmt::format("{} {} {} {}", estimate.keyframes[k].t, t.x(), t.y(), t.z());
    const SO3::Quaternion& q = pose.rotation().quaternion();
    text += x.rotation ? fmt::format(" {} {} {} {}\n", q.x(), q.y(), q.z(), q.w()) : " nan nan nan nan\n";
  }
  return text;
}

/// The mean body twist over the neighbouring keyframes, one-sided at the ends and beside points.
std::optional<Vector<6>> twist_at(const Estimate& estimate, const Body& body, std::size_t k) {
  if (!body.twist.empty()) return body.twist[k];
  const auto pose = [&](std::size_t i) -> std::optional<SE3> {
    if (i >= estimate.keyframes.size()) return {};
    const TargetState x = body.state(i);
    if (!x.rotation) return {};
    return SE3(*x.rotation, x.position);
  };
  if (!pose(k)) return {};
  const std::size_t from = k > 0 && pose(k - 1) ? k - 1 : k, to = pose(k + 1) ? k + 1 : k;
  if (from == to) return {};
  return Vector<6>(minus(*pose(to), *pose(from)) / (estimate.keyframes[to].t - estimate.keyframes[from].t));
}

std::string full_header() {
  std::string text = "t,x,y,z,qx,qy,qz,qw,vx,vy,vz,wx,wy,wz";
  for (int row = 1; row <= 6; ++row)
    for (int column = 1; column <= 6; ++column) text += fmt::format(",c{}{}", row, column);
  return text + "\n";
}

/// A covariance of a pose, or of a point, with the scenario's axes.
Eigen::MatrixXd in_frame(const Frame& frame, const Eigen::MatrixXd& covariance) {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(covariance.rows(), covariance.rows());
  A.topLeftCorner<3, 3>() = covariance.rows() == 3 ? frame.world_axes() : frame.body_axes();
  if (covariance.rows() == 6) A.bottomRightCorner<3, 3>() = frame.body_axes();
  return A * covariance * A.transpose();
}

std::string full_csv(const Estimate& estimate, const Body& body) {
  std::string text = full_header();
  const Frame& frame = estimate.frame;
  for (std::size_t k = 0; k < estimate.keyframes.size(); ++k) {
    const TargetState x = body.state(k);
    const SE3 pose = pose_in(frame, x);
    text += fmt::format("{},{}", estimate.keyframes[k].t, fmt::join(pose.translation(), ","));
    text += x.rotation ? fmt::format(",{}", fmt::join(pose.rotation().quaternion().coeffs(), ",")) : ",,,,";
    if (const auto twist = twist_at(estimate, body, k)) {
      text += fmt::format(",{}", fmt::join(frame.body(Vector<3>(twist->head<3>())), ","));
      text += fmt::format(",{}", fmt::join(frame.body(Vector<3>(twist->tail<3>())), ","));
    } else {
      text += ",,,,,,";
    }
    const Eigen::MatrixXd S = estimate.uncertainty.empty() ? Eigen::MatrixXd() : in_frame(frame, body.covariance(k));
    for (Eigen::Index row = 0; row < 6; ++row)
      for (Eigen::Index column = 0; column < 6; ++column)
        text += row < S.rows() && column < S.cols() ? fmt::format(",{}", S(row, column)) : ",";
    text += "\n";
  }
  return text;
}

std::string fields(const std::optional<Vector<3>>& v) { return v ? fmt::format(",{}", fmt::join(*v, ",")) : ",,,"; }

std::string errors_csv(const Estimate& estimate) {
  const auto field = [](const std::optional<double>& value) { return value ? fmt::format("{}", *value) : ""; };
  const auto vector = [&](std::optional<Vector<3>> v, double unit) {
    if (v) v = estimate.frame.body(Vector<3>(unit * *v));
    return fields(v);
  };
  std::string text =
      "t,type,position_error_m,angle_error_deg,error_x_m,error_y_m,error_z_m,error_rx_deg,error_ry_deg,error_rz_deg,"
      "three_sigma_x_m,three_sigma_y_m,three_sigma_z_m,three_sigma_rx_deg,three_sigma_ry_deg,three_sigma_rz_deg\n";
  for (std::size_t k = 0; k < estimate.errors.size(); ++k) {
    const KeyframeError& error = estimate.errors[k];
    text += fmt::format("{},{},{},{}", error.t, name(error.type), field(error.position), field(error.angle));
    text += vector(error.position_vector, 1) + vector(error.rotation_vector, kDegrees);
    std::optional<Vector<3>> position, rotation;
    if (!estimate.uncertainty.empty()) {
      position = 3 * estimate.uncertainty[k].position_sigma();
      rotation = estimate.uncertainty[k].rotation_sigma();
      if (rotation) *rotation *= 3 * kDegrees;
    }
    text += fields(position) + fields(rotation) + "\n";
  }
  return text;
}

std::string weights_csv(const Estimate& estimate) {
  std::string text = "sensor,t,part,weight\n";
  for (const MeasurementOutcome& m : estimate.measurements)
    for (const PartWeight& part : m.parts)
      if (part.weight < kDownWeighted)
        text += fmt::format("{},{},{},{}\n", estimate.sensors[m.sensor].name, m.t, part.part, part.weight);
  return text;
}

std::string held_out_csv(const Estimate& estimate) {
  Eigen::Index rows = 0;
  for (const Validation& v : estimate.held_out) rows = std::max(rows, v.prediction.r.size());
  std::string text = "sensor,t,inlier,rows,rows_inside,squared_distance";
  for (const char* column : {"residual", "sigma"})
    for (Eigen::Index i = 1; i <= rows; ++i) text += fmt::format(",{}_{}", column, i);
  text += "\n";
  for (const auto& [prediction, t, inlier] : estimate.held_out) {
    text += fmt::format("{},{},{},{},{},{}", estimate.sensors[prediction.sensor].name, t,
                        inlier ? fmt::format("{}", int(*inlier)) : "", prediction.r.size(), prediction.rows_inside(),
                        prediction.squared_distance());
    for (Eigen::Index i = 0; i < rows; ++i) text += i < prediction.r.size() ? fmt::format(",{}", prediction.r[i]) : ",";
    for (Eigen::Index i = 0; i < rows; ++i)
      text += i < prediction.r.size() ? fmt::format(",{}", std::sqrt(prediction.covariance(i, i))) : ",";
    text += "\n";
  }
  return text;
}

}  // namespace

void write_results(const Estimate& estimate, const std::filesystem::path& folder) {
  const std::vector<Vector<6>> from_poses;
  const Body chaser{[&](std::size_t k) { return TargetState(estimate.chaser[k]); },
                    [&](std::size_t k) { return estimate.uncertainty[k].chaser; }, from_poses};
  const Body target{[&](std::size_t k) { return estimate.target[k]; },
                    [&](std::size_t k) { return estimate.uncertainty[k].target; }, estimate.target_twist};
  write_file(folder / "chaser.tum", tum(estimate, chaser));
  write_file(folder / "target.tum", tum(estimate, target));
  write_file(folder / "chaser_full.csv", full_csv(estimate, chaser));
  write_file(folder / "target_full.csv", full_csv(estimate, target));
  write_file(folder / "errors.csv", errors_csv(estimate));
  write_file(folder / "weights.csv", weights_csv(estimate));
  if (!estimate.held_out.empty()) write_file(folder / "held_out.csv", held_out_csv(estimate));
  write_file(folder / "summary.json", summary_json(estimate));
}

}  // namespace tandem

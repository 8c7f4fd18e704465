#include <cmath>
#include <iterator>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/navigation/navigation_files.hpp>
#include <tandem/studies/support/down_weighted.hpp>
#include <tandem/studies/support/output_folder.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

template <class V>
void append(std::string& text, const V& values) {
  for (Eigen::Index i = 0; i < values.size(); ++i) fmt::format_to(std::back_inserter(text), ",{}", values[i]);
}

void append(std::string& text, const std::optional<Vector<3>>& v, double unit = 1) {
  if (v)
    append(text, Vector<3>(unit * *v));
  else
    text += ",,,";
}

void append(std::string& text, const std::optional<double>& value) { text += value ? fmt::format(",{}", *value) : ","; }

std::string tum(const NavigationStudy& study) {
  std::string text = "# t[s] x[m] y[m] z[m] qx qy qz qw\n";
  for (const auto& [t, state] : study.navigation.states) {
    const SE3 pose = study.scenario.frame.world(state.pose);
    text += fmt::format("{} {} {}\n", t, fmt::join(pose.translation(), " "),
                        fmt::join(pose.rotation().quaternion().coeffs(), " "));
  }
  return text;
}

std::string full_header() {
  std::string text = "t,x,y,z,qx,qy,qz,qw,vx,vy,vz,bax,bay,baz,bgx,bgy,bgz";
  for (int row = 1; row <= 6; ++row)
    for (int column = 1; column <= 6; ++column) text += fmt::format(",c{}{}", row, column);
  return text + ",sigma_vx,sigma_vy,sigma_vz,sigma_bax,sigma_bay,sigma_baz,sigma_bgx,sigma_bgy,sigma_bgz\n";
}

std::string full_csv(const NavigationStudy& study) {
  const Navigation& navigation = study.navigation;
  const Frame& frame = study.scenario.frame;
  const bool imu = navigation.data.imu.has_value();
  Matrix<6, 6> axes = Matrix<6, 6>::Zero();
  axes.topLeftCorner<3, 3>() = frame.body_axes();
  axes.bottomRightCorner<3, 3>() = frame.body_axes();
  std::string text = full_header();
  for (std::size_t k = 0; k < navigation.states.size(); ++k) {
    const auto& [t, state] = navigation.states[k];
    const SE3 pose = frame.world(state.pose);
    fmt::format_to(std::back_inserter(text), "{}", t);
    append(text, pose.translation());
    append(text, pose.rotation().quaternion().coeffs());
    append(text, frame.world(state.velocity));
    const auto biases = [&](const std::optional<Vector<6>>& b) {
      append(text, b ? std::optional<Vector<3>>(b->head<3>()) : std::nullopt);
      append(text, b ? std::optional<Vector<3>>(b->tail<3>()) : std::nullopt);
    };
    biases(imu ? std::optional<Vector<6>>(axes * state.bias) : std::nullopt);
    if (navigation.covariance.empty()) {
      text += std::string(36 + 9, ',') + "\n";
      continue;
    }
    const EgoCovariance& covariance = navigation.covariance[k];
    const Matrix<6, 6> S = axes * covariance.pose * axes.transpose();
    for (int row = 0; row < 6; ++row) append(text, Vector<6>(S.row(row).transpose()));
    append(text, frame.world(Vector<3>(covariance.velocity.diagonal().cwiseSqrt())).cwiseAbs().eval());
    biases(imu ? std::optional<Vector<6>>(covariance.bias.diagonal().cwiseSqrt()) : std::nullopt);
    text += "\n";
  }
  return text;
}

std::string errors_csv(const NavigationStudy& study) {
  std::string text = "t";
  const auto columns = [&](const std::string& what, const std::string& suffix, const std::string& unit) {
    for (const char* axis : {"x", "y", "z"}) text += fmt::format(",{}{}{}_{}", what, axis, suffix, unit);
  };
  text += ",position_error_m,horizontal_error_m,attitude_error_deg,velocity_error_m_s";
  columns("error_", "", "m");
  columns("error_r", "", "deg");
  columns("error_v", "", "m_s");
  columns("three_sigma_", "", "m");
  columns("three_sigma_r", "", "deg");
  columns("three_sigma_v", "", "m_s");
  text += ",pose_nees,position_nees\n";

  const Frame& frame = study.scenario.frame;
  const auto world = [&](const std::optional<Vector<3>>& v) {
    return v ? std::optional<Vector<3>>(frame.world(*v)) : std::nullopt;
  };
  const auto bound = [](const std::optional<Vector<3>>& v) {
    return v ? std::optional<Vector<3>>(3 * v->cwiseAbs()) : std::nullopt;
  };
  const auto norm = [](const std::optional<Vector<3>>& v, double unit = 1) {
    return v ? std::optional<double>(unit * v->norm()) : std::nullopt;
  };
  for (const NavigationError& e : study.comparison.errors) {
    fmt::format_to(std::back_inserter(text), "{}", e.t);
    append(text, norm(e.position));
    append(text, e.position ? std::optional<double>(horizontal(*e.position)) : std::nullopt);
    append(text, norm(e.attitude, kDegrees));
    append(text, norm(e.velocity));
    append(text, world(e.position));
    append(text, e.attitude ? std::optional<Vector<3>>(frame.body(*e.attitude)) : std::nullopt, kDegrees);
    append(text, world(e.velocity));
    append(text, bound(world(e.position_sigma)));
    append(text, bound(e.attitude_sigma), kDegrees);
    append(text, bound(world(e.velocity_sigma)));
    append(text, e.pose_nees);
    append(text, e.position_nees);
    text += "\n";
  }
  return text;
}

std::string weights_csv(const Navigation& navigation) {
  std::string text = "sensor,t,weight\n";
  for (std::size_t i = 0; i < navigation.placed.size(); ++i)
    if (navigation.weight[i] < kDownWeighted)
      text += fmt::format("{},{},{}\n", csv_field(navigation.data.sensors[navigation.placed[i].sensor].name),
                          navigation.placed[i].t, navigation.weight[i]);
  return text;
}

}  // namespace

void write_navigation(const NavigationStudy& study, const std::filesystem::path& folder) {
  write_file(folder / "chaser.tum", tum(study));
  write_file(folder / "chaser_full.csv", full_csv(study));
  write_file(folder / "errors.csv", errors_csv(study));
  write_file(folder / "weights.csv", weights_csv(study.navigation));
  write_file(folder / "summary.json", navigation_json(study));
}

}  // namespace tandem

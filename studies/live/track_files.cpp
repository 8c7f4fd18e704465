#include <fstream>
#include <limits>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/live/track_files.hpp>
#include <tandem/studies/support/output_folder.hpp>

namespace tandem {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

/// A file that is written row by row.
class RowsOut {
 public:
  RowsOut(std::filesystem::path file, const std::string& head)
      : file_(std::move(file)), stream_(file_, std::ios::binary) {
    stream_ << head << '\n';
  }
  void add(const std::string& row) { stream_ << row << '\n'; }
  void close() {
    stream_.close();
    if (!stream_) throw Error(fmt::format("{} cannot be written", file_.string()));
  }

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
};

/// A pose in the scenario's frame; where there is no orientation, its quaternion is nan.
std::string tum_row(const Frame& frame, double t, const TargetState& x) {
  const SE3 pose = frame.world(SE3(x.rotation.value_or(SO3()), x.position));
  const Eigen::Vector4d q = x.rotation ? Eigen::Vector4d(pose.rotation().quaternion().coeffs())
                                       : Eigen::Vector4d::Constant(std::numeric_limits<double>::quiet_NaN());
  return fmt::format("{} {} {}", t, fmt::join(pose.translation(), " "), fmt::join(q, " "));
}

std::string fields(const std::optional<Vector<3>>& v) { return v ? fmt::format(",{}", fmt::join(*v, ",")) : ",,,"; }
std::string field(const std::optional<double>& x) { return x ? fmt::format(",{}", *x) : ","; }

std::string track_head(const LiveOptions& options) {
  std::string text =
      "t,type,new_keyframe,keyframes,update_ms,update_processor_ms,x_m,y_m,z_m,sigma_x_m,sigma_y_m,sigma_z_m,"
      "chaser_sigma_m";
  for (const double h : options.ahead)
    for (const char* axis : {"x", "y", "z"}) text += fmt::format(",ahead_{:g}_{}_m", h, axis);
  return text;
}

std::string track_row(const Frame& frame, const TrackRecord& r) {
  const auto body = [&](std::optional<Vector<3>> v) {
    if (v) v = frame.body(*v);
    return fields(v);
  };
  std::optional<Vector<3>> sigma = r.sigma;
  if (sigma) sigma = frame.body(*sigma).cwiseAbs();
  std::string text = fmt::format("{},{},{},{},{},{}", r.t, name(r.type), int(r.new_keyframe), r.keyframes,
                                 1e3 * r.seconds, 1e3 * r.processor_seconds);
  text += body(r.target ? std::optional(r.relative()) : std::nullopt) + fields(sigma) + field(r.chaser_sigma);
  for (const auto& ahead : r.ahead) text += body(ahead);
  return text;
}

std::string errors_head(const LiveOptions& options) {
  std::string text =
      "t,type,position_error_m,angle_error_deg,error_x_m,error_y_m,error_z_m,error_rx_deg,error_ry_deg,error_rz_deg,"
      "three_sigma_x_m,three_sigma_y_m,three_sigma_z_m,raw_position_error_m,chaser_position_error_m,"
      "chaser_angle_error_deg";
  for (const double h : options.ahead) text += fmt::format(",ahead_{:g}_error_m", h);
  return text;
}

std::string errors_row(const Frame& frame, const TrackRecord& r, const TrackError& error) {
  const KeyframeError& e = error.relative;
  const auto body = [&](std::optional<Vector<3>> v, double unit) {
    if (v) v = frame.body(Vector<3>(unit * *v));
    return fields(v);
  };
  std::optional<Vector<3>> bound = r.sigma;
  if (bound) bound = 3 * frame.body(*bound).cwiseAbs();
  std::string text = fmt::format("{},{}", r.t, name(r.type)) + field(e.position) + field(e.angle) +
                     body(e.position_vector, 1) + body(e.rotation_vector, kDegrees) + fields(bound) +
                     field(e.raw_position) + field(error.chaser_position) + field(error.chaser_angle);
  for (const auto& ahead : error.ahead) text += field(ahead);
  return text;
}

}  // namespace

void write_track(const Track& track, const TrackSummary& summary, const Scenario& scenario, const LiveOptions& options,
                 const std::filesystem::path& folder) {
  const char* const tum = "# t[s] x[m] y[m] z[m] qx qy qz qw";
  RowsOut chaser(folder / "chaser.tum", tum), target(folder / "target.tum", tum);
  RowsOut rows(folder / "track.csv", track_head(options)), errors(folder / "errors.csv", errors_head(options));
  track.records.each([&](const TrackRecord& r) {
    chaser.add(tum_row(scenario.frame, r.t, TargetState(r.chaser)));
    if (r.target) target.add(tum_row(scenario.frame, r.t, *r.target));
    rows.add(track_row(scenario.frame, r));
    if (r.new_keyframe) errors.add(errors_row(scenario.frame, r, track_error(scenario, r, options)));
  });
  for (RowsOut* file : {&chaser, &target, &rows, &errors}) file->close();
  write_file(folder / "summary.json", track_json(track, summary));
}

}  // namespace tandem

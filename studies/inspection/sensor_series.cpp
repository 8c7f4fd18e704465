#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <tandem/studies/inspection/sensor_series.hpp>
#include <tandem/studies/recording/recorded_time.hpp>
#include <tandem/studies/support/utc_stamps.hpp>

namespace tandem {
namespace {

double median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns every k-th row's value of f, at most about 20,000.
template <class F>
std::vector<double> sampled(const SensorSeries& s, F f) {
  std::vector<double> values;
  const std::size_t step = std::max<std::size_t>(1, s.rows / 20000);
  for (std::size_t i = 0; i < s.rows; i += step) values.push_back(f(i));
  return values;
}

const SensorSeries* of_type(const std::vector<SensorSeries>& all, std::string_view type) {
  for (const SensorSeries& s : all)
    if (s.type == type) return &s;
  return nullptr;
}

void find_gaps(const SensorSeries& s, std::vector<std::string>& out) {
  const SeriesGaps gaps = gaps_of(s);
  if (gaps.count > 0)
    out.push_back(fmt::format("{}: {} gap{} without rows, the longest {:.1f} s from {}", s.name, gaps.count,
                              gaps.count == 1 ? "" : "s", gaps.longest, time_text_of(gaps.longest_from)));
}

void find_clock(const SensorSeries& s, std::vector<std::string>& out) {
  if (s.rows < 3) return;
  const double step = gaps_of(s).median_step;
  const bool dense = s.type == "imu" || s.type == "odometry" || s.type == "dvl";
  if (step > (dense ? 10 : 100) || step < 1e-5)
    out.push_back(fmt::format("{}: rows are {:.3g} s apart; is the unit of time right?", s.name, step));
}

void find_imu(const SensorSeries& s, bool ned, std::vector<std::string>& out) {
  const std::string& name = s.name;
  const double size = median(sampled(s, [&](std::size_t i) { return std::hypot(s.at(i, 1), s.at(i, 2), s.at(i, 3)); }));
  const double up = median(sampled(s, [&](std::size_t i) { return ned ? -s.at(i, 3) : s.at(i, 3); }));
  if (std::abs(size - 1) < 0.2)
    out.push_back(fmt::format("{}: the specific force is {:.2f}, not 9.8 m/s^2; is it in g?", name, size));
  else if (std::abs(size - 9.81) > 3)
    out.push_back(
        fmt::format("{}: the specific force is {:.3g} m/s^2, not 9.8; is its unit right, and is gravity "
                    "included?",
                    name, size));
  else if (up < -5)
    out.push_back(
        fmt::format("{}: the specific force of a level sensor at rest points up, but here it points down; check "
                    "axes and sign, or give the sensor's orientation",
                    name));
  const double rate = median(sampled(s, [&](std::size_t i) { return std::hypot(s.at(i, 4), s.at(i, 5), s.at(i, 6)); }));
  if (rate > 4) out.push_back(fmt::format("{}: the median angular rate is {:.3g} rad/s; is it in deg/s?", name, rate));
}

void find_depth(const SensorSeries& s, bool ned, std::vector<std::string>& out) {
  const double down = median(sampled(s, [&](std::size_t i) { return ned ? s.at(i, 1) : -s.at(i, 1); }));
  if (down < -1)
    out.push_back(
        fmt::format("{}: the median depth is {:.1f} m above the water; is the sign right, and the atmosphere of "
                    "pressures?",
                    s.name, -down));
  if (down > 11000) out.push_back(fmt::format("{}: the median depth is {:.4g} m; is its unit right?", s.name, down));
}

void find_speed(const SensorSeries& s, std::vector<std::string>& out) {
  const double speed =
      median(sampled(s, [&](std::size_t i) { return std::hypot(s.at(i, 1), s.at(i, 2), s.at(i, 3)); }));
  if (speed > 60) out.push_back(fmt::format("{}: the median speed is {:.4g} m/s; is its unit right?", s.name, speed));
}

void find_jumps(const SensorSeries& s, std::vector<std::string>& out) {
  constexpr double kMaxSpeed = 100;  // m/s
  std::size_t count = 0;
  double first = 0;
  for (std::size_t i = 1; i < s.rows; ++i) {
    const double step =
        std::hypot(s.at(i, 1) - s.at(i - 1, 1), s.at(i, 2) - s.at(i - 1, 2), s.at(i, 3) - s.at(i - 1, 3));
    if (step > 20 + kMaxSpeed * (s.t(i) - s.t(i - 1)) && count++ == 0) first = s.t(i);
  }
  if (count > 0)
    out.push_back(
        fmt::format("{}: {} jumps faster than {} m/s, the first at {}", s.name, count, kMaxSpeed, time_text_of(first)));
}

void find_angles(const SensorSeries& s, std::size_t azimuth, std::vector<std::string>& out) {
  double most = 0;
  for (std::size_t i = 0; i < s.rows; ++i)
    most = std::max({most, std::abs(s.at(i, azimuth)), std::abs(s.at(i, azimuth + 1))});
  if (s.rows > 50 && most < 0.06)
    out.push_back(fmt::format("{}: all angles are below {:.3g} rad; is their unit right?", s.name, most));
}

/// The height and tilt of the chaser over time: from odometry, or else the height from a depth sensor or a GPS
/// receiver, with the chaser taken as level.
class ChaserHeight {
 public:
  /// `series` has the z of the chaser in column `z`, and its orientation from column `orientation` on, if it is not 0.
  ChaserHeight(const SensorSeries& series, std::size_t z, std::size_t orientation)
      : series_(series), z_(z), orientation_(orientation) {}
  /// Returns the z in the world of a point in the chaser's body at time t.
  double z_of(double t, const Eigen::Vector3d& in_body) {
    while (row_ + 1 < series_.rows && series_.t(row_ + 1) <= t) ++row_;
    const auto c = [&](std::size_t column) { return series_.at(row_, column); };
    if (orientation_ == 0) return c(z_) + in_body.z();
    const std::size_t q = orientation_;
    return c(z_) + (Eigen::Quaterniond(c(q + 3), c(q), c(q + 1), c(q + 2)) * in_body).z();
  }

 private:
  const SensorSeries& series_;
  std::size_t z_, orientation_, row_ = 0;
};

std::optional<ChaserHeight> chaser_height(const std::vector<SensorSeries>& all) {
  if (const SensorSeries* odometry = of_type(all, "odometry")) return ChaserHeight(*odometry, 3, 4);
  if (const SensorSeries* depth = of_type(all, "depth")) return ChaserHeight(*depth, 1, 0);
  if (const SensorSeries* gps = of_type(all, "gps")) return ChaserHeight(*gps, 3, 0);
  return {};
}

/// Returns the median absolute deviation from the median.
double spread(const std::vector<double>& values) {
  const double middle = median(values);
  std::vector<double> distances;
  for (const double v : values) distances.push_back(std::abs(v - middle));
  return median(distances);
}

/// Compares the heights of the target with the given sign of the elevation and with the other one. The sign is known if
/// the target keeps its height while the chaser changes its own, or if the target would be above the water with one of
/// the signs only.
void find_elevation_sign(const std::vector<SensorSeries>& all, bool ned, const SensorSeries& s,
                         std::vector<std::string>& out) {
  std::optional<ChaserHeight> chaser = chaser_height(all);
  if (!chaser || s.turned) return;
  std::vector<double> given, turned;
  for (std::size_t i = 0; i < s.rows; ++i) {
    const double r = s.at(i, 1), azimuth = s.at(i, 2), elevation = s.at(i, 3);
    const Eigen::Vector3d d(r * std::cos(elevation) * std::cos(azimuth), r * std::cos(elevation) * std::sin(azimuth),
                            r * std::sin(elevation));
    given.push_back(chaser->z_of(s.t(i), d));
    turned.push_back(chaser->z_of(s.t(i), Eigen::Vector3d(d.x(), d.y(), -d.z())));
  }
  if (given.size() < 10) return;
  const double as_given = spread(given), as_turned = spread(turned);
  const double height_given = median(given), height_turned = median(turned);
  const double above = ned ? -1 : 1;
  const bool above_water = above * height_given > 2 && above * height_turned < 1;
  if (as_turned < 0.6 * as_given || above_water)
    out.push_back(fmt::format(
        "{}: the sign of the elevation looks wrong: as given, the target's z is {:.1f} ± {:.1f} m; with the other sign "
        "(-FIELD) it is {:.1f} ± {:.1f} m. Elevations count towards z of the sensor's axes",
        s.name, height_given, as_given, height_turned, as_turned));
}

}  // namespace

std::string time_text_of(double t) { return t > kSince1970 ? utc_text(t) : fmt::format("{:.3f} s", t); }

SeriesGaps gaps_of(const SensorSeries& s) {
  constexpr double kTimesMedian = 10, kLeast = 5;  // s
  SeriesGaps gaps;
  std::vector<double> steps;
  const std::size_t stride = std::max<std::size_t>(1, s.rows / 20000);
  for (std::size_t i = 1; i < s.rows; i += stride) steps.push_back(s.t(i) - s.t(i - 1));
  if (steps.empty()) return gaps;
  gaps.median_step = median(std::move(steps));
  for (std::size_t i = 1; i < s.rows; ++i) {
    const double gap = s.t(i) - s.t(i - 1);
    if (gap < std::max(kLeast, kTimesMedian * gaps.median_step)) continue;
    ++gaps.count;
    if (gap > gaps.longest) std::tie(gaps.longest, gaps.longest_from) = std::pair(gap, s.t(i - 1));
  }
  return gaps;
}

std::vector<std::string> series_findings(const std::vector<SensorSeries>& all, bool ned) {
  std::vector<std::string> out;
  for (const SensorSeries& s : all) {
    if (s.rows == 0) continue;
    find_clock(s, out);
    find_gaps(s, out);
    if (s.type == "imu") find_imu(s, ned, out);
    if (s.type == "depth") find_depth(s, ned, out);
    if (s.type == "dvl") find_speed(s, out);
    if (s.type == "gps" || s.type == "odometry" || s.type.starts_with("truth")) find_jumps(s, out);
    if (s.type == "bearing") find_angles(s, 1, out);
    if (s.type == "range_bearing" || s.type == "usbl_spherical") {
      find_angles(s, 2, out);
      find_elevation_sign(all, ned, s, out);
    }
  }
  return out;
}

}  // namespace tandem

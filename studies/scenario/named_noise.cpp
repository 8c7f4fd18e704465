#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/scenario/named_noise.hpp>

namespace tandem {
namespace {

template <int N>
std::span<double> span(Vector<N>& v) {
  return {v.data(), static_cast<std::size_t>(v.size())};
}

}  // namespace

std::vector<NamedNoise> named_noise(TrackingData& data) {
  TrackingNoise& noise = data.noise;
  std::vector<NamedNoise> all = {{"prior", span(noise.prior), true},
                                 {"odometry", span(noise.odometry), true},
                                 {"constant_twist", span(noise.constant_twist), true},
                                 {"constant_velocity", span(noise.constant_velocity)},
                                 {"acceleration", span(noise.acceleration)},
                                 {"twist_time", span(noise.twist_time)},
                                 {"velocity_time", span(noise.velocity_time)},
                                 {"boundary", span(noise.boundary)},
                                 {"roll_pitch", span(noise.roll_pitch)},
                                 {"non_holonomic", span(noise.non_holonomic).first(data.planar ? 1 : 2)},
                                 {"surge", {&noise.surge, 1}},
                                 {"yaw_rate", {&noise.yaw_rate, 1}}};
  for (TargetSensor& sensor : data.sensors) {
    all.push_back({sensor.name, span(sensor.sigma)});
    if (sensor.error && sensor.error->has_bias())
      all.push_back({error_name(sensor.name), span(sensor.error->bias_sigma)});
  }
  return all;
}

std::string why_invalid_sigmas(std::span<const double> values, std::size_t expected) {
  if (values.size() != expected)
    return fmt::format("needs {} standard deviation{}, not {}", expected, expected == 1 ? "" : "s", values.size());
  for (const double value : values)
    if (!std::isfinite(value) || value <= 0.0)
      return fmt::format("has the standard deviation {:g}; it must be above zero and finite", value);
  return "";
}

void read_sigmas(const YamlSection& section, const std::string& key, std::span<double> sigmas) {
  const std::vector<double> values = section.numbers(key);
  const std::string reason = why_invalid_sigmas(values, sigmas.size());
  if (!reason.empty()) section.fail(key, fmt::format("{} {}", key, reason));
  std::copy(values.begin(), values.end(), sigmas.begin());
}

void convert_noise_axes(TrackingNoise& noise, const Frame& frame) {
  if (!frame.is_ned()) return;
  for (Eigen::VectorXd* sigma : {&noise.constant_velocity, &noise.velocity_time, &noise.boundary})
    std::swap((*sigma)[0], (*sigma)[1]);  // swaps north and east
}

}  // namespace tandem

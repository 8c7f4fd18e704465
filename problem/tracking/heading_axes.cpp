#include <algorithm>
#include <cmath>
#include <numbers>

#include <tandem/lie/wrapped_angle.hpp>
#include <tandem/problem/tracking/heading_axes.hpp>

namespace tandem::detail {
namespace {

constexpr double kMinTimes = 6;     // minimum length of an interval, in time constants of the sums
constexpr double kMaxSpeeds = 1.5;  // maximum speed, in speeds at which following the axes costs as much as it gains
constexpr double kFaint = 1e-3;  // weight of the strongest axis that each axis has at least, when a half turn is placed

}  // namespace

HeadingAxes heading_axes(const std::vector<Keyframe>& keyframes, const SmoothedTrack& track, const TrackingNoise& noise,
                         const TrackingOptions& options) {
  const std::size_t n = keyframes.size();
  const Eigen::VectorXd& sigma = noise.constant_twist.isZero(0) ? noise.acceleration : noise.constant_twist;
  if (!(sigma.minCoeff() > 0) || n < 3) return {};
  const double of_acceleration = 0.25 * (1 / (sigma[1] * sigma[1]) - 1 / (sigma[0] * sigma[0]));
  const double across = noise.non_holonomic[0];
  const bool non_holonomic = options.non_holonomic != Role::off && across > 0;
  const double of_velocity = non_holonomic ? 0.25 / (across * across) : 0.0;
  if (of_acceleration == 0 && !non_holonomic) return {};
  const auto velocity = [&](std::size_t k) {  // from k − 1 to k, as a complex number
    const Vector<3> v = (track.position[k] - track.position[k - 1]) / (keyframes[k].t - keyframes[k - 1].t);
    return std::complex<double>(v.x(), v.y());
  };
  HeadingAxes axes{std::vector<std::complex<double>>(n), sigma[1], sigma[sigma.size() - 1], non_holonomic};
  for (std::size_t k = 1; k + 1 < n; ++k) {
    const std::complex<double> v = velocity(k), change = velocity(k + 1) - v;
    axes.axis[k] = of_acceleration * (keyframes[k + 1].t - keyframes[k].t) * change * change + of_velocity * v * v;
  }
  return axes;
}

std::vector<double> follow_axes(const std::vector<Keyframe>& keyframes, const SmoothedTrack& track,
                                const HeadingAxes& axes, std::size_t first, std::size_t end, double before,
                                double after) {
  constexpr double pi = std::numbers::pi;
  const std::size_t last = std::min(end, keyframes.size() - 1), size = end - first;
  const double duration = keyframes[last].t - keyframes[first].t;
  double gain = 0;  // per second
  if (!axes.axis.empty() && duration > 0)
    for (std::size_t k = first; k < end; ++k) gain += std::abs(axes.axis[k]) / duration;
  if (!(gain > 0)) return {};
  const double time = std::pow(4 * gain * axes.yaw_sigma * axes.yaw_sigma, -0.25);
  const double speed = (track.position[last] - track.position[first]).head<2>().norm() / duration;
  const bool slow = axes.non_holonomic || speed <= kMaxSpeeds * std::sqrt(2 * gain) * axes.sway_sigma * time;
  if (duration < kMinTimes * time || !slow) return {};

  std::vector<std::complex<double>> sum(axes.axis.begin() + std::ptrdiff_t(first),
                                        axes.axis.begin() + std::ptrdiff_t(end));
  const std::vector<std::complex<double>> own = sum;
  const auto decay = [&](std::size_t i) {
    return std::exp((keyframes[first + i - 1].t - keyframes[first + i].t) / time);
  };
  for (std::size_t i = 1; i < size; ++i) sum[i] += decay(i) * sum[i - 1];
  std::complex<double> later = 0;
  for (std::size_t i = size - 1; i-- > 0;) sum[i] += later = decay(i + 1) * (own[i + 1] + later);

  std::vector<double> headings(size), weakness(size);
  double strongest = 0, weaknesses = 0, heading = before;
  for (const std::complex<double>& s : sum) strongest = std::max(strongest, std::abs(s));
  for (std::size_t i = 0; i < size; ++i) {
    headings[i] = heading += std::remainder(0.5 * std::arg(sum[i]) - heading, pi);
    weaknesses += weakness[i] = 1 / (std::abs(sum[i]) + kFaint * strongest);
  }
  const double from_start = first > 0 ? wrapped_angle(before - headings.front()) : 0.0;
  const double from_end = end < keyframes.size() ? wrapped_angle(after - headings.back()) : 0.0;
  const double half_turn = std::abs(from_end) > pi / 2 ? std::copysign(pi, from_end) : 0.0;
  double turned = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const double t = keyframes[first + i].t;
    turned += weakness[i] / weaknesses;
    headings[i] += half_turn * turned + from_start * std::exp((keyframes[first].t - t) / time) +
                   (from_end - half_turn) * std::exp((t - keyframes[last].t) / time);
  }
  return headings;
}

}  // namespace tandem::detail

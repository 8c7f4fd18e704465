#include <algorithm>

#include <tandem/problem/navigation/wrong_first_lines.hpp>

namespace tandem {
namespace {

constexpr std::size_t kMaxLines = 30, kMinAfter = 4;
constexpr double kSigmas = 10, kRates = 3, kLongStep = 3;

/// Returns the rate of change [unit of the sensor / s] that any vehicle reaches within one step.
double ordinary_rate(EgoReading reading) {
  switch (reading) {
    case EgoReading::body_vector:
    case EgoReading::world_vector:
      return 1.0;
    case EgoReading::world_height:
    case EgoReading::orientation:
      break;
  }
  return 0.3;
}

Eigen::VectorXd change(EgoReading reading, const EgoMeasurement& from, const EgoMeasurement& to) {
  if (reading == EgoReading::orientation) return (from.rotation.inverse() * to.rotation).Log();
  if (reading == EgoReading::world_height) return Eigen::VectorXd::Constant(1, to.value.z() - from.value.z());
  return to.value - from.value;
}

}  // namespace

std::size_t wrong_first_lines(const EgoSensor& sensor) {
  const EgoReading reading = sensor.type->reading;
  const std::vector<EgoMeasurement>& m = sensor.measurements;
  const auto step = [&](std::size_t i) { return m[i + 1].t - m[i].t; };
  const auto size = [&](std::size_t i) { return Eigen::VectorXd(change(reading, m[i], m[i + 1]).cwiseAbs()); };
  for (std::size_t n = std::min(kMaxLines, m.size() / 3); n > 0; --n) {
    const std::size_t end = std::min(n + std::max(2 * n, kMinAfter), m.size() - 1);  // of the steps after the jump
    if (end < n + kMinAfter - 1) continue;
    Eigen::VectorXd rate = Eigen::VectorXd::Constant(sensor.sigma.size(), ordinary_rate(reading));
    double longest = 0;
    for (std::size_t i = n; i < end; ++i) {
      rate = rate.cwiseMax(kRates / step(i) * size(i));
      longest = std::max(longest, step(i));
    }
    const auto jumps = [&](std::size_t i) {
      return ((size(i) - kSigmas * sensor.sigma - step(i) * rate).array() > 0).any();
    };
    if (!jumps(n - 1) || step(n - 1) > kLongStep * longest) continue;
    bool before = false;
    for (std::size_t i = 0; i + 1 < n && !before; ++i) before = jumps(i);
    if (!before) return n;
  }
  return 0;
}

}  // namespace tandem

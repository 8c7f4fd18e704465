#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include <tandem/lie/types.hpp>
#include <tandem/studies/simulation/normal_noise.hpp>

namespace tandem {

/// Target motion of a simulated rendezvous: nearly constant speed, with a turn rate that oscillates about zero.
class SwingingTarget {
 public:
  SwingingTarget(std::uint64_t seed, double speed) : speed_(speed) {
    NormalNoise draw(seed, 11);
    for (double& p : phase_) p = 2.0 * std::numbers::pi * draw();
    for (double& r : rate_) r = 0.012 * (1.0 + 0.3 * draw());
  }
  /// Returns the body twist through the water at t [s]: [m/s, rad/s].
  Vector<6> twist(double t) const {
    constexpr double periods[] = {47.0, 83.0};  // s
    Vector<6> w = Vector<6>::Zero();
    w[0] = speed_ * (1.0 + 0.1 * std::sin(2.0 * std::numbers::pi * t / 61.0 + phase_[0]));
    for (int i = 0; i < 2; ++i) w[5] += rate_[i] * std::sin(2.0 * std::numbers::pi * t / periods[i] + phase_[i]);
    return w;
  }

 private:
  double speed_, phase_[2], rate_[2];
};

}  // namespace tandem

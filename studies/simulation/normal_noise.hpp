#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include <tandem/lie/types.hpp>

namespace tandem {

/// Generator of normal random numbers, reproducible across standard libraries (unlike std::normal_distribution).
/// Streams of one seed are independent, so an additional sensor does not change the noise of the others.
class NormalNoise {
 public:
  NormalNoise(std::uint64_t seed, std::uint32_t stream) {
    std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32), stream};
    random_.seed(sequence);
  }

  /// Returns a standard normal number (Box & Muller 1958).
  double operator()() {
    if (has_second_) {
      has_second_ = false;
      return second_;
    }
    const double r = std::sqrt(-2 * std::log(uniform())), angle = 2 * std::numbers::pi * uniform();
    has_second_ = true;
    second_ = r * std::sin(angle);
    return r * std::cos(angle);
  }
  /// Returns a vector of independent numbers with these standard deviations.
  template <int N>
  Vector<N> vector(const Vector<N>& sigma) {
    Vector<N> v;
    for (int i = 0; i < N; ++i) v[i] = sigma[i] * (*this)();
    return v;
  }
  Vector<3> vector(double sigma) { return vector<3>(Vector<3>::Constant(sigma)); }

 private:
  /// Returns a uniform number in (0, 1].
  double uniform() { return (double(random_() >> 11) + 1) * 0x1p-53; }

  std::mt19937_64 random_;
  double second_ = 0;
  bool has_second_ = false;
};

}  // namespace tandem

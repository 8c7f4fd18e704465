#pragma once

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>

namespace tandem {

using PoseBundle = Bundle<SE3, Rn<3>, Rn<6>>;
using MixedBundle = Bundle<SO2, SE23>;
using BasicGroups = ::testing::Types<SO2, SE2, SO3, SE3, SE23, Rn<1>, Rn<3>>;
using Bundles = ::testing::Types<PoseBundle, MixedBundle>;
using AllGroups = ::testing::Types<SO2, SE2, SO3, SE3, SE23, Rn<1>, Rn<3>, PoseBundle, MixedBundle>;

/// Number of rows at the end of a tangent that are its rotation.
template <class G>
struct RotationSize;
template <class S>
struct RotationSize<BasicSO2<S>> : std::integral_constant<int, 1> {};
template <class S>
struct RotationSize<BasicSE2<S>> : std::integral_constant<int, 1> {};
template <class S>
struct RotationSize<BasicSO3<S>> : std::integral_constant<int, 3> {};
template <int K, class S>
struct RotationSize<BasicSEK3<K, S>> : std::integral_constant<int, 3> {};
template <int N, class S>
struct RotationSize<BasicRn<N, S>> : std::integral_constant<int, 0> {};

/// Random tangents, points and elements; every run draws the same ones.
class Samples {
 public:
  explicit Samples(unsigned seed = 1) : random_(seed) {}

  template <int N>
  Vector<N> vector() {
    Vector<N> v;
    for (int i = 0; i < N; ++i) v[i] = normal_(random_);
    return v;
  }
  /// Returns a tangent with a rotation by `angle` [rad] in each part that rotates; every fourth rotation is about a
  /// coordinate axis. The other entries are of order `scale`.
  template <LieGroup G>
  typename G::Tangent tangent(double angle, double scale = 1.) {
    typename G::Tangent v;
    fill<G>(v, angle, scale);
    return v;
  }
  /// Returns an element with entries of order one and a random rotation.
  template <LieGroup G>
  G element() {
    return G::Exp(tangent<G>(std::uniform_real_distribution<double>(0., M_PI)(random_)));
  }

 private:
  template <class G, class V>
  void fill(V&& v, double angle, double scale) {
    if constexpr (requires { typename G::Parts; }) {
      [&]<int... I>(std::integer_sequence<int, I...>) {
        (fill<typename G::template Part<I>>(v.template segment<G::template Part<I>::dof>(G::template offset<I>()),
                                            angle, scale),
         ...);
      }
      (std::make_integer_sequence<int, G::size>{});
    } else {
      constexpr int n = RotationSize<G>::value;
      v = scale * vector<G::dof>();
      if constexpr (n > 0) {
        Vector<n> axis = vector<n>().normalized();
        if (++count_ % 4 == 0) axis = Vector<n>::Unit(static_cast<int>(random_() % n));
        v.template tail<n>() = angle * axis;
      }
    }
  }

  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  int count_ = 0;
};

/// Returns the angles [rad] of the tests: tiny and moderate ones, both sides of each series threshold, and angles near
/// π.
inline std::vector<double> test_angles() {
  std::vector<double> angles{0., 1e-12, 1e-8, 1e-4, 1e-2, 0.1, 1., 2., 3., M_PI - 1e-3, M_PI - 1e-6, M_PI - 1e-9};
  const double thresholds[] = {std::sqrt(AngleCoefficients<double>::kSeriesBelow), std::sqrt(SO3::kSeriesBelow),
                               2. * std::asin(std::sqrt(SO3::kSeriesBelow))};
  for (const double threshold : thresholds)
    for (const double side : {-1e-9, -1e-15, 1e-15, 1e-9}) angles.push_back(threshold * (1. + side));
  return angles;
}

}  // namespace tandem

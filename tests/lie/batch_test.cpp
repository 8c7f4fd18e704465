#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <tandem/lie/batch.hpp>
#include <tandem/lie/sek3.hpp>

namespace tandem {
namespace {

using B = Batch<4>;
using Poses = BasicSE3<B>;
static_assert(LieGroup<Poses> && Over<Poses, SE3>);

B batch(double a, double b, double c, double d) {
  B x;
  x.set(0, a), x.set(1, b), x.set(2, c), x.set(3, d);
  return x;
}

TEST(Batch, ArithmeticIsElementwise) {
  const B x = batch(1.0, 2.0, -3.0, 0.25), y = batch(4.0, -5.0, 6.0, 7.0);
  const B z = 2.0 * x / y - (x - y) * y + 1.0;
  for (int i = 0; i < B::width; ++i) {
    EXPECT_DOUBLE_EQ(z[i], 2.0 * x[i] / y[i] - (x[i] - y[i]) * y[i] + 1.0);
    EXPECT_DOUBLE_EQ(sin(x)[i], std::sin(x[i]));
    EXPECT_DOUBLE_EQ(cos(x)[i], std::cos(x[i]));
    EXPECT_DOUBLE_EQ(sqrt(x * x)[i], std::abs(x[i]));
    EXPECT_DOUBLE_EQ(atan2(y, x)[i], std::atan2(y[i], x[i]));
  }
}

TEST(Batch, PiecewiseSelectsPerLane) {
  const auto piece = [](const B& x) {
    return detail::piecewise(
        x, 0.5, [&] { return B(2.0 * x); }, [&] { return B(1.0 / x); });
  };
  for (const B& x : {batch(0.1, 0.2, 0.3, 0.4), batch(1.0, 2.0, 3.0, 0.5), batch(0.0, 2.0, -4.0, 0.75)})
    for (int i = 0; i < B::width; ++i) EXPECT_DOUBLE_EQ(piece(x)[i], x[i] < 0.5 ? 2.0 * x[i] : 1.0 / x[i]);
}

/// One batch holds angles on both sides of every threshold, including 0 and almost π.
TEST(Batch, GroupsMatchThoseOverDouble) {
  const double pi = std::numbers::pi;
  for (const auto& angles :
       {batch(0.0, 0.01, 0.7, pi - 1e-9), batch(1e-9, 0.03, 0.1, 3.0), batch(2.0, 0.499, 0.501, 1.5)}) {
    Poses::Tangent v;
    for (int k = 0; k < 6; ++k) v[k] = k < 3 ? batch(0.3 * k - 1, 2.0, -k, 0.1) : angles * (k - 3.0) / std::sqrt(5.0);
    const Poses X = Poses::Exp(v);
    const auto check = [&](const auto& of_batch, const auto& of_double, int lane) {
      for (Eigen::Index k = 0; k < of_double.size(); ++k)
        EXPECT_NEAR(of_batch.data()[k][lane], of_double.data()[k], 2e-15 * (1 + of_double.norm())) << lane;
    };
    for (int i = 0; i < B::width; ++i) {
      Vector<6> w;
      for (int k = 0; k < 6; ++k) w[k] = v[k][i];
      const SE3 Y = SE3::Exp(w);
      check(X.matrix(), Y.matrix(), i);
      check(X.Ad(), Y.Ad(), i);
      check(Poses::Jl(v), SE3::Jl(w), i);
      check(Poses::Jl_inverse(v), SE3::Jl_inverse(w), i);
      check(X.Log(), w, i);
      check((X * X.inverse()).Log(), Vector<6>(Vector<6>::Zero()), i);
    }
  }
}

}  // namespace
}  // namespace tandem

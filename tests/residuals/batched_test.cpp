#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <tandem/residuals/batched.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/relative_pose.hpp>

namespace tandem::detail {
namespace {

/// Random tangents of given length and angle.
class Tangents {
 public:
  Vector<6> operator()(double length, double angle) {
    std::normal_distribution<double> normal;
    Vector<6> v;
    for (double& x : v) x = normal(random_);
    v.head<3>() *= length / v.head<3>().norm();
    v.tail<3>() *= angle / v.tail<3>().norm();
    return v;
  }

 private:
  std::mt19937_64 random_{1};
};

/// Checks that rows, Jacobians and curvatures of a batch match those of single evaluation.
template <class R, class... Xs>
void expect_match(const std::array<R, kBatch>& residual, const std::array<Xs, kBatch>&... x) {
  constexpr std::size_t arity = sizeof...(Xs);
  std::array<const R*, kBatch> residuals;
  std::array<double, kBatch * 6> r;
  std::array<std::array<double, kBatch * 36>, arity> J;
  for (std::size_t i = 0; i < kBatch; ++i) residuals[i] = &residual[i];
  const auto pointers = [](const auto& states) {
    std::array<const SE3*, kBatch> p;
    for (std::size_t i = 0; i < kBatch; ++i) p[i] = &states[i];
    return p;
  };
  std::array<double*, arity> columns;
  for (std::size_t s = 0; s < arity; ++s) columns[s] = J[s].data();
  Batched<R>::linearize(residuals, {pointers(x)...}, r.data(), columns);
  std::array<double, kBatch * 6> rows;
  Batched<R>::evaluate(residuals, {pointers(x)...}, rows.data());
  EXPECT_EQ(rows, r);
  constexpr int n = 6 * int(arity);
  std::array<double, kBatch * 6> w;
  std::array<double, kBatch * n * n> C;
  for (std::size_t k = 0; k < w.size(); ++k) w[k] = std::sin(1.0 + 2.0 * double(k));
  Batched<R>::curvature(residuals, {pointers(x)...}, w.data(), C.data());
  for (std::size_t i = 0; i < kBatch; ++i) {
    Matrix<n, n> of_each;
    residual[i].curvature(x[i]..., Vector<6>(w.data() + 6 * i), of_each);
    EXPECT_LE((Eigen::Map<Matrix<n, n>>(C.data() + n * n * i) - of_each).norm(), 1e-13 * (1 + of_each.norm()));
    Vector<6> one;
    std::array<Matrix<6, 6>, arity> of_one;
    std::apply([&](auto&... Ji) { residual[i](x[i]..., one, &Ji...); }, of_one);
    EXPECT_LE((Eigen::Map<Vector<6>>(r.data() + 6 * i) - one).norm(), 1e-14 * (1 + one.norm()));
    for (std::size_t s = 0; s < arity; ++s)
      EXPECT_LE((Eigen::Map<Matrix<6, 6>>(J[s].data() + 36 * i) - of_one[s]).norm(), 1e-13 * (1 + of_one[s].norm()));
  }
}

constexpr double kPi = std::numbers::pi;
/// Angles of small and large residuals in one batch, including 0 and almost π.
constexpr std::array<std::array<double, kBatch>, 4> kAngles{
    {{0.0, 1e-6, 0.01, 0.02}, {0.05, 0.4, 0.6, 1.0}, {0.001, 2.0, 3.0, kPi - 1e-6}, {0.49, 0.51, 0.03, 0.04}}};

TEST(Batched, RelativePoseMatchesSingleEvaluation) {
  Tangents tangent;
  for (const auto& angles : kAngles) {
    std::array<SE3, kBatch> x, y;
    std::array<RelativePose<SE3>, kBatch> residual;
    for (std::size_t i = 0; i < kBatch; ++i) {
      x[i] = SE3::Exp(tangent(9, 2));
      const SE3 B = SE3::Exp(tangent(0.5, 0.3)), F = SE3::Exp(tangent(0.2, 1)), z = SE3::Exp(tangent(3, 1.2));
      y[i] = x[i] * B * z * SE3::Exp(tangent(0.5, angles[i])) * F.inverse();
      residual[i] = {z, B, F};
    }
    expect_match(residual, x, y);
  }
}

TEST(Batched, ConstantTwistMatchesSingleEvaluation) {
  Tangents tangent;
  for (const auto& turns : kAngles)
    for (const auto& angles : kAngles) {
      std::array<SE3, kBatch> x, y, z;
      std::array<ConstantTwist<SE3>, kBatch> residual;
      for (std::size_t i = 0; i < kBatch; ++i) {
        x[i] = SE3::Exp(tangent(9, 2));
        const Vector<6> step = tangent(2, turns[i]);
        residual[i] = {1.0, 0.5 + 0.1 * double(i)};
        y[i] = x[i] * SE3::Exp(step);
        z[i] = y[i] * SE3::Exp(residual[i].dt2 * step) * SE3::Exp(tangent(1, angles[i]));
      }
      expect_match(residual, x, y, z);
    }
}

}  // namespace
}  // namespace tandem::detail

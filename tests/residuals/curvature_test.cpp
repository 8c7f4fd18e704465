#include <random>

#include <gtest/gtest.h>

#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/range.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/relative_rotation.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/residuals/vehicle/inside_cone.hpp>
#include <tandem/residuals/with_bias.hpp>

#include "residuals/curvature_autodiff.hpp"

/// Second derivatives of residuals against central differences of their Jacobians and automatic differentiation.
namespace tandem {
namespace {

std::mt19937_64 generator{11};

template <int N>
Vector<N> random_tangent(double size) {
  std::normal_distribution<double> normal(0.0, size);
  return Vector<N>::NullaryExpr([&] { return normal(generator); });
}
template <class G>
G random_state(double size) {
  return G::Exp(random_tangent<G::dof>(size));
}

/// Returns Jᵀ w of the residual at states x Exp(ζ), as derivatives with respect to ζ.
template <class R, class... X>
Eigen::VectorXd gradient_by(const R& residual, const Vector<R::dim>& w, const std::tuple<X...>& x, int state,
                            const Eigen::VectorXd& zeta) {
  Vector<R::dim> r;
  std::tuple<Matrix<R::dim, X::dof>...> J;
  std::apply([&](const auto&... at) { std::apply([&](auto&... by) { residual(at..., r, &by...); }, J); }, x);
  Eigen::VectorXd g((X::dof + ...));
  int first = 0, index = 0;
  std::apply(
      [&](const auto&... by) {
        const auto put = [&](const auto& Js) {
          g.segment(first, Js.cols()) = Js.transpose() * w;
          if (index++ == state) {
            using G = std::tuple_element_t<0, std::tuple<X...>>;  // all states are in one group here
            const typename G::Tangent step = zeta;
            g.segment(first, Js.cols()) = (G::Jr(step).transpose() * g.segment(first, Js.cols())).eval();
          }
          first += static_cast<int>(Js.cols());
        };
        (put(by), ...);
      },
      J);
  return g;
}

template <class R>
void expect_curvature(const R& residual, double size) {
  using States = typename R::States;
  using G = std::tuple_element_t<0, States>;
  constexpr int n = detail::CurvatureOf<R, States>::size;
  static_assert(HasCurvature<R>);
  States x;
  std::apply([&](auto&... at) { ((at = random_state<G>(size)), ...); }, x);
  const Vector<R::dim> w = random_tangent<R::dim>(1.0);
  Eigen::MatrixXd expected(n, n);
  constexpr double h = 1e-5;
  for (int column = 0; column < n; ++column) {
    const int state = column / G::dof;
    Eigen::VectorXd side[2];
    for (const int s : {0, 1}) {
      const typename G::Tangent zeta = (s == 0 ? h : -h) * G::Tangent::Unit(column % G::dof);
      States moved = x;
      int index = 0;
      std::apply([&](auto&... at) { ((at = index++ == state ? at * G::Exp(zeta) : at), ...); }, moved);
      side[s] = gradient_by(residual, w, moved, state, zeta);
    }
    expected.col(column) = (side[0] - side[1]) / (2 * h);
  }
  Matrix<n, n> H;
  std::apply([&](const auto&... at) { residual.curvature(at..., w, H); }, x);
  EXPECT_LE((H - expected).cwiseAbs().maxCoeff(), 1e-8 * std::max(1.0, expected.cwiseAbs().maxCoeff()))
      << R::name << ", states of size " << size;
}

TEST(Curvature, MatchesDifferencesOfJacobians) {
  for (const double size : {0.0, 1e-7, 0.05, 0.4, 1.0})
    for (int trial = 0; trial < 5; ++trial) {
      expect_curvature(Prior<SE3>{random_state<SE3>(size)}, size);
      expect_curvature(RelativePose<SE3>{random_state<SE3>(size), random_state<SE3>(1.0), random_state<SE3>(1.0)},
                       size);
      expect_curvature(ConstantTwist<SE3>{0.7, 1.1}, size);
      const Vector<6> times{0.4, 1.0, 30.0, 1e9, 2.0, 0.7};
      expect_curvature(DampedTwist<SE3>::over(0.7, 1.1, times, random_tangent<6>(size)), size);
      expect_curvature(DampedTwist<R3>::over(0.7, 1.1, times.head<3>(), random_tangent<3>(1.0)), size);
      expect_curvature(RelativeRotation<SE3>{random_state<SO3>(size), random_state<SO3>(1.0), random_state<SO3>(1.0)},
                       size);
      expect_curvature(TwistComponents<SE3, sway | heave | yaw_rate>{0.7}, size);
      expect_curvature(ConstantTwist<R3>{0.7, 1.1}, size);
      expect_curvature(RollPitch<SE3>{}, size);
      expect_curvature(RollPitch<SO3>{}, size);
      expect_curvature(UsblPosition<SE3>{random_tangent<3>(size), random_state<SE3>(1.0), random_tangent<3>(1.0)},
                       size);
    }
}

TEST(Curvature, UsblPositionMatchesDualNumbers) {
  for (const double size : {0.0, 1e-7, 0.4, 3.0})
    for (int trial = 0; trial < 5; ++trial) {
      const SE3 chaser = random_state<SE3>(size), mount = random_state<SE3>(1.0);
      const Vector<3> w = random_tangent<3>(1.0), fix = random_tangent<3>(50.0), beacon = random_tangent<3>(1.0);
      testing::expect_correct_curvature(UsblPosition<SE3>{fix, mount, beacon}, w, chaser, random_state<SE3>(size));
      testing::expect_correct_curvature(UsblPosition<SE3, R3>{fix, mount}, w, chaser, R3(random_tangent<3>(30.0)));
      testing::expect_correct_curvature(UsblPosition<SE3, SE23>{fix, mount, beacon}, w, chaser,
                                        random_state<SE23>(size));
    }
}

TEST(Curvature, DampedTwistMatchesConstantTwistWithoutDecay) {
  const SE3 t0 = random_state<SE3>(1.0), t1 = random_state<SE3>(1.0), t2 = random_state<SE3>(1.0);
  const Vector<6> w = random_tangent<6>(1.0);
  Matrix<18, 18> damped, constant;
  DampedTwist<SE3>{0.7, 1.1, Vector<6>::Ones(), random_tangent<6>(1.0)}.curvature(t0, t1, t2, w, damped);
  ConstantTwist<SE3>{0.7, 1.1}.curvature(t0, t1, t2, w, constant);
  EXPECT_LE((damped - constant).cwiseAbs().maxCoeff(), 1e-12 * constant.cwiseAbs().maxCoeff());
}

/// Far and near, almost on the axis of the cone, and with a bias.
TEST(Curvature, RangesAndConesMatchDualNumbers) {
  for (const double size : {1e-3, 0.4, 3.0, 30.0})
    for (int trial = 0; trial < 5; ++trial) {
      const SE3 chaser = random_state<SE3>(1.0), mount = random_state<SE3>(1.0);
      const SE3 target = chaser * SE3(random_state<SO3>(1.0), Vector<3>(size, 0.3 * size, -0.5 * size));
      const Vector<1> w = random_tangent<1>(1.0);
      const Vector<3> beacon = random_tangent<3>(1.0), off_axis = random_tangent<3>(1e-3);
      testing::expect_correct_curvature(Range<SE3>{2.0, mount, beacon}, w, chaser, target);
      testing::expect_correct_curvature(Range<SE3, R3>{2.0, mount}, w, chaser, R3(target.translation()));
      testing::expect_correct_curvature(InsideCone<SE3>{0.6, mount, beacon}, w, chaser, target);
      const SE3 ahead = chaser * mount * SE3(SO3(), Vector<3>(size * Vector<3>::UnitX() + off_axis));
      testing::expect_correct_curvature(InsideCone<SE3>{0.6, mount}, w, chaser, ahead);
      testing::expect_correct_curvature(InsideCone<R3>{0.6, mount}, w, chaser, R3(target.translation()));
      testing::expect_correct_curvature(WithBias<Range<SE3>>{{2.0, mount, beacon}}, w, chaser, target, Rn<1>(w));
    }
}

/// Level, on the side, almost upside down, and close to the pitch where the residual is undefined.
TEST(Curvature, RollPitchMatchesDualNumbers) {
  for (const double roll : {0.0, 1e-9, 1e-5, 0.3, -1.5, 2.5, 3.1, 3.14159})
    for (const double pitch : {0.0, 1e-9, 0.3, -0.8, 1.4})
      for (const double yaw : {0.0, 2.0, 3.1}) {
        const SO3 R = SO3::Exp({0, 0, yaw}) * SO3::Exp({0, pitch, 0}) * SO3::Exp({roll, 0, 0});
        const Vector<2> w = random_tangent<2>(1.0);
        testing::expect_correct_curvature(RollPitch<SO3>{}, w, R);
        testing::expect_correct_curvature(RollPitch<SE3>{}, w, SE3(R, random_tangent<3>(5.0)));
        testing::expect_correct_curvature(RollPitch<SE23>{}, w, SE23(R, Matrix<3, 2>::Random()));
      }
}

/// Residuals with rotations by nearly π, where Log is steepest.
TEST(Curvature, IsAccurateNearPi) {
  for (const double angle : {2.5, 3.0, 3.1}) {
    const SE3 turned(SO3::Exp(Vector<3>(0.6, 0, 0.8) * angle), {1, 2, 3});
    expect_curvature(Prior<SE3>{turned}, 0.01);
    expect_curvature(RelativePose<SE3>{turned}, 0.01);
  }
}

}  // namespace
}  // namespace tandem

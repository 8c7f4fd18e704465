#include <gtest/gtest.h>

#include <tandem/lie/bundle.hpp>
#include <tandem/residuals/auto_diff.hpp>
#include <tandem/residuals/bearing.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/range_bearing.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/usbl_spherical.hpp>

#include "allocation_count.hpp"
#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

constexpr double kTolerance = 1e-12;  // of rows and Jacobians, relative to their largest entry

/// Expects rows and Jacobians of AutoDiff to equal those of the residual's closed form.
template <class R, class... Xs>
void expect_closed_form(const R& residual, const Xs&... x) {
  const AutoDiff<R> differentiated{residual};
  static_assert(Residual<AutoDiff<R>>);
  Vector<R::dim> r, dual, alone;
  std::tuple<RowsBy<R::dim, Xs>...> J, D;
  std::apply([&](auto&... M) { residual(x..., r, &M...); }, J);
  std::apply([&](auto&... M) { differentiated(x..., dual, &M...); }, D);
  differentiated(x..., alone);
  EXPECT_LE((dual - r).norm(), kTolerance * (1.0 + r.norm())) << R::name;
  EXPECT_LE((alone - r).norm(), kTolerance * (1.0 + r.norm())) << R::name;
  double largest = 0.0;
  std::apply([&](const auto&... M) { ((largest = std::max(largest, M.cwiseAbs().maxCoeff())), ...); }, J);
  detail::each<sizeof...(Xs)>([&](auto i) {
    EXPECT_LE((std::get<i>(D) - std::get<i>(J)).cwiseAbs().maxCoeff(), kTolerance * largest) << R::name << ", " << i;
  });
}

template <class R>
void expect_closed_form_at_random_states(const R& residual) {
  std::mt19937_64 random(1);
  for (int sample = 0; sample < 40; ++sample) {
    const auto states = random_states<typename R::States>(random, StateDistance(sample % 4));
    std::apply([&](const auto&... x) { expect_closed_form(residual, x...); }, states);
  }
}

template <class G>
class AutoDiffOnGroups : public ::testing::Test {};
using Groups = ::testing::Types<SO2, SE2, SO3, SE3, SE23, R2, Rn<6>, Bundle<SE3, R3>, Bundle<SO2, SE23>>;
TYPED_TEST_SUITE(AutoDiffOnGroups, Groups);

TYPED_TEST(AutoDiffOnGroups, EqualsClosedFormAtRandomStates) {
  using G = TypeParam;
  expect_closed_form_at_random_states(ConstantTwist<G>{0.4, 0.9});
  expect_closed_form_at_random_states(Prior<G>{G::Exp(tangent<G>(0.7, 2.0))});
  expect_closed_form_at_random_states(RelativePose<G>{G::Exp(tangent<G>(0.7, 2.0)), G::Exp(tangent<G>(0.3, 1.0))});
}

TYPED_TEST(AutoDiffOnGroups, EqualsClosedFormFromZeroToPi) {
  using G = TypeParam;
  const G t0 = G::Exp(tangent<G>(1.1, 30.0));
  for (const auto& d : residual_sizes<G>())
    for (const auto& e : residual_sizes<G>()) {
      const G t1 = t0 * G::Exp(d), t2 = t1 * G::Exp(0.5 * d) * G::Exp(e);
      expect_closed_form(ConstantTwist<G>{1.0, 0.5}, t0, t1, t2);
      expect_closed_form(RelativePose<G>{G::Exp(d)}, t0, t1 * G::Exp(e));
    }
}

TEST(AutoDiff, EqualsClosedFormOfMeasurements) {
  const SE3 B(SO3::Exp({0.1, -0.2, 0.3}), Vector<3>(1.0, 2.0, 3.0));
  const Direction<3> ahead(0.3, 0.1);
  expect_closed_form_at_random_states(RangeBearing<SE3, SE3>{9.0, ahead, B, Vector<3>(0.3, 0.2, 0.1)});
  expect_closed_form_at_random_states(RangeBearing<SE3, R3>{9.0, ahead, B});
  expect_closed_form_at_random_states(RangeBearing<SE2, R2>{9.0, 0.3, SE2(SO2(), Vector<2>(1.0, 2.0))});
  expect_closed_form_at_random_states(Bearing<SE3, R3>{ahead, B});
  expect_closed_form_at_random_states(UsblSpherical<SE3, R3>{9.0, 0.3, 0.1, B});
  const SE3 tilted = SE3::Exp((Vector<6>() << 1.0, 2.0, 3.0, 0.4, -0.6, 2.0).finished());
  expect_closed_form(RollPitch<SE3>{}, tilted);
  expect_closed_form(RollPitch<SO3>{}, tilted.rotation());
}

/// Mean velocity through the water in the frame of a log, and the turn, between two poses. Uses parts of groups,
/// products and mixed arithmetic.
struct LogSpeed {
  static constexpr std::string_view name = "log speed";
  static constexpr int dim = 2;
  using States = std::tuple<SE3, SE3, R3>;

  double dt;
  SE3 mount{};

  template <class S>
  Vector<2, S> operator()(const BasicSE3<S>& x0, const BasicSE3<S>& x1, const BasicRn<3, S>& current) const {
    using std::atan2, std::sqrt;
    const BasicSE3<S> sensor = x1 * mount.cast<S>();
    const Vector<3, S> moved = (x1.translation() - x0.translation()) / dt - current.vector();
    const Vector<3, S> body = sensor.rotation().matrix().transpose() * moved;
    const BasicSO3<S> turn(Eigen::Quaternion<S>(x0.rotation().inverse().quaternion() * x1.rotation().quaternion()));
    return {body[0] - 0.5 * turn.Log().squaredNorm(), atan2(body[1], sqrt(1.0 + body[0] * body[0]))};
  }
};

TEST(AutoDiff, DifferentiatesACallableOverTheScalar) {
  const AutoDiff residual{LogSpeed{0.5, SE3(SO3::Exp({0.1, 0.2, 0.3}), Vector<3>(0.5, 0.0, 0.1))}};
  const JacobianReport report = check_jacobians_at_random(residual, 1, 60);
  EXPECT_LE(report.relative, 1e-8 + report.resolution) << report.text;
}

/// A callable that sets the rows by reference, over any state type.
struct SetsRows {
  static constexpr std::string_view name = "sets rows";
  static constexpr int dim = 1;
  using States = std::tuple<R3, SO2>;
  void operator()(const Over<R3> auto& p, const Over<SO2> auto& heading, auto& r) const {
    r[0] = p.vector()[0] * heading.cos_angle() + p.vector()[1] * heading.sin_angle();
  }
};

TEST(AutoDiff, DifferentiatesACallableThatSetsTheRows) {
  const JacobianReport report = check_jacobians_at_random(AutoDiff{SetsRows{}}, 1, 20);
  EXPECT_LE(report.relative, 1e-9) << report.text;
}

TEST(AutoDiff, SetsOnlyRequestedJacobians) {
  const AutoDiff<ConstantTwist<SE2>> residual{{1.0, 0.5}};
  const SE2 a, b = SE2::Exp({1.0, 0.1, 0.2}), c = SE2::Exp({2.0, 0.3, 0.5});
  Vector<3> r;
  Matrix<3, 3> all[3], one;
  residual(a, b, c, r, &all[0], &all[1], &all[2]);
  residual(a, b, c, r, nullptr, &one, nullptr);
  EXPECT_EQ(one, all[1]);
}

struct Distance {
  static constexpr std::string_view name = "distance of two points";
  static constexpr int dim = 1;
  using States = std::tuple<R3, R3>;
  template <class S>
  Vector<1, S> operator()(const BasicRn<3, S>& a, const BasicRn<3, S>& b) const {
    return Vector<1, S>((a.vector() - b.vector()).norm());
  }
};

TEST(AutoDiff, NamesAResidualWithoutDerivatives) {
  const AutoDiff<Distance> residual{};
  const R3 same(Vector<3>(1.0, 2.0, 3.0)), infinite(Vector<3>(HUGE_VAL, 0.0, 0.0));
  Vector<1> r;
  Matrix<1, 3> Ja, Jb;
  const auto error = [](const auto& evaluate) -> std::string {
    try {
      evaluate();
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(error([&] { residual(same, same, r, &Ja, &Jb); }).find("distance of two points: a derivative"),
            std::string::npos);
  EXPECT_EQ(error([&] { residual(same, same, r); }), "");
  EXPECT_NE(error([&] { residual(same, infinite, r); }).find("distance of two points: a row"), std::string::npos);
}

TEST(AutoDiff, DoesNotAllocate) {
  const AutoDiff<ConstantTwist<Bundle<SE23, Rn<6>>>> large{{1.0, 0.6}};
  const AutoDiff<LogSpeed> own{{0.5}};
  std::mt19937_64 random(1);
  const auto x = random_states<ConstantTwist<Bundle<SE23, Rn<6>>>::States>(random, StateDistance::moderate);
  const auto y = random_states<LogSpeed::States>(random, StateDistance::moderate);
  Vector<15> r;
  Matrix<15, 15> J[3];
  Vector<2> s;
  Matrix<2, 6> K[2];
  Matrix<2, 3> L;
  const long before = allocations;
  large(std::get<0>(x), std::get<1>(x), std::get<2>(x), r, &J[0], &J[1], &J[2]);
  own(std::get<0>(y), std::get<1>(y), std::get<2>(y), s, &K[0], &K[1], &L);
  EXPECT_EQ(allocations - before, 0);
}

static_assert(IsLinear<AutoDiff<RelativePose<R3>>> && !IsLinear<AutoDiff<RelativePose<SE3>>>);

}  // namespace
}  // namespace tandem::testing

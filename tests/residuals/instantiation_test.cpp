#include <tuple>
#include <type_traits>

#include <gtest/gtest.h>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/se23.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/lie/so2.hpp>
#include <tandem/lie/so3.hpp>
#include <tandem/residuals/bearing.hpp>
#include <tandem/residuals/boundary.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/fields.hpp>
#include <tandem/residuals/mixed_velocity.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/range.hpp>
#include <tandem/residuals/range_bearing.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/relative_rotation.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/testing.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/residuals/usbl_spherical.hpp>
#include <tandem/residuals/vehicle/inside_cone.hpp>
#include <tandem/residuals/vehicle/quadrotor.hpp>
#include <tandem/residuals/vehicle/twist_kinematics.hpp>
#include <tandem/residuals/white_noise_acceleration.hpp>

/// Every residual compiles for every combination of groups that its constraints accept, and has correct Jacobians.
namespace tandem::testing {
namespace {

template <class... Gs>
struct Groups {};
using AllGroups = Groups<SO2, SE2, SO3, SE3, SE23, Rn<1>, Rn<2>, R3, Rn<6>, Bundle<SO3, R3>>;

/// Number of combinations checked, to detect constraints that reject everything.
int checked = 0;

template <class R>
void check(const R& residual) {
  ++checked;
  const JacobianReport report = check_jacobians_at_random(residual, 1, 4);
  // Near a discontinuity, differences are inaccurate.
  EXPECT_LT(report.relative, std::max(1e-6, report.resolution)) << type_name(typeid(R)) << ": " << report.text;
  if constexpr (HasCurvature<R>) {
    std::mt19937_64 random(2);
    const auto states = random_states<typename R::States>(random, StateDistance::moderate);
    const Vector<R::dim> w = Vector<R::dim>::Ones();
    std::apply(
        [&](const auto&... x) {
          Matrix<(0 + ... + std::remove_cvref_t<decltype(x)>::dof), (0 + ... + std::remove_cvref_t<decltype(x)>::dof)>
              H;
          residual.curvature(x..., w, H);
          EXPECT_TRUE(H.allFinite() && (H - H.transpose()).isZero(1e-9)) << type_name(typeid(R));
        },
        states);
  }
}

/// Checks the Jacobians of a residual of a chaser and a target at a moderate distance. Differences are meaningless
/// where the two nearly coincide, or where the direction between them is opposite to the measured direction.
template <class R>
void check_apart(const R& residual) {
  ++checked;
  std::mt19937_64 random(3);
  const auto states = random_states<typename R::States>(random, StateDistance::moderate);
  const JacobianReport report = std::apply([&](const auto&... x) { return check_jacobians(residual, x...); }, states);
  EXPECT_LT(report.relative, std::max(1e-6, report.resolution)) << type_name(typeid(R)) << ": " << report.text;
}

/// Checks make(type R<G>) for each group for which R<G> is a residual.
template <template <class> class R, class... Gs, class Make>
void each(Groups<Gs...>, Make make) {
  const auto one = [&]<class G>(std::type_identity<G>) {
    if constexpr (requires { typename R<G>; }) {
      if constexpr (Residual<R<G>>) check(make(std::type_identity<R<G>>()));
    }
  };
  (one(std::type_identity<Gs>()), ...);
}

/// Rotations have no position, so the distance between two of them is always 0, where observations are undefined.
template <class G>
constexpr bool is_rotation = std::same_as<G, SO2> || std::same_as<G, SO3>;

/// Checks make(type R<A, B>) for each pair of groups for which R<A, B> is a residual.
template <template <class, class> class R, class Make>
void each_pair(Make make) {
  const auto with_second = [&]<class A, class... Bs>(std::type_identity<A>, Groups<Bs...>) {
    const auto one = [&]<class B>(std::type_identity<B>) {
      if constexpr (requires { typename R<A, B>; }) {
        if constexpr (Residual<R<A, B>> && !(is_rotation<A> && is_rotation<B>))
          check_apart(make(std::type_identity<R<A, B>>()));
      }
    };
    (one(std::type_identity<Bs>()), ...);
  };
  const auto all = [&]<class... As>(Groups<As...> groups) { (with_second(std::type_identity<As>(), groups), ...); };
  all(AllGroups());
}

TEST(ResidualInstantiation, OfOneGroup) {
  each<Prior>(AllGroups(),
              []<class G>(std::type_identity<Prior<G>>) { return Prior<G>{G::Exp(0.3 * G::Tangent::Ones())}; });
  each<RelativePose>(AllGroups(), []<class G>(std::type_identity<RelativePose<G>>) { return RelativePose<G>{}; });
  each<RelativeRotation>(AllGroups(),
                         []<class G>(std::type_identity<RelativeRotation<G>>) { return RelativeRotation<G>{}; });
  each<ConstantTwist>(AllGroups(), []<class G>(std::type_identity<ConstantTwist<G>>) {
    return ConstantTwist<G>{1.0, 1.5};
  });
  each<DampedTwist>(AllGroups(), []<class G>(std::type_identity<DampedTwist<G>>) {
    return DampedTwist<G>{1.0, 1.5, Vector<G::dof>::Constant(0.9), Vector<G::dof>::Constant(0.1)};
  });
  each<WhiteNoiseAcceleration>(AllGroups(), []<class G>(std::type_identity<WhiteNoiseAcceleration<G>>) {
    return WhiteNoiseAcceleration<G>{0.5};
  });
  each<EulerKinematics>(AllGroups(),
                        []<class G>(std::type_identity<EulerKinematics<G>>) { return EulerKinematics<G>{0.1}; });
  each<TwistKinematics>(AllGroups(),
                        []<class G>(std::type_identity<TwistKinematics<G>>) { return TwistKinematics<G>{0.1}; });
  each<Boundary>(AllGroups(), []<class G>(std::type_identity<Boundary<G>>) { return Boundary<G>{}; });
  each<RollPitch>(AllGroups(), []<class G>(std::type_identity<RollPitch<G>>) { return RollPitch<G>{}; });
  each<InsideCone>(AllGroups(), []<class G>(std::type_identity<InsideCone<G>>) { return InsideCone<G>{0.5}; });
  EXPECT_EQ(checked, 7 * 10 + 3 + 7 + 3 + 4);
}

TEST(ResidualInstantiation, OfChaserAndTarget) {
  checked = 0;
  each_pair<Range>([]<class A, class B>(std::type_identity<Range<A, B>>) { return Range<A, B>{2.0}; });
  each_pair<UsblPosition>([]<class A, class B>(std::type_identity<UsblPosition<A, B>>) {
    return UsblPosition<A, B>{Vector<A::point_dim>::Ones()};
  });
  each_pair<UsblSpherical>([]<class A, class B>(std::type_identity<UsblSpherical<A, B>>) {
    return UsblSpherical<A, B>{2.0, 0.3, 0.1};
  });
  const auto ahead = []<int n>(std::integral_constant<int, n>) {
    return Direction<n>(Vector<n>(Vector<n>::UnitX() + 0.1 * Vector<n>::UnitY()));
  };
  each_pair<Bearing>([&]<class A, class B>(std::type_identity<Bearing<A, B>>) {
    return Bearing<A, B>{ahead(std::integral_constant<int, A::point_dim>())};
  });
  each_pair<RangeBearing>([&]<class A, class B>(std::type_identity<RangeBearing<A, B>>) {
    return RangeBearing<A, B>{2.0, ahead(std::integral_constant<int, A::point_dim>())};
  });
  EXPECT_GT(checked, 100);
}

TEST(ResidualInstantiation, OfThreeKeyframes) {
  check(MixedVelocity<SE3, R3, SE23>::constant(1.0, 1.5));
  check(MixedVelocity<SE2, Rn<2>, SE2>::constant(1.0, 1.5));
  check(MixedVelocity<Rn<6>, Rn<6>, Rn<6>>::constant(1.0, 1.5));
}

}  // namespace
}  // namespace tandem::testing

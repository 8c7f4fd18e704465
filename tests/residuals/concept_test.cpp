#include <gtest/gtest.h>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/bearing.hpp>
#include <tandem/residuals/boundary.hpp>
#include <tandem/residuals/coasting.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/depth.hpp>
#include <tandem/residuals/dvl_velocity.hpp>
#include <tandem/residuals/gps.hpp>
#include <tandem/residuals/heading.hpp>
#include <tandem/residuals/interpolated.hpp>
#include <tandem/residuals/miscalibrated.hpp>
#include <tandem/residuals/miscalibrated_ego.hpp>
#include <tandem/residuals/mixed_velocity.hpp>
#include <tandem/residuals/preintegrated_dvl.hpp>
#include <tandem/residuals/preintegrated_imu.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/propagated.hpp>
#include <tandem/residuals/range.hpp>
#include <tandem/residuals/range_bearing.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/relative_rotation.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/soft_bound.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/residuals/usbl_spherical.hpp>
#include <tandem/residuals/white_noise_acceleration.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

static_assert(Residual<Prior<SE3>> && Residual<Prior<SO2>> && Residual<Prior<Bundle<SE23, Rn<6>>>>);
static_assert(Residual<RelativePose<>> && Residual<RelativePose<SE2>> && Residual<RelativePose<SO3>>);
static_assert(Residual<UsblPosition<>> && Residual<UsblPosition<SE3, R3>> && Residual<UsblPosition<SE2, R2>>);
static_assert(Residual<RangeBearing<>> && Residual<RangeBearing<SE3, R3>> && Residual<RangeBearing<SE2, R2>>);
static_assert(Residual<Range<>> && Residual<Range<SE2, R2>> && Residual<Bearing<>> && Residual<Bearing<SE2, R2>>);
static_assert(Residual<UsblSpherical<>> && Residual<UsblSpherical<SE3, R3>>);
static_assert(Residual<Boundary<>> && Residual<Boundary<SE2>> && Residual<MixedVelocity<SE3, R3, SE3>>);
static_assert(Residual<ConstantTwist<SE3>> && Residual<ConstantTwist<R3>> && Residual<ConstantTwist<SE23>>);
static_assert(Residual<DampedTwist<SE3>> && Residual<DampedTwist<SE23>>);
static_assert(Residual<RelativeRotation<>> && Residual<RelativeRotation<SE2>> && Residual<RelativeRotation<SE23>>);
static_assert(Residual<WhiteNoiseAcceleration<SE3>> && Residual<WhiteNoiseAcceleration<Bundle<SE2, R3>>>);
static_assert(Residual<Interpolated<RelativePose<>>> && Residual<Interpolated<UsblPosition<SE2, R2>>>);
static_assert(Residual<RollPitch<>> && Residual<RollPitch<SO3>> && Residual<RollPitch<SE23>>);
static_assert(Residual<TwistComponents<SE3, sway | heave>> && Residual<TwistComponents<SE2, surge>>);
static_assert(Residual<Depth> && Residual<Gps> && Residual<Heading> && Residual<DvlVelocity>);
static_assert(Residual<ScaledDvlVelocity> && Residual<PreintegratedDvl> && Residual<PreintegratedImu>);
static_assert(Residual<Coasting> && Residual<RelativePose<Rn<6>>>);
static_assert(Residual<Propagated<Depth>> && Residual<Propagated<Gps>> && Residual<Propagated<Heading>>);
static_assert(Residual<Propagated<DvlVelocity>> && Residual<Propagated<ScaledDvlVelocity>>);
static_assert(Residual<Miscalibrated<UsblPosition<>>> && Residual<Miscalibrated<Bearing<SE2, R2>>>);
static_assert(Residual<MiscalibratedEgo<Depth>> && Residual<MiscalibratedEgo<DvlVelocity>>);
static_assert(Residual<Propagated<UsblPosition<>>> && Residual<Propagated<UsblPosition<SE3, R3>>>);
static_assert(Residual<SoftBound<TwistComponents<SE3, surge>>> && Residual<SoftBound<Prior<SE3>>>);

/// A user-defined residual for double only, not a template: the squared distance of two points [m²].
struct SquaredDistance {
  static constexpr std::string_view name = "squared distance";
  static constexpr int dim = 1;
  using States = std::tuple<SE3, R3>;
  void operator()(const SE3& x, const R3& p, Vector<1>& r, Matrix<1, 6>* Jx = nullptr,
                  Matrix<1, 3>* Jp = nullptr) const {
    const Vector<3> d = p.vector() - x.translation();
    r[0] = d.squaredNorm();
    if (Jx) *Jx << -2.0 * d.transpose() * x.rotation().matrix(), Matrix<1, 3>::Zero();
    if (Jp) *Jp = 2.0 * d.transpose();
  }
};
static_assert(Residual<SquaredDistance>);

TEST(ResidualConcept, AcceptsUserDefinedResidual) {
  const JacobianReport report = check_jacobians_at_random(SquaredDistance{}, 1, 40);
  EXPECT_LE(report.relative, 1e-9) << report.text;
  expect_correct(check_jacobians(SquaredDistance{}, SE3::Exp(tangent<SE3>(0.4, 2.0)), R3(Vector<3>(1.0, 2.0, 3.0))));
}

struct NoName {
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  void operator()(const R3&, Vector<1>&, Matrix<1, 3>* = nullptr) const {}
};
struct NoRows : NoName {
  static constexpr std::string_view name = "no rows";
  static constexpr int dim = 0;
};
struct NoStates {
  static constexpr std::string_view name = "no states";
  static constexpr int dim = 1;
  void operator()(const R3&, Vector<1>&, Matrix<1, 3>* = nullptr) const {}
};
struct StatesAreNotATuple : NoName {
  static constexpr std::string_view name = "states are not a tuple";
  using States = R3;
};
struct StateIsNoGroup : NoName {
  [[maybe_unused]] static constexpr std::string_view name = "state is no group";
  using States = std::tuple<double>;
  void operator()(double, Vector<1>&, Matrix<1, 1>* = nullptr) const {}
};
struct OtherStates : NoName {
  static constexpr std::string_view name = "other states";
  using States = std::tuple<SE3>;
};
struct WrongRows : NoName {
  static constexpr std::string_view name = "wrong rows";
  static constexpr int dim = 2;
};
struct WrongJacobian {
  static constexpr std::string_view name = "wrong Jacobian";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  void operator()(const R3&, Vector<1>&, Matrix<1, 6>* = nullptr) const {}
};
struct NoJacobian {
  static constexpr std::string_view name = "no Jacobian";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  void operator()(const R3&, Vector<1>&) const {}
};
struct NotConst {
  static constexpr std::string_view name = "not const";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  void operator()(const R3&, Vector<1>&, Matrix<1, 3>* = nullptr) {}
};
struct ChangesItsState {
  static constexpr std::string_view name = "changes its state";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  void operator()(R3&, Vector<1>&, Matrix<1, 3>* = nullptr) const {}
};
static_assert(!Residual<NoName> && !Residual<NoRows> && !Residual<NoStates> && !Residual<StatesAreNotATuple>);
static_assert(!Residual<OtherStates> && !Residual<WrongRows> && !Residual<WrongJacobian>);
static_assert(!Residual<StateIsNoGroup>);
static_assert(!Residual<NoJacobian> && !Residual<NotConst> && !Residual<ChangesItsState>);
static_assert(!Residual<int> && !Residual<SE3>);

}  // namespace
}  // namespace tandem::testing

#include <memory>
#include <vector>

#include <Eigen/Core>
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
#include <tandem/residuals/dvl_preintegrator.hpp>
#include <tandem/residuals/dvl_velocity.hpp>
#include <tandem/residuals/gps.hpp>
#include <tandem/residuals/heading.hpp>
#include <tandem/residuals/imu_preintegration.hpp>
#include <tandem/residuals/interpolated.hpp>
#include <tandem/residuals/loss.hpp>
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
#include <tandem/residuals/testing.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/residuals/usbl_spherical.hpp>
#include <tandem/residuals/white_noise_acceleration.hpp>

#include "allocations.hpp"
#include "residuals/imu_cases.hpp"

namespace tandem::testing {
namespace {

/// Returns the number of heap allocations in evaluations of the residual at random states, with all Jacobians and with
/// none.
template <class R>
long allocations_of(const R& residual) {
  long count = 0;
  std::mt19937_64 random(1);
  for (int i = 0; i < 8; ++i) {
    const auto states = random_states<typename R::States>(random, StateDistance(i % 4));
    std::apply(
        [&]<class... Xs>(const Xs&... x) {
          Vector<R::dim> r;
          std::tuple<RowsBy<R::dim, Xs>...> J;
          std::apply(
              [&](auto&... M) {
                const long before = allocations;
                residual(x..., r);
                residual(x..., r, &M...);
                count += allocations - before;
              },
              J);
        },
        states);
  }
  return count;
}

void* volatile kept;  // prevents the compiler from removing allocations

TEST(NoAllocation, CounterDetectsAllocations) {
  const auto counted = [](auto allocate) {
    const long before = allocations;
    allocate();
    return allocations - before;
  };
  EXPECT_GE(counted([] {
              auto p = std::make_unique<int>(1);
              kept = p.get();
            }),
            1);
  EXPECT_GE(counted([] {
              std::vector<double> v(100);
              kept = v.data();
            }),
            1);
  EXPECT_GE(counted([] {
              Eigen::MatrixXd M = Eigen::MatrixXd::Ones(6, 6);
              kept = M.data();
            }),
            1);
  EXPECT_EQ(counted([] {
              Matrix<6, 6> M = Matrix<6, 6>::Ones();
              kept = M.data();
            }),
            0);
}

/// A residual that allocates because it uses dynamic matrices.
struct Dynamic {
  [[maybe_unused]] static constexpr std::string_view name = "dynamic";
  static constexpr int dim = 3;
  using States = std::tuple<R3>;
  void operator()(const R3& x, Vector<3>& r, Matrix<3, 3>* J = nullptr) const {
    const Eigen::MatrixXd M = 2.0 * Eigen::MatrixXd::Identity(3, 3);
    r = M * x.vector();
    if (J) *J = M;
  }
};

TEST(NoAllocation, DetectsAllocatingResidual) { EXPECT_GE(allocations_of(Dynamic{}), 16); }

TEST(NoAllocation, Priors) {
  EXPECT_EQ(allocations_of(Prior<SE3>{}), 0);
  EXPECT_EQ(allocations_of(Prior<SE2>{}), 0);
  EXPECT_EQ(allocations_of(Prior<Rn<6>>{}), 0);
}

TEST(NoAllocation, Measurements) {
  EXPECT_EQ(allocations_of(RelativePose<>{}), 0);
  EXPECT_EQ(allocations_of(RelativePose<SE2>{}), 0);
  EXPECT_EQ(allocations_of(UsblPosition<>{Vector<3>(1.0, 2.0, 3.0)}), 0);
  EXPECT_EQ((allocations_of(UsblPosition<SE3, R3>{Vector<3>(1.0, 2.0, 3.0)})), 0);
  EXPECT_EQ((allocations_of(UsblPosition<SE2, R2>{Vector<2>(1.0, 2.0)})), 0);
  const SE3 B(SO3(), Vector<3>(1.0, 2.0, 3.0));  // off the centre, so that bearings at states near 0 are defined
  const SE2 planar(SO2(), Vector<2>(1.0, 2.0));
  const Direction<3> ahead(0.3, 0.1);
  EXPECT_EQ(allocations_of(RangeBearing<>{9.0, ahead, B}), 0);
  EXPECT_EQ((allocations_of(RangeBearing<SE2, R2>{9.0, 0.3, planar})), 0);
  EXPECT_EQ(allocations_of(Range<>{9.0, B}), 0);
  EXPECT_EQ(allocations_of(Bearing<>{ahead, B}), 0);
  EXPECT_EQ((allocations_of(UsblSpherical<SE3, R3>{9.0, 0.3, 0.1, B})), 0);
  EXPECT_EQ(allocations_of(RelativeRotation<>{}), 0);
  EXPECT_EQ(allocations_of(Interpolated{RelativePose<>{}, 0.3}), 0);
  EXPECT_EQ((allocations_of(Interpolated{UsblSpherical<SE3, R3>{9.0, 0.3, 0.1, B}, 0.3})), 0);
  EXPECT_EQ(allocations_of(RollPitch<>{}), 0);
  EXPECT_EQ(allocations_of(RollPitch<SO3>{}), 0);
}

TEST(NoAllocation, MotionModels) {
  EXPECT_EQ(allocations_of(ConstantTwist<SE3>{1.0, 0.6}), 0);
  EXPECT_EQ(allocations_of(ConstantTwist<SE2>{1.0, 0.6}), 0);
  EXPECT_EQ(allocations_of(ConstantTwist<R3>{1.0, 0.6}), 0);
  EXPECT_EQ(allocations_of(ConstantTwist<SE23>{1.0, 0.6}), 0);
  EXPECT_EQ((allocations_of(ConstantTwist<Bundle<SE23, Rn<6>>>{1.0, 0.6})), 0);
  EXPECT_EQ(allocations_of(DampedTwist<SE3>::over(1.0, 0.6, Vector<6>::Constant(5.0))), 0);
  EXPECT_EQ(allocations_of(WhiteNoiseAcceleration<SE3>{0.6}), 0);
  EXPECT_EQ((allocations_of(WhiteNoiseAcceleration<Bundle<SE2, R3>>{0.6})), 0);
  EXPECT_EQ((allocations_of(MixedVelocity<SE3, R3, SE3>::constant(1.0, 0.6))), 0);
  EXPECT_EQ(allocations_of(Boundary<>{}), 0);
  EXPECT_EQ((allocations_of(TwistComponents<SE3, sway | heave>{0.5})), 0);
  EXPECT_EQ((allocations_of(TwistComponents<SE2, surge | yaw_rate>{0.5})), 0);
  EXPECT_EQ(allocations_of(SoftBound{TwistComponents<SE3, surge | yaw_rate>{0.5}, between(0.0, 2.5)}), 0);
}

TEST(NoAllocation, EgoSensors) {
  const Vector<3> some(1.0, 2.0, 3.0);
  EXPECT_EQ(allocations_of(Depth{1.0, some}), 0);
  EXPECT_EQ(allocations_of(Gps{some, some}), 0);
  EXPECT_EQ(allocations_of(Heading{}), 0);
  EXPECT_EQ(allocations_of(DvlVelocity{some}), 0);
  EXPECT_EQ(allocations_of(ScaledDvlVelocity{some}), 0);
  EXPECT_EQ(allocations_of(PreintegratedDvl{some}), 0);
  EXPECT_EQ(allocations_of(Coasting{0.6}), 0);
  EXPECT_EQ(allocations_of(PreintegratedImu{some_delta(), Earth::at_latitude(0.7, 9.81)}), 0);
  EXPECT_EQ(allocations_of(Propagated{Depth{1.0, some}, some_delta()}), 0);
  EXPECT_EQ(allocations_of(Propagated{DvlVelocity{some}, some_delta()}), 0);
  EXPECT_EQ(allocations_of(Propagated{ScaledDvlVelocity{some}, some_delta()}), 0);
  EXPECT_EQ(allocations_of(MiscalibratedEgo<DvlVelocity>{{some}}), 0);
  EXPECT_EQ(allocations_of(Miscalibrated<UsblPosition<>>{{some}}), 0);
  EXPECT_EQ(allocations_of(Propagated{UsblPosition<>{some}, some_delta()}), 0);
}

TEST(NoAllocation, Preintegration) {
  const auto readings = random_readings(1, 20, 0.01);
  const long before = allocations;
  ImuPreintegrator sum(tilted_mount(), some_noise(), some_bias());
  add(sum, readings);
  const double trace = sum.covariance().trace();
  DvlPreintegrator dvl(DvlReading{Vector<3>(1.0, 0.0, 0.0), Vector<3>::Constant(0.01)}, 1e-4);
  dvl.advance(Vector<3>(0.0, 0.0, 0.1), 0.5);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(trace * dvl.dt(), 0.0);
}

TEST(NoAllocation, Losses) {
  double sum = 0.0;
  const long before = allocations;
  for (const Loss& loss : {Huber(1.0), Cauchy(1.0), GemanMcClure(1.0), Tukey(1.0)}) sum += loss(2.0).rho;
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(sum, 0.0);
}

}  // namespace
}  // namespace tandem::testing

// Worked example of docs/contributing.md, "A new target sensor": the target transmits its depth by acoustic modem; the
// file has its height relative to the chaser.

#include <gtest/gtest.h>

#include <tandem/problem/tracking/sensor_build.hpp>
#include <tandem/residuals/testing.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>

namespace tandem {

// [residual]
/// Measured height of the target above the chaser [m]:  e = (t(T) − t(C))·e_z − z.
/// States: the chaser's pose; the target's pose, or a point.
template <LieGroup Target = SE3>
struct RelativeHeight {
  static constexpr std::string_view name = "relative height";
  static constexpr int dim = 1;
  using States = std::tuple<SE3, Target>;

  double z;  ///< height of the target above the chaser [m]

  void operator()(const SE3& c, const Target& t, Vector<1>& r, Matrix<1, 6>* Jc = nullptr,
                  Matrix<1, Target::dof>* Jt = nullptr) const {
    if (Jc) *Jc << -c.rotation().matrix().row(2), Matrix<1, 3>::Zero();
    if constexpr (std::same_as<Target, SE3>) {
      r[0] = t.translation().z() - c.translation().z() - z;
      if (Jt) *Jt << t.rotation().matrix().row(2), Matrix<1, 3>::Zero();
    } else {
      r[0] = t.vector().z() - c.translation().z() - z;
      if (Jt) *Jt = Vector<3>::UnitZ().transpose();
    }
  }
};
// [residual]

// [placement]
struct PlaceRelativeHeight {
  template <LieGroup G, LieGroup T>
  static RelativeHeight<T> residual(const Measurement& m, const G& /*mount*/, const Vector<3>& /*beacon*/) {
    return {m.height};
  }
};
// [placement]

// [traits]
constexpr SensorTraits kRelativeHeight{"relative_height", measured::height,
                                       detail::placed_in_space_by<PlaceRelativeHeight>};
// [traits]

namespace {

TEST(ExtendingTargetSensor, ResidualHasCorrectJacobians) {
  EXPECT_LE(check_jacobians_at_random(RelativeHeight<SE3>{1.5}, 1, 20).relative, 1e-6);
  EXPECT_LE(check_jacobians_at_random(RelativeHeight<R3>{1.5}, 1, 20).relative, 1e-6);
}

TEST(ExtendingTargetSensor, RowsAreRead) {
  EXPECT_EQ(columns(kRelativeHeight, false), "t,z");
  EXPECT_EQ(rows(kRelativeHeight, false), 1);
  EXPECT_EQ(rows(kRelativeHeight, true), 0) << "not supported in the plane";
  const double row[] = {12.5, -3.0};
  const Measurement m = target_measurement(kRelativeHeight, row, Frame::ned_frd(), false);
  EXPECT_EQ(m.t, 12.5);
  EXPECT_EQ(m.height, 3.0) << "z points down in NED-FRD files";
}

/// The fixes have a height error of 2 m, and the modem gives the correct height.
TEST(ExtendingTargetSensor, SensorJoinsAProblem) {
  TrackingData data;
  data.noise.prior = data.noise.odometry = data.noise.constant_twist = Vector<6>::Constant(0.01);
  for (int i = 0; i <= 10; ++i) data.odometry.push_back({double(i), SE3(SO3(), Vector<3>(i, 0, -30))});
  TargetSensor usbl{.name = "usbl", .type = SensorType::position, .sigma = Vector<3>::Constant(1.0)};
  TargetSensor modem{.name = "modem", .type = kRelativeHeight, .sigma = Eigen::VectorXd::Constant(1, 0.01)};
  for (int i = 0; i <= 10; ++i) {
    usbl.measurements.push_back({.t = double(i), .position = Vector<3>(20, 5, 12)});
    modem.measurements.push_back({.t = i + 0.25, .height = 10});
  }
  modem.measurements.pop_back();
  data.sensors = {usbl, modem};
  TrackingProblem tracking = make_tracking_problem(data);
  EXPECT_EQ(tracking.measurements.size(), 11u + 10u);
  ASSERT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
  EXPECT_NEAR(tracking.target_state(5).position.z(), -20, 0.1);
}

}  // namespace
}  // namespace tandem

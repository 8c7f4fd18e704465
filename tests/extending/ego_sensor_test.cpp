// Worked example of docs/contributing.md, "A new sensor of the chaser": an inclinometer, which measures the direction
// of the vertical.

#include <gtest/gtest.h>

#include <tandem/problem/navigation/ego_placement.hpp>
#include <tandem/problem/navigation/navigation_problem.hpp>
#include <tandem/residuals/testing.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>

#include "problem/tracking/level_turn.hpp"

namespace tandem {

// [residual]
/// Measured vertical (upwards) along the body axes:  e = Rᵀ e_z − z.   States: the pose.
struct Inclination {
  static constexpr std::string_view name = "inclination";
  static constexpr int dim = 3;
  using States = std::tuple<SE3>;

  Vector<3> up;  ///< unit vector along the body axes

  void operator()(const SE3& x, Vector<3>& r, Matrix<3, 6>* J = nullptr) const {
    const Vector<3> expected = x.rotation().inverse().act(Vector<3>(Vector<3>::UnitZ()));
    r = expected - up;
    if (J) *J << Matrix<3, 3>::Zero(), skew(expected);
  }
};
// [residual]

// [placement]
Block place_inclination(const detail::EgoPlacing& at, const EgoMeasurement& m) {
  return detail::place(at, Inclination{m.value});
}
// [placement]

// [traits]
EgoMeasurement ideal_inclination(const EgoSensor&, double t, const SE3& pose, const Vector<3>& /*velocity*/) {
  return {t, pose.rotation().inverse().act(Vector<3>(Vector<3>::UnitZ()))};
}

constexpr EgoSensorTraits kInclinometer{"inclinometer",
                                        "t,ux,uy,uz",
                                        EgoReading::body_vector,
                                        EgoMounting::none,
                                        1.5,
                                        "length of the vertical",
                                        "",
                                        "but must be 1; divide the readings by gravity",
                                        false,
                                        ideal_inclination,
                                        place_inclination};
// [traits]

namespace {

TEST(ExtendingEgoSensor, ResidualHasCorrectJacobians) {
  EXPECT_LE(check_jacobians_at_random(Inclination{Vector<3>(0.1, 0.2, 0.9)}, 1, 20).relative, 1e-6);
}

TEST(ExtendingEgoSensor, RowsAreReadAndWritten) {
  EXPECT_EQ(columns(kInclinometer), "t,ux,uy,uz");
  const double row[] = {2.0, 0.1, 0.2, -0.9};
  const EgoMeasurement m = ego_measurement(kInclinometer, row, Frame::ned_frd());
  EXPECT_EQ(m.value, Vector<3>(0.1, -0.2, 0.9));
  EXPECT_EQ(numbers(kInclinometer, m), Eigen::VectorXd(m.value));
}

/// The inclinometer corrects a tilted initial guess. Without it or a heading sensor, the tilt would be less accurate.
TEST(ExtendingEgoSensor, SensorJoinsAProblem) {
  testing::LevelTurn turn;
  turn.duration = 5;
  NavigationData data = turn.data();
  std::erase_if(data.sensors, [](const EgoSensor& s) { return s.type != EgoSensorType::dvl; });
  EgoSensor inclinometer = testing::LevelTurn::sensor(kInclinometer, Vector<3>::Constant(1e-4));
  for (double t = 0.25; t < turn.duration; t += 0.5) inclinometer.measurements.push_back(turn.measure(inclinometer, t));
  data.sensors.push_back(inclinometer);
  EXPECT_EQ(inclinometer.name, "inclinometer");
  NavigationProblem problem = make_navigation_problem(data, turn.guess(), turn.start());
  ASSERT_TRUE(solve(problem.problem, GaussNewtonOptions{}).converged());
  EXPECT_EQ(problem.num_discarded, (std::vector<std::size_t>{0, 0}));
  EXPECT_LE(turn.largest_error(problem), 1e-4);
}

}  // namespace
}  // namespace tandem

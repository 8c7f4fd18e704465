#include <numbers>

#include <gtest/gtest.h>

#include <tandem/studies/estimation/turned_detections.hpp>

namespace tandem::testing {
namespace {

/// Returns the data of a camera that measures the pose of a target ahead, with these headings [rad], once per second.
TrackingData seen_at(const std::vector<double>& headings) {
  TrackingData data;
  data.noise.prior = data.noise.odometry = data.noise.constant_twist = Vector<6>::Constant(0.1);
  data.noise.roll_pitch = Vector<2>::Constant(0.1);
  TargetSensor camera{.name = "camera", .type = SensorType::pose, .sigma = Vector<6>::Constant(0.1)};
  for (std::size_t k = 0; k < headings.size(); ++k) {
    data.odometry.push_back({double(k), SE3(SO3::Exp({0, 0, 0.4 * double(k)}), Vector<3>::Zero())});
    camera.measurements.push_back(
        {.t = double(k), .position = Vector<3>(10, 0, 0), .rotation = SO3::Exp({0, 0, headings[k] - 0.4 * double(k)})});
  }
  data.sensors = {camera};
  return data;
}

std::string turned(const TrackingData& data) { return turned_detections(data, make_tracking_problem(data)); }

TEST(TurnedDetections, AreReportedWithTheirTimes) {
  const double turn = std::numbers::pi;
  EXPECT_EQ(turned(seen_at({0.0, 0.5, 1.0, 1.5, 2.0})), "");
  EXPECT_EQ(turned(seen_at({0.0, 0.1, 0.2 - turn, 0.3})), "camera turns by 174 deg between 1.0 s and 2.0 s");
}

TEST(TurnedDetections, IgnoreHeldOutMeasurements) {
  TrackingData data = seen_at({0.0, 0.1, 0.2 + std::numbers::pi, 0.3});
  data.sensors[0].measurements[2].held_out = true;
  EXPECT_EQ(turned(data), "");
}

}  // namespace
}  // namespace tandem::testing

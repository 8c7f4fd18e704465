#include <gtest/gtest.h>

#include <tandem/problem/navigation/trajectory.hpp>

namespace tandem {
namespace {

TEST(Trajectory, InterpolatesPose) {
  const SO3 quarter = SO3::Exp({0, 0, 1.5});
  const std::vector<Stamped<SE3>> trajectory = {{1.0, SE3(SO3(), Vector<3>(1, 0, 0))},
                                                {2.0, SE3(SO3(), Vector<3>(3, 0, 0))},
                                                {4.0, SE3(quarter, Vector<3>(3, 0, 0))}};
  EXPECT_TRUE(pose_at(trajectory, 1.25)->translation().isApprox(Vector<3>(1.5, 0, 0), 1e-12));
  EXPECT_EQ(pose_at(trajectory, 2.0)->translation(), Vector<3>(3, 0, 0));
  EXPECT_TRUE(pose_at(trajectory, 3.0)->rotation().Log().isApprox(Vector<3>(0, 0, 0.75), 1e-12));
  EXPECT_EQ(pose_at(trajectory, 0.9995)->translation(), Vector<3>(1, 0, 0));
  EXPECT_TRUE(pose_at(trajectory, 4.0005)->rotation().Log().isApprox(Vector<3>(0, 0, 1.5), 1e-12));
  EXPECT_FALSE(pose_at(trajectory, 0.99));
  EXPECT_FALSE(pose_at(trajectory, 4.01));
  EXPECT_FALSE(pose_at({}, 1.0));
}

}  // namespace
}  // namespace tandem

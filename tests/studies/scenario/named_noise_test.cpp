#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/scenario/named_noise.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::StartsWith;

TrackingData data_with_usbl() {
  TrackingData data;
  data.sensors.push_back({.name = "usbl", .sigma = Vector<3>::Zero()});
  return data;
}

std::string error(const std::string& assignment) {
  TrackingData data = data_with_usbl();
  return error_of([&] { override_noise(data, assignment); });
}

TEST(NamedNoise, Overrides) {
  TrackingData data = data_with_usbl();
  override_noise(data, "usbl=1, 2,3");
  override_noise(data, "surge=0.5");
  override_noise(data, "odometry=1,2,3,4,5,6");
  EXPECT_EQ(data.sensors[0].sigma, Vector<3>(1, 2, 3));
  EXPECT_EQ(data.noise.surge, 0.5);
  EXPECT_EQ(data.noise.odometry[5], 6.0);
}

TEST(NamedNoise, SaysWhatIsWrong) {
  EXPECT_EQ(error("usbl"), "--noise takes NAME=v,v,…, not 'usbl'");
  EXPECT_EQ(error("usbl=1,x,3"), "--noise usbl: 'x' is not a number");
  EXPECT_EQ(error("usbl=1,2"), "--noise usbl needs 3 standard deviations, not 2");
  EXPECT_EQ(error("usbl=1,2,0"), "--noise usbl has the standard deviation 0; it must be above zero and finite");
  EXPECT_EQ(error("usbl=1,2,nan"), "--noise usbl has the standard deviation nan; it must be above zero and finite");
  EXPECT_THAT(error("odometri=1"), StartsWith("--noise knows no 'odometri'; did you mean odometry? (here it takes"));
  EXPECT_THAT(error("optical=1,1,1,1,1,1"), StartsWith("--noise knows no 'optical'")) << "this data has no such sensor";
}

}  // namespace
}  // namespace tandem

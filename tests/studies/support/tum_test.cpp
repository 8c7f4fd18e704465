#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/scenario/table.hpp>
#include <tandem/studies/support/tum.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

const SE3 kPose(SO3::Exp({0, 0, 1}), Vector<3>(1.0 / 3.0, -2, 3e5));

TEST(Tum, RoundTripsExactly) {
  const ScratchFolder folder;
  const auto file = folder.write("a.tum", tum_header + tum_row(0.1, kPose) + tum_row(1.0 / 3.0, SE3()));
  const auto read = poses(read_tum(file));
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].t, 0.1);
  EXPECT_EQ(read[0].value.translation(), kPose.translation());
  EXPECT_LE((read[0].value.inverse() * kPose).Log().norm(), 1e-15);
  EXPECT_EQ(read[1].t, 1.0 / 3.0);
}

TEST(Tum, MarksPosesWithoutOrientation) {
  EXPECT_EQ(tum_row(1, Vector<3>(2, 3, 4), {}), "# no orientation\n1 2 3 4 0 0 0 1\n");
}

TEST(Tum, UsesGivenDecimals) {
  EXPECT_EQ(tum_row(0.25, kPose, TumDecimals{3, 2, 4}), "0.250 0.33 -2.00 300000.00 0.0000 0.0000 0.4794 0.8776\n");
}

}  // namespace
}  // namespace tandem

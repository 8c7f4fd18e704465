#include <gtest/gtest.h>

#include <tandem/studies/online/reset_notice.hpp>

namespace tandem::testing {
namespace {

TEST(ResetNotice, NamesHardConstraintsThatMayBeTheReason) {
  TrackingOptions target{.roll_pitch = Role::soft, .surge = Bounds<1>{Vector<1>(0.0), Vector<1>(0.2)}};
  target.limits = Role::hard;
  const TrackReset contradicted{TrackReset::Kind::contradicted, 3.0, "usbl contradicts the estimate"};
  EXPECT_EQ(reset_notice(contradicted, target),
            "usbl contradicts the estimate; the track is reset; if the target does not satisfy --surge, use soft "
            "constraints");
  target.roll_pitch = target.non_holonomic = Role::hard;
  EXPECT_EQ(hard_options(target), "--non-holonomic hard, --roll-pitch hard and --surge");
  target = {};
  EXPECT_EQ(reset_notice(contradicted, target), "usbl contradicts the estimate; the track is reset");
}

}  // namespace
}  // namespace tandem::testing

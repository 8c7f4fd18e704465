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

TEST(ResetNotice, NamesTheComponentThatHasShifted) {
  const InnovationShift shift{2, 214.21, -4.46};
  EXPECT_EQ(shift_notice("usbl", {"x", "y", "z"}, shift, "optical"),
            "z of usbl has shifted by -4.5 standard deviations since 214.2 s: it or a sensor that contradicts it "
            "(optical) is wrong");
  EXPECT_EQ(shift_notice("gps", {}, shift, ""),
            "gps has shifted by -4.5 standard deviations since 214.2 s: no other sensor measures the same");
}

}  // namespace
}  // namespace tandem::testing

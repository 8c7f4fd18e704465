#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/support/limited_complaints.hpp>

namespace tandem {
namespace {

TEST(LimitedComplaints, AMillionAreADozenOrTwo) {
  std::vector<std::string> told;
  LimitedComplaints complain("lines", [&](const std::string& sentence) { told.push_back(sentence); });
  for (int i = 0; i < 1'000'000; ++i) complain("wrong");
  ASSERT_EQ(told.size(), 16u);
  EXPECT_EQ(told[9], "wrong");
  EXPECT_THAT(told[10], testing::StartsWith("10 lines so far"));
  EXPECT_THAT(told.back(), testing::StartsWith("1000000 lines so far"));
}

}  // namespace
}  // namespace tandem

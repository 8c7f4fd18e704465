#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/support/limited_warnings.hpp>

namespace tandem {
namespace {

TEST(LimitedWarnings, PrintsFirstTenThenTotals) {
  std::vector<std::string> printed;
  LimitedWarnings warn("lines", [&](const std::string& sentence) { printed.push_back(sentence); });
  for (int i = 0; i < 1'000'000; ++i) warn("wrong");
  ASSERT_EQ(printed.size(), 16u);
  EXPECT_EQ(printed[9], "wrong");
  EXPECT_EQ(printed[10], "10 lines so far; the total is printed next at 100");
  EXPECT_THAT(printed.back(), testing::StartsWith("1000000 lines so far"));
}

}  // namespace
}  // namespace tandem

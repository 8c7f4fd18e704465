#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

using testing::ElementsAre;

TEST(Text, NumbersAreTakenWhole) {
  EXPECT_EQ(parse_number("1.5e-3"), 1.5e-3);
  EXPECT_EQ(parse_number("+2"), 2.0);
  EXPECT_EQ(parse_number("-inf"), -HUGE_VAL);
  EXPECT_TRUE(std::isnan(parse_number("nan").value()));
  for (const char* none : {"", "1.5x", "x", "1 2", "+-1", "0x10", "1,5"}) EXPECT_FALSE(parse_number(none)) << none;
}

TEST(Text, CountsAreAboveZero) {
  EXPECT_EQ(parse_count("17"), 17);
  for (const char* none : {"", "0", "-3", "1.5", "99999999999"}) EXPECT_FALSE(parse_count(none)) << none;
}

TEST(Text, SplitKeepsEmptyPartsAndWordsDoNot) {
  EXPECT_THAT(split(" a, b ,,c\r", ','), ElementsAre("a", "b", "", "c"));
  EXPECT_THAT(split("", ','), ElementsAre(""));
  EXPECT_THAT(words("  a\tb  c "), ElementsAre("a", "b", "c"));
  EXPECT_THAT(words(" "), ElementsAre());
}

TEST(Text, QuoteIsShortAndPrintable) {
  EXPECT_EQ(quote("a\x1b[31m"), "'a?[31m'");
  EXPECT_EQ(quote(std::string(50, 'x')), "'" + std::string(40, 'x') + "…'");
}

TEST(Text, ListsReadLikeProse) {
  EXPECT_EQ(listed({}), "");
  EXPECT_EQ(listed({"a"}), "a");
  EXPECT_EQ(listed({"a", "b", "c"}, "or"), "a, b or c");
}

TEST(Text, NearWordsAreNamed) {
  const std::vector<std::string> known = {"keyframe_interval", "noise", "sensors"};
  EXPECT_EQ(did_you_mean("nosie", known), "; did you mean noise?");
  EXPECT_EQ(did_you_mean("nois", known), "; did you mean noise?");
  EXPECT_EQ(did_you_mean("KeyframeInterval", known), "; did you mean keyframe_interval?");
  EXPECT_EQ(did_you_mean("licence", known), "");
}

}  // namespace
}  // namespace tandem

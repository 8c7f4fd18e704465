#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

using testing::ElementsAre;

TEST(Text, ParsesNumbers) {
  EXPECT_EQ(parse_number("1.5e-3"), 1.5e-3);
  EXPECT_EQ(parse_number("+2"), 2.0);
  EXPECT_EQ(parse_number("-inf"), -HUGE_VAL);
  EXPECT_TRUE(std::isnan(parse_number("nan").value()));
  for (const char* none : {"", "1.5x", "x", "1 2", "+-1", "0x10", "1,5"}) EXPECT_FALSE(parse_number(none)) << none;
}

TEST(Text, ParsesPositiveIntegers) {
  EXPECT_EQ(parse_positive_integer("17"), 17);
  for (const char* none : {"", "0", "-3", "1.5", "99999999999"}) EXPECT_FALSE(parse_positive_integer(none)) << none;
}

TEST(Text, SplitKeepsEmptyPartsAndWordsDoNot) {
  EXPECT_THAT(split(" a, b ,,c\r", ','), ElementsAre("a", "b", "", "c"));
  EXPECT_THAT(split("", ','), ElementsAre(""));
  EXPECT_THAT(words("  a\tb  c "), ElementsAre("a", "b", "c"));
  EXPECT_THAT(words(" "), ElementsAre());
}

TEST(Text, QuoteIsShortAndPrintable) {
  EXPECT_EQ(quote("a\x1b[31m"), "'a\\x1b[31m'");
  EXPECT_EQ(quote(std::string(50, 'x')), "'" + std::string(40, 'x') + "…'");
  EXPECT_EQ(quote(std::string(39, 'x') + "é"), "'" + std::string(39, 'x') + "…'") << "cut between characters";
}

TEST(Text, EscapesControlCharacters) {
  for (const char* same : {"", "plain", "±3 σ, 12°, 水, 🛥", "a 'quoted' \\x1b"})
    EXPECT_EQ(printable(same), same);
  EXPECT_EQ(printable(std::string("a\0\n\t\x7f", 5)), "a\\x00\\x0a\\x09\\x7f");
  EXPECT_EQ(printable("\x1b]0;title\x07\x1b[2J"), "\\x1b]0;title\\x07\\x1b[2J");
  EXPECT_EQ(printable("\x9b"
                      "2J"),
            "\\x9b2J")
      << "CSI as one byte";
  EXPECT_EQ(printable("\xc2\x9b"
                      "2J"),
            "\\xc2\\x9b2J")
      << "CSI as UTF-8";
  EXPECT_EQ(printable("\xe2\x80\xae"
                      "abc"),
            "\\xe2\\x80\\xae"
            "abc")
      << "changes the writing direction";
  EXPECT_EQ(printable("\xff\xc3"), "\\xff\\xc3") << "invalid UTF-8, and a truncated character";
  EXPECT_EQ(printable("\xc0\x9b\xe0\x82\x9b\xed\xa0\x80"), "\\xc0\\x9b\\xe0\\x82\\x9b\\xed\\xa0\\x80")
      << "overlong codes, and a surrogate";
}

TEST(Text, WrapsLongLines) {
  EXPECT_EQ(wrapped("short\nlines", 5), "short\nlines");
  EXPECT_EQ(wrapped("a line of seven words, wrapped", 10), "a line of\nseven\nwords,\nwrapped");
  EXPECT_EQ(wrapped("ab  °°°° °°°° °°°°", 13, 4), "ab  °°°° °°°°\n    °°°°") << "characters, not bytes";
  EXPECT_EQ(wrapped("unbreakable and more", 4), "unbreakable\nand\nmore");
}

TEST(Text, ListsWordsAsProse) {
  EXPECT_EQ(listed({}), "");
  EXPECT_EQ(listed({"a"}), "a");
  EXPECT_EQ(listed({"a", "b", "c"}, "or"), "a, b or c");
}

TEST(Text, LowersLettersOnly) {
  EXPECT_EQ(lower_case("Map_ENU/7 \u00c4"), "map_enu/7 \u00c4");
  EXPECT_EQ(lower_case(""), "");
}

TEST(Text, SuggestsSimilarWords) {
  const std::vector<std::string> known = {"keyframe_interval", "noise", "sensors"};
  EXPECT_EQ(did_you_mean("nosie", known), "; did you mean noise?");
  EXPECT_EQ(did_you_mean("nois", known), "; did you mean noise?");
  EXPECT_EQ(did_you_mean("KeyframeInterval", known), "; did you mean keyframe_interval?");
  EXPECT_EQ(did_you_mean("licence", known), "");
}

}  // namespace
}  // namespace tandem

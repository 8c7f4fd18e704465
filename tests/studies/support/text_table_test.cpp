#include <gtest/gtest.h>

#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

using Align = TextTable::Align;

TEST(TextTable, AlignsByCharactersNotBytes) {
  TextTable table({{"name", Align::left}, {"angle [°]"}, {"n"}});
  table.row({"é", "1.5", "10"});
  table.row({"longer", "–", "2"});
  EXPECT_EQ(table.str(),
            "name    angle [°]   n\n"
            "é             1.5  10\n"
            "longer          –   2\n");
}

TEST(TextTable, TextSpansRemainingColumns) {
  TextTable table({{"name", Align::left}, {"a"}, {"b"}});
  table.row({"x"}, "a reason that is long");
  table.row({"y", "1", "2"});
  EXPECT_EQ(table.str(), "name  a  b\nx     a reason that is long\ny     1  2\n");
}

TEST(TextTable, GroupHeadsAreAboveTheirColumns) {
  TextTable table({{"name", Align::left}, {"aaaa"}, {"bbbb"}, {"c"}});
  table.group(1, 2, "two");
  table.group(3, 3, "wide");
  table.row({"x", "1", "2", "3"});
  EXPECT_EQ(table.str(),
            "      ── two ───   wide\n"
            "name  aaaa  bbbb       c\n"
            "x        1     2       3\n");
}

}  // namespace
}  // namespace tandem

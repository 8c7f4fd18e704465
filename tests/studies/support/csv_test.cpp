#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/types.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {
namespace {

using testing::ElementsAre;

std::string written(const CsvCell& cell) {
  std::string text;
  cell.append_to(text);
  return text;
}

TEST(Csv, WritesCells) {
  EXPECT_EQ(written(1.0 / 3.0), "0.3333333333333333");
  EXPECT_EQ(written(3), "3");
  EXPECT_EQ(written(true), "1");
  EXPECT_EQ(written(std::size_t{7}), "7");
  EXPECT_EQ(written({}), "");
  EXPECT_EQ(written(std::optional<double>()), "");
  EXPECT_EQ(written(std::optional<bool>(false)), "0");
  EXPECT_EQ(written(CsvCell::fixed(1.0 / 3.0, 3)), "0.333");
  EXPECT_EQ(written(CsvCell::rounded(1.0 / 3.0, 4)), "0.3333");
  for (const double v : {HUGE_VAL, -HUGE_VAL, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_EQ(written(v) + written(CsvCell::fixed(v, 3)) + written(CsvCell::rounded(v, 4)), "");
}

TEST(Csv, QuotesTextsIfNecessary) {
  EXPECT_EQ(written("plain text"), "plain text");
  EXPECT_EQ(written("a,b"), "\"a,b\"");
  EXPECT_EQ(written("say \"no\""), "\"say \"\"no\"\"\"");
  EXPECT_EQ(written("two\nlines"), "\"two\nlines\"");
  EXPECT_EQ(written(" blanks "), "\" blanks \"");
}

TEST(Csv, CellsRoundTrip) {
  const std::vector<std::string> texts = {"plain", "a,b", "say \"no\"", "\"", "", " blanks ", ",", "\"\",\"", "x"};
  CsvTable<std::vector<std::string>> table;
  for (std::size_t i = 0; i < texts.size(); ++i)
    table.add("column " + std::to_string(i), "", [i](const auto& row) { return row[i]; });
  std::string line = table.row(texts);
  line.pop_back();  // the line end
  EXPECT_EQ(csv_cells(line), texts);
  EXPECT_THAT(csv_cells(" 1 , 2.5,,\"3\" , four"), ElementsAre("1", "2.5", "", "3", "four"));
}

struct Row {
  double t;
  std::optional<Vector<3>> v;
};

TEST(Csv, WritesHeaderAndRows) {
  CsvTable<Row> table;
  table.add("t", "time [s]", [](const Row& r) { return r.t; })
      .add_xyz("v{}_m", "a vector [m]", [](const Row& r) { return r.v; })
      .add_each({"1", "2"}, "n_{}", "a short one", [](const Row& r) { return Vector<1>(r.t); });
  EXPECT_EQ(table.text(std::vector<Row>{{0.5, Vector<3>(1, 2, 3)}, {1, {}}}),
            "t,vx_m,vy_m,vz_m,n_1,n_2\n0.5,1,2,3,0.5,\n1,,,,1,\n");
  EXPECT_EQ(table.describe("file.csv").columns[1], std::pair(std::string("vx_m"), std::string("a vector [m]")));
}

}  // namespace
}  // namespace tandem

// Example of docs/contributing.md, "A new output column": a column in the table of a CSV file.
#include <optional>

#include <gtest/gtest.h>

#include <tandem/studies/support/csv.hpp>

namespace tandem {
namespace {

/// Data of one row of the file.
struct DepthRow {
  double t;
  std::optional<double> depth;
};

CsvTable<DepthRow> depth_columns() {
  return CsvTable<DepthRow>()
      .add("t", "time of the keyframe [s]", [](const DepthRow& r) { return r.t; })
      .add("depth_m", "depth below the surface, empty if unknown [m]", [](const DepthRow& r) { return r.depth; });
}

TEST(Extending, OutputColumnHasNameDescriptionAndValue) {
  EXPECT_EQ(depth_columns().text(std::vector<DepthRow>{{0.5, 3.25}, {1, {}}}), "t,depth_m\n0.5,3.25\n1,\n");
  EXPECT_EQ(depth_columns().describe("depths.csv").columns.back().first, "depth_m");
}

}  // namespace
}  // namespace tandem

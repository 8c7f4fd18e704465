// docs/extending.md, "A new output column": the column of the example, added to a table as every file has one.
#include <optional>

#include <gtest/gtest.h>

#include <tandem/studies/support/csv.hpp>

namespace tandem {
namespace {

/// What a row of the file is made of.
struct DepthRow {
  double t;
  std::optional<double> depth;
};

CsvTable<DepthRow> depth_columns() {
  return CsvTable<DepthRow>()
      .add("t", "time of the keyframe [s]", [](const DepthRow& r) { return r.t; })
      .add("depth_m", "below the surface, empty where it is not known [m]", [](const DepthRow& r) { return r.depth; });
}

TEST(Extending, AColumnIsItsNameItsMeaningAndItsCell) {
  EXPECT_EQ(depth_columns().text(std::vector<DepthRow>{{0.5, 3.25}, {1, {}}}), "t,depth_m\n0.5,3.25\n1,\n");
  EXPECT_EQ(depth_columns().describe("depths.csv").columns.back().first, "depth_m");
}

}  // namespace
}  // namespace tandem

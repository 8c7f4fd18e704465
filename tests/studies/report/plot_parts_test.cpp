#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/report/plot_parts.hpp>

namespace tandem::plot {
namespace {

TEST(PlotParts, NumbersHaveFiveSignificantDigits) {
  EXPECT_EQ(numbers({1.0 / 3, 123456789, std::nan(""), -HUGE_VAL}).dump(), "[0.33333,123460000.0,null,null]");
}

/// The values 1 … 9 and 100 have the quartiles 3.25 and 7.75, the median 5.5 and whiskers to 1 and 9.
TEST(PlotParts, BoxesFollowTukey) {
  Boxes boxes{"b", "red", "pink", 0.2, {2}, {{}}, {{}}};
  for (const double v : {100, 5, 3, 1, 2, 4, 6, 7, 9, 8}) {
    boxes.values[0].push_back(v);
    boxes.labels[0].push_back("trial " + std::to_string(int(v)));
  }
  Json traces = Json::array();
  add_boxes(traces, boxes);
  ASSERT_EQ(traces.size(), 3u);
  EXPECT_EQ(traces[0]["y"].dump(), "[3.25,3.25,7.75,7.75,3.25,null]");
  EXPECT_EQ(traces[0]["x"].dump(), "[1.9,2.1,2.1,1.9,1.9,null]");
  EXPECT_EQ(traces[1]["y"].dump(), "[5.5,5.5,null,3.25,1.0,null,7.75,9.0,null]");
  EXPECT_EQ(traces[2]["y"].dump(), "[100.0]");
  EXPECT_EQ(traces[2]["text"].dump(), "[\"trial 100\"]");
}

TEST(PlotParts, CumulativeDistribution) {
  const Json trace = cumulative("c", {3, 1, 2, 2}, "red");
  EXPECT_EQ(trace["x"].dump(), "[1.0,2.0,2.0,3.0]");
  EXPECT_EQ(trace["y"].dump(), "[0.25,0.5,0.75,1.0]");
}

}  // namespace
}  // namespace tandem::plot

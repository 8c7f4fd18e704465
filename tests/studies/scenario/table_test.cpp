#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/scenario/table.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

class TableTest : public testing::Test {
 protected:
  std::string csv_error(const std::string& text) {
    const auto file = folder_.write("usbl.csv", text);
    return error_of([&] { read_csv(file, "t,x,y,z"); });
  }
  std::string tum_error(const std::string& text) {
    const auto file = folder_.write("truth.tum", text);
    return error_of([&] { poses(read_tum(file)); });
  }

  ScratchFolder folder_;
};

TEST_F(TableTest, ReadsCsv) {
  const Table table = read_csv(folder_.write("usbl.csv", "t,x,y,z\n0.5,1,-2,3e1\n# a note\n\n1.5, 4 ,5,+6"), "t,x,y,z");
  ASSERT_EQ(table.rows(), 2u);
  EXPECT_EQ(table.lines, (std::vector<int>{2, 5}));
  EXPECT_EQ(table.t(1), 1.5);
  EXPECT_THAT(table.where(1), EndsWith("usbl.csv:5"));
  EXPECT_EQ(table.values, (std::vector<double>{0.5, 1, -2, 30, 1.5, 4, 5, 6}));
}

TEST_F(TableTest, AcceptsQuotedCells) {
  const auto file = folder_.write("usbl.csv", "\"t\",x,\"y\",z\n0.5,\"1\", \"-2\" ,3\n1.5,1,2,3\n");
  EXPECT_EQ(read_csv(file, "t,x,y,z").values, (std::vector<double>{0.5, 1, -2, 3, 1.5, 1, 2, 3}));
}

TEST_F(TableTest, AcceptsWindowsFiles) {
  const auto file = folder_.write("usbl.csv", "\xEF\xBB\xBFt,x,y,z\r\n1,2,3,4\r\n\r\n2,3,4,5\r\n");
  EXPECT_EQ(read_csv(file, "t,x,y,z").lines, (std::vector<int>{2, 4}));
}

TEST_F(TableTest, ReadsTum) {
  const auto file =
      folder_.write("a.tum", "# t x y z qx qy qz qw\n0 1 2 3 0 0 0 1\n1\t1  2 3 0 0 0.70710678 0.70710678 \n");
  const auto trajectory = poses(read_tum(file));
  ASSERT_EQ(trajectory.size(), 2u);
  EXPECT_EQ(trajectory[0].value.translation(), Vector<3>(1, 2, 3));
  EXPECT_TRUE(trajectory[1].value.rotation().act(Vector<3>::UnitX()).isApprox(Vector<3>::UnitY(), 1e-12));
}

TEST_F(TableTest, AcceptsFileWithoutRows) {
  EXPECT_EQ(read_csv(folder_.write("usbl.csv", "t,x,y,z\n"), "t,x,y,z").rows(), 0u);
}

TEST_F(TableTest, RejectsMissingFile) {
  EXPECT_THAT(error_of([&] { read_tum(folder_.path() / "no.tum"); }), EndsWith("no.tum is missing"));
  EXPECT_THAT(error_of([&] { read_tum(folder_.path()); }), EndsWith("is a folder, not a file"));
}

TEST_F(TableTest, RejectsWrongHeader) {
  EXPECT_THAT(csv_error("t,x,y\n"), EndsWith("usbl.csv:1: the first line must be the header t,x,y,z, not 't,x,y'"));
  EXPECT_THAT(csv_error("# a note\n1,2,3,4\n"), HasSubstr("usbl.csv:2: the first line must be the header"));
  EXPECT_THAT(csv_error(""), EndsWith("usbl.csv:1: the header line t,x,y,z is missing"));
}

TEST_F(TableTest, RejectsWrongNumberOfColumns) {
  EXPECT_THAT(csv_error("t,x,y,z\n1,2,3,4\n2,3,4\n"), EndsWith("usbl.csv:3: expected 4 columns (t,x,y,z), found 3"));
  EXPECT_THAT(csv_error("t,x,y,z\n1,2,3,4,\n"), HasSubstr("usbl.csv:2: expected 4 columns (t,x,y,z), found 5"));
  EXPECT_THAT(tum_error("0 1 2 3 0 0 0\n"),
              HasSubstr("truth.tum:1: expected 8 columns (t x y z qx qy qz qw), found 7"));
}

TEST_F(TableTest, RejectsTextInsteadOfNumber) {
  EXPECT_THAT(csv_error("t,x,y,z\n1,2,abc,4\n"), EndsWith("usbl.csv:2: y is 'abc', not a number"));
  EXPECT_THAT(csv_error("t,x,y,z\n1,2,,4\n"), EndsWith("usbl.csv:2: y is '', not a number"));
  EXPECT_THAT(csv_error("t,x,y,z\n1,2,1e999,4\n"), EndsWith("usbl.csv:2: y is '1e999', not a number"));
  EXPECT_THAT(tum_error(std::string("0 1 2 3 0 0 \0\x01 1\n", 16)),
              HasSubstr("truth.tum:1: qz is '\\x00\\x01', not a number"));
}

TEST_F(TableTest, RejectsNonFiniteNumbers) {
  EXPECT_THAT(csv_error("t,x,y,z\n1,2,3,nan\n"), EndsWith("usbl.csv:2: z is nan; numbers must be finite"));
  EXPECT_THAT(csv_error("t,x,y,z\ninf,2,3,4\n"), EndsWith("usbl.csv:2: t is inf; numbers must be finite"));
}

TEST_F(TableTest, RejectsNonIncreasingTimes) {
  EXPECT_THAT(csv_error("t,x,y,z\n1,2,3,4\n\n1.0,2,3,4\n"), EndsWith("usbl.csv:4: time 1.0 repeats that of line 2"));
  EXPECT_THAT(csv_error("t,x,y,z\n1,2,3,4\n0.5,2,3,4\n"),
              EndsWith("usbl.csv:3: time 0.5 comes before that of line 2; lines must be in time order"));
}

TEST_F(TableTest, AcceptsRepeatedTimesIfAllowed) {
  const auto camera = [&](const std::string& text) {
    return read_csv(folder_.write("camera.csv", text), "t,bearing", TimeOrder::repeating).rows();
  };
  EXPECT_EQ(camera("t,bearing\n1,0.2\n1,0.3\n2,0.4\n"), 3u);
  EXPECT_THAT(error_of([&] { camera("t,bearing\n2,0.2\n1,0.3\n"); }), HasSubstr("camera.csv:3: time 1 comes before"));
}

/// Some loggers occasionally write a pose twice.
TEST_F(TableTest, SkipsRepeatedPose) {
  const auto file =
      folder_.write("a.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n1 1.0005 0 0 0 0 0 -1\n2 2 0 0 0 0 0 1\n");
  const auto trajectory = poses(read_tum(file));
  ASSERT_EQ(trajectory.size(), 3u);
  EXPECT_EQ(trajectory[1].value.translation().x(), 1.0);
  EXPECT_EQ(trajectory[2].t, 2.0);
  const std::string pose = "1 1 0 0 0 0 0 1\n";
  EXPECT_THAT(tum_error(pose + "1 1.002 0 0 0 0 0 1\n"),
              EndsWith("truth.tum:2: time 1 repeats that of line 1 with another pose"));
  EXPECT_THAT(tum_error(pose + "1 1 0 0 0 0 0.00999983333 0.99995\n"), HasSubstr("with another pose"));
  EXPECT_THAT(tum_error(pose + "0.5 1 0 0 0 0 0 1\n"), HasSubstr("truth.tum:2: time 0.5 comes before"));
}

TEST_F(TableTest, QuaternionsAreNormalisedOrRejected) {
  const auto file = folder_.write("a.tum", "0 0 0 0 0 0 0 1.0009\n1 0 0 0 0 0 0 0.9991\n");
  EXPECT_EQ(poses(read_tum(file))[0].value.rotation().quaternion().w(), 1.0);
  EXPECT_THAT(tum_error("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1.002\n"),
              EndsWith("truth.tum:2: quaternion 0 0 0 1.002 has norm 1.002; it must be 1 within 0.001"));
  EXPECT_THAT(tum_error("0 0 0 0 0 0 0 0\n"), HasSubstr("truth.tum:1: quaternion 0 0 0 0 has norm 0"));
}

}  // namespace
}  // namespace tandem

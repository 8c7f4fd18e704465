#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/export/export_formats.hpp>
#include <tandem/studies/import/import.hpp>

#include "studies/recording/read_rows.hpp"
#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

void export_as(const std::string& name, const ExportedRun& run, const std::filesystem::path& folder) {
  for (const ExportFormat& format : export_formats())
    if (format.name == name) format.write(run, folder);
}

/// A run in NED-FRD with a pose of the chaser and its covariance, turned by 90 degrees about the vertical.
class ExportTest : public testing::Test {
 protected:
  ExportTest() {
    std::filesystem::create_directories(out());
    const std::string pose = "1,2,3,0,0,0.70710678118654757,0.70710678118654757";
    std::string tum = "# t x y z qx qy qz qw\n", full = "t,x,y,z,qx,qy,qz,qw,vx,vy,vz,wx,wy,wz";
    for (int i = 1; i <= 6; ++i)
      for (int j = 1; j <= 6; ++j) full += ",c" + std::to_string(i) + std::to_string(j);
    full += '\n';
    for (const char* t : {"10.5", "11.5"}) {
      tum += std::string(t) + " 1 2 3 0 0 0.70710678118654757 0.70710678118654757\n";
      full += std::string(t) + "," + pose + ",0.5,0.25,0,0,0,0.1";
      for (int i = 1; i <= 6; ++i)
        for (int j = 1; j <= 6; ++j) full += i == j ? "," + std::to_string(i) : ",0";
      full += '\n';
    }
    scratch_.write("chaser.tum", tum);
    scratch_.write("chaser_full.csv", full);
    scratch_.write("summary.json", "{\"frame\": \"NED-FRD\"}");
  }
  std::filesystem::path out() const { return scratch_.path() / "out"; }
  ScratchFolder scratch_;
};

TEST_F(ExportTest, ReadsTheRun) {
  const ExportedRun run = read_exported_run(scratch_.path());
  EXPECT_TRUE(run.ned);
  ASSERT_EQ(run.trajectories.size(), 1u);
  EXPECT_EQ(run.trajectories[0].poses.size(), 2u);
  EXPECT_EQ(run.trajectories[0].poses[1].covariance.size(), 36u);
  EXPECT_THAT(error_of([&] { read_exported_run(out()); }), HasSubstr("has no trajectory"));
}

TEST_F(ExportTest, McapRoundTripsThroughImport) {
  export_as("mcap", read_exported_run(scratch_.path()), out());
  const auto recording = open_recording(out() / "run.mcap");
  EXPECT_THAT(recording->defects(), IsEmpty());
  const auto map = scratch_.write("map.yaml",
                                  "frame: NED-FRD\nsensors:\n  chaser: {from: /chaser/odometry, type: gps, fields: "
                                  "{position: [pose.pose.position.x, pose.pose.position.y, pose.pose.position.z]}}\n"
                                  "  attitude: {from: /chaser/odometry, type: heading, fields: {quaternion_xyzw: "
                                  "[pose.pose.orientation.x, pose.pose.orientation.y, pose.pose.orientation.z, "
                                  "pose.pose.orientation.w]}}\n");
  const Import back = import_recording(*recording, read_import_map(map, *recording), [] {});
  EXPECT_EQ(back.sensors[0]->t(1), 11.5);
  for (const auto& [column, value] : {std::pair{1, 1.0}, {2, 2.0}, {3, 3.0}})
    EXPECT_NEAR(back.sensors[0]->at(0, static_cast<std::size_t>(column)), value, 1e-12);
  EXPECT_NEAR(back.sensors[1]->at(0, 3), std::sqrt(0.5), 1e-12);
  // Body axes point east, south and down, so the variances 1 2 3 along them are the variances along east, north and up.
  const auto rows = read_rows(*recording, "/chaser/odometry",
                              {"pose.covariance[0]", "pose.covariance[7]", "pose.covariance[14]", "pose.covariance[21]",
                               "twist.twist.linear.y", "header.frame_id"});
  ASSERT_EQ(rows.size(), 2u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(rows[0].numbers[i], double(i + 1), 1e-12);
  EXPECT_EQ(rows[0].numbers[4], -0.25) << "to the left";
  EXPECT_EQ(rows[0].texts[5], "map");
}

TEST_F(ExportTest, WritesTextFormats) {
  const ExportedRun run = read_exported_run(scratch_.path());
  for (const char* format : {"tum", "kitti", "csv", "g2o"}) export_as(format, run, out());
  EXPECT_THAT(read_file(out() / "chaser.tum"), HasSubstr("\n10.5 1 2 3 0 0 0.70710678118654"));
  const std::string kitti = read_file(out() / "chaser.txt");
  EXPECT_EQ(std::count(kitti.begin(), kitti.end(), ' '), 2 * 11);
  EXPECT_THAT(read_file(out() / "chaser.csv"), HasSubstr(",90\n"));
  EXPECT_THAT(read_file(out() / "chaser.g2o"),
              AllOf(StartsWith("VERTEX_SE3:QUAT 0 1 2 3 0 0 0.7"), HasSubstr("EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1.")));
}

TEST_F(ExportTest, GeographicFormatsNeedAnOrigin) {
  ExportedRun run = read_exported_run(scratch_.path());
  EXPECT_THAT(error_of([&] { export_as("geojson", run, out()); }), HasSubstr("--origin"));
  run.origin = GeographicPoint{60, 10, 0};
#ifdef TANDEM_HAS_GEOGRAPHICLIB
  export_as("geojson", run, out());
  export_as("kml", run, out());
  EXPECT_THAT(read_file(out() / "chaser.geojson"), HasSubstr("[10.0000358")) << "2 m east";
  EXPECT_THAT(read_file(out() / "chaser.kml"), HasSubstr("<gx:coord>10.0000358"));
  EXPECT_THAT(read_file(out() / "chaser.kml"), HasSubstr("<altitudeMode>absolute<")) << "depths are drawn";
#endif
}

TEST_F(ExportTest, LeavesPointsOutAndSaysSo) {
  for (const char* point : {"1 0 0 0 nan nan nan nan\n", "# no orientation\n1 0 0 0 0 0 0 1\n"}) {
    scratch_.write("target.tum", point + std::string("2 1 0 0 0 0 0 1\n"));
    const ExportedRun run = read_exported_run(scratch_.path());
    for (const ExportFormat& format : export_formats())
      if (format.name == "tum")
        EXPECT_THAT(format.write(run, out()), ElementsAre(HasSubstr("target: 1 of 2 states are points"))) << point;
  }
}

}  // namespace
}  // namespace tandem

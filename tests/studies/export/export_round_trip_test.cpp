#include <fstream>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/lie/se3.hpp>
#include <tandem/studies/bench/pose_graph.hpp>
#include <tandem/studies/export/export_formats.hpp>
#include <tandem/studies/import/import.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

constexpr double kExact = 1e-9;  // m, rad

/// Random poses of the chaser with stamps since 1970, exported in a format.
class ExportRoundTrip : public testing::TestWithParam<bool> {
 protected:
  ExportRoundTrip() {
    run_.ned = GetParam();
    run_.origin = GeographicPoint{63.44, 10.39, 12};
    ExportedTrajectory& chaser = run_.trajectories.emplace_back(ExportedTrajectory{"chaser", {}});
    std::mt19937 engine(5);
    std::normal_distribution<double> normal;
    for (int k = 0; k < 20; ++k) {
      ExportedPose pose{1732600000.25 + 0.5 * k, {40 * normal(engine), 40 * normal(engine), normal(engine)}, {}};
      const SO3 R = SO3::Exp({normal(engine), normal(engine), normal(engine)});
      pose.orientation = {R.quaternion().x(), R.quaternion().y(), R.quaternion().z(), R.quaternion().w()};
      chaser.poses.push_back(pose);
    }
  }

  void write(const std::string& name) {
    for (const ExportFormat& format : export_formats())
      if (format.name == name) EXPECT_THAT(format.write(run_, scratch_.path()), testing::IsEmpty());
  }
  const std::vector<ExportedPose>& poses() const { return run_.trajectories.front().poses; }
  SE3 pose(std::size_t k) const {
    const auto& q = *poses()[k].orientation;
    const auto& p = poses()[k].position;
    return SE3(SO3::from_unit(Eigen::Quaterniond(q[3], q[0], q[1], q[2])), Vector<3>(p[0], p[1], p[2]));
  }
  void expect_pose(std::size_t k, const SE3& read) const {
    EXPECT_LT((pose(k).inverse() * read).Log().norm(), kExact) << "pose " << k;
  }
  /// Imports a file as a GPS and a compass, and compares all rows.
  void expect_import(const std::string& file, const std::string& time, const std::string& position,
                     const std::string& quaternion) {
    const auto recording = open_recording(scratch_.path() / file);
    const std::string stream = recording->streams().front().name;
    const auto map = scratch_.write(
        "map.yaml", fmt::format("frame: {0}\nsensors:\n"
                                "  gps: {{from: {1}, type: gps, {2}fields: {{position: [{3}]}}}}\n"
                                "  compass: {{from: {1}, type: heading, {2}fields: {{quaternion_xyzw: [{4}]}}}}\n",
                                run_.ned ? "NED-FRD" : "ENU-FLU", stream, time, position, quaternion));
    const Import back = import_recording(*recording, read_import_map(map, *recording), [] {});
    ASSERT_EQ(back.sensors[0]->rows(), poses().size());
    for (std::size_t k = 0; k < poses().size(); ++k) {
      const ImportedSensor &gps = *back.sensors[0], &compass = *back.sensors[1];
      EXPECT_NEAR(gps.t(k), poses()[k].t, 1e-6);
      expect_pose(k, SE3(SO3::from_unit(Eigen::Quaterniond(compass.at(k, 4), compass.at(k, 1), compass.at(k, 2),
                                                           compass.at(k, 3))),
                         Vector<3>(gps.at(k, 1), gps.at(k, 2), gps.at(k, 3))));
    }
  }
  /// Compares points of longitude, latitude and height.
  void expect_geographic(std::size_t k, double longitude, double latitude, double height) const {
    const auto east_north_up = LocalFrame(*run_.origin).local({latitude, longitude, height});
    const auto& p = poses()[k].position;
    EXPECT_NEAR(east_north_up[0], run_.ned ? p[1] : p[0], 1e-4);
    EXPECT_NEAR(east_north_up[1], run_.ned ? p[0] : p[1], 1e-4);
    EXPECT_NEAR(east_north_up[2], run_.ned ? -p[2] : p[2], 1e-3);
  }

  ScratchFolder scratch_;
  ExportedRun run_;
};

TEST_P(ExportRoundTrip, Tum) {
  write("tum");
  std::filesystem::rename(scratch_.path() / "chaser.tum", scratch_.path() / "chaser.txt");
  expect_import("chaser.txt", "time: 1, ", "2, 3, 4", "5, 6, 7, 8");
}

TEST_P(ExportRoundTrip, Csv) {
  write("csv");
  expect_import("chaser.csv", "", "x, y, z", "qx, qy, qz, qw");
}

TEST_P(ExportRoundTrip, Mcap) {
  write("mcap");
  const std::string p = "pose.pose.position.", q = "pose.pose.orientation.";
  expect_import("run.mcap", "", p + "x, " + p + "y, " + p + "z", q + "x, " + q + "y, " + q + "z, " + q + "w");
}

/// As evo reads it: the first three rows of the pose matrix, row by row, without a time.
TEST_P(ExportRoundTrip, Kitti) {
  write("kitti");
  std::ifstream file(scratch_.path() / "chaser.txt");
  for (std::size_t k = 0; k < poses().size(); ++k) {
    Eigen::Matrix<double, 3, 4> m;
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column) ASSERT_TRUE(file >> m(row, column));
    expect_pose(k, SE3(SO3::from_unit(Eigen::Quaterniond(m.leftCols<3>()).normalized()), m.col(3)));
  }
  std::string more;
  EXPECT_FALSE(file >> more);
}

TEST_P(ExportRoundTrip, G2o) {
  write("g2o");
  const bench::PoseGraph<SE3> graph = bench::read_g2o<SE3>((scratch_.path() / "chaser.g2o").string());
  ASSERT_EQ(graph.start.size(), poses().size());
  ASSERT_EQ(graph.edges.size(), poses().size() - 1);
  for (std::size_t k = 0; k < poses().size(); ++k) expect_pose(k, graph.start[k]);
  for (std::size_t k = 1; k < poses().size(); ++k)
    EXPECT_LT(((pose(k - 1) * graph.edges[k - 1].z).inverse() * pose(k)).Log().norm(), 1e-8);
}

#ifdef TANDEM_HAS_GEOGRAPHICLIB
TEST_P(ExportRoundTrip, GeoJson) {
  write("geojson");
  std::ifstream file(scratch_.path() / "chaser.geojson");
  const auto feature = nlohmann::json::parse(file);
  const auto& points = feature["geometry"]["coordinates"];
  ASSERT_EQ(points.size(), poses().size());
  for (std::size_t k = 0; k < poses().size(); ++k) {
    expect_geographic(k, points[k][0], points[k][1], points[k][2]);
    EXPECT_NEAR(feature["properties"]["times"][k].get<double>(), poses()[k].t, 1e-6);
  }
}

TEST_P(ExportRoundTrip, Kml) {
  write("kml");
  const std::string kml = read_file(scratch_.path() / "chaser.kml");
  std::size_t at = 0;
  for (std::size_t k = 0; k < poses().size(); ++k) {
    const std::string open = "<gx:coord>";
    at = kml.find(open, at) + open.size();
    std::istringstream numbers(kml.substr(at, kml.find('<', at) - at));
    double longitude = 0, latitude = 0, height = 0;
    ASSERT_TRUE(numbers >> longitude >> latitude >> height);
    expect_geographic(k, longitude, latitude, height);
  }
}
#endif

INSTANTIATE_TEST_SUITE_P(Frames, ExportRoundTrip, testing::Bool(),
                         [](const auto& info) { return info.param ? "Ned" : "Enu"; });

}  // namespace
}  // namespace tandem

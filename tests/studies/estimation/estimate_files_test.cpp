#include <algorithm>
#include <numbers>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/estimation/estimate_report.hpp>
#include <tandem/studies/scenario/states_at.hpp>
#include <tandem/studies/scenario/table.hpp>
#include <tandem/studies/support/tum.hpp>

#include "made_up_estimate.hpp"
#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

TEST(EstimateFiles, WritesTrajectoriesWithFullPrecision) {
  const ScratchFolder folder;
  write_results(made_up(), Scenario(), folder.path());
  const auto chaser = poses(read_tum(folder.path() / "chaser.tum"));
  ASSERT_EQ(chaser.size(), 2u);
  EXPECT_EQ(chaser[1].t, 1.0 / 3.0);
  EXPECT_EQ(chaser[1].value.translation().x(), 1.0 / 3.0);
  EXPECT_NEAR(chaser[1].value.rotation().Log().z(), 1.0, 1e-15);
  EXPECT_EQ(poses(read_tum(folder.path() / "target.tum"))[1].value.translation().x(), 2.0);
  EXPECT_EQ(read_file(folder.path() / "summary.json"), summary_json(made_up()));
}

TEST(EstimateFiles, WritesErrorsPerKeyframe) {
  const ScratchFolder folder;
  Estimate estimate = made_up();
  estimate.keyframes[1].t = estimate.errors[1].t = 2.5;
  estimate.errors[1].position = estimate.errors[1].orientation = {};
  write_results(estimate, Scenario(), folder.path());
  EXPECT_EQ(read_file(folder.path() / "errors.csv"),
            "t,type,position_error_m,orientation_error_deg,error_x_m,error_y_m,error_z_m,error_rx_deg,error_ry_deg,"
            "error_rz_deg,three_sigma_x_m,three_sigma_y_m,three_sigma_z_m,position_nees,three_sigma_rx_deg,"
            "three_sigma_ry_deg,three_sigma_rz_deg\n0.1,position,0.5,10,,,,,,,,,,,,,\n2.5,none,,,,,,,,,,,,,,,\n");
}

/// Returns the cells of a line of a CSV file; line 0 is the header.
std::vector<std::string> cells(const std::filesystem::path& file, std::size_t line) {
  std::vector<std::string> result;
  std::istringstream lines(read_file(file));
  std::string text, cell;
  for (std::size_t i = 0; i <= line; ++i) std::getline(lines, text);
  std::istringstream row(text + ",");
  while (std::getline(row, cell, ',')) result.push_back(cell);
  return result;
}

TEST(EstimateFiles, WritesSignedErrorsAndBoundsInScenarioFrame) {
  const ScratchFolder folder;
  Estimate estimate = made_up();
  estimate.frame = Frame::ned_frd();
  estimate.errors[0].position_vector = Vector<3>(1, 2, 3);
  estimate.errors[0].rotation_vector = Vector<3>(0, 0, 0.5 * std::numbers::pi);
  KeyframeUncertainty u;
  u.target = Matrix<6, 6>::Zero();
  u.relative_position = Vector<3>(0.25, 1, 4).asDiagonal();
  estimate.uncertainty = {u, u};
  write_results(estimate, Scenario(), folder.path());
  EXPECT_THAT(cells(folder.path() / "errors.csv", 1),
              testing::ElementsAre("0.1", "position", "0.5", "10", "1", "-2", "-3", testing::_, testing::_, "-90",
                                   "1.5", "3", "6", "10.25", "", "", ""));
}

double number(const std::string& cell) { return std::stod(cell); }

TEST(EstimateFiles, WritesTheCovarianceOfChaserAndTarget) {
  const ScratchFolder folder;
  Estimate estimate = made_up();
  estimate.frame = Frame::ned_frd();
  KeyframeUncertainty u;
  u.target = Matrix<6, 6>::Zero();
  u.cross = Matrix<6, 6>::Zero();
  u.cross(0, 1) = 0.25;
  u.cross(1, 2) = 0.5;
  estimate.uncertainty = {u, u};
  write_results(estimate, Scenario(), folder.path());
  const auto row = cells(folder.path() / "cross_covariance.csv", 1);
  ASSERT_EQ(row.size(), 37u);
  EXPECT_EQ(number(row[2]), -0.25) << "forward with left is minus forward with right";
  EXPECT_EQ(number(row[9]), 0.5);
}

/// The rank-one covariance δδᵀ must transform as the displacement δ itself.
TEST(EstimateFiles, TransformsCovariancesToScenarioFrame) {
  for (const Frame& frame : {Frame::enu_flu(), Frame::ned_frd()})
    for (const bool point : {false, true}) {
      const ScratchFolder folder;
      Estimate estimate = made_up();
      estimate.frame = frame;
      const Vector<6> d(1e-4, 2e-4, -3e-4, 4e-4, -5e-4, 6e-4);
      const SE3 pose = estimate.chaser[1];
      const Vector<3> p = d.head<3>();
      if (point) estimate.target[1] = TargetState(pose.translation());
      KeyframeUncertainty u;
      u.chaser = d * d.transpose();
      u.target = point ? Eigen::MatrixXd(p * p.transpose()) : Eigen::MatrixXd(u.chaser);
      estimate.uncertainty = {u, u};
      write_results(estimate, Scenario(), folder.path());

      const auto chaser = cells(folder.path() / "chaser_full.csv", 2),
                 target = cells(folder.path() / "target_full.csv", 2);
      ASSERT_EQ(chaser.size(), 50u);
      ASSERT_EQ(target.size(), 50u);
      const Vector<6> moved = (frame.world(pose).inverse() * frame.world(pose * SE3::Exp(d))).Log();
      const Vector<3> moved_point = frame.world(Vector<3>(pose.translation() + p)) - frame.world(pose.translation());
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) {
          const auto cell = std::size_t(14 + 6 * i + j);
          EXPECT_NEAR(number(chaser[cell]), moved[i] * moved[j], 1e-15) << i << j;
          if (point && (i > 2 || j > 2)) {
            EXPECT_EQ(target[cell], "");
          } else if (point) {
            EXPECT_NEAR(number(target[cell]), moved_point[i] * moved_point[j], 1e-15) << i << j;
          }
        }
      EXPECT_EQ(target[4].empty(), point) << "orientation";
    }
}

TEST(EstimateFiles, WritesMeanTwistsBetweenNeighbours) {
  const ScratchFolder folder;
  Estimate estimate = made_up();
  const Vector<6> twist(1, 0.1, -0.2, 0.05, 0.1, 0.3);
  const double times[] = {0, 0.5, 2, 2.25};
  estimate.keyframes.clear();
  estimate.chaser.clear();
  estimate.target.clear();
  for (const double t : times) {
    estimate.keyframes.push_back({t, KeyframeType::none, {}, {}});
    estimate.chaser.push_back(SE3::Exp(twist * t));
    estimate.target.push_back(TargetState(Vector<3>(t, 0, 0)));
  }
  estimate.target[1] = TargetState(SE3());  // a pose between points gives no twist
  estimate.frame = Frame::ned_frd();
  write_results(estimate, Scenario(), folder.path());
  const Vector<6> expected(1, -0.1, 0.2, 0.05, -0.1, -0.3);
  for (std::size_t k = 0; k < 4; ++k)
    for (int i = 0; i < 6; ++i) {
      EXPECT_NEAR(number(cells(folder.path() / "chaser_full.csv", k + 1)[std::size_t(8 + i)]), expected[i], 1e-12);
      EXPECT_EQ(cells(folder.path() / "target_full.csv", k + 1)[std::size_t(8 + i)], "");
    }
  estimate.target_twist.assign(4, twist);  // a state of the model
  write_results(estimate, Scenario(), folder.path());
  EXPECT_EQ(cells(folder.path() / "target_full.csv", 1)[9], "-0.1");
}

TEST(EstimateFiles, ListsDownWeightedMeasurements) {
  const ScratchFolder folder;
  Estimate estimate = made_up();
  write_results(estimate, Scenario(), folder.path());
  EXPECT_EQ(read_file(folder.path() / "weights.csv"), "sensor,t,part,weight\n");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "held_out.csv"));

  estimate.measurements[0].parts[0].weight = 0.25;
  estimate.measurements.push_back(
      {.sensor = 1, .index = 0, .t = 0.5, .parts = {{"position", 0.75}, {"orientation", 0.125}}});
  write_results(estimate, Scenario(), folder.path());
  EXPECT_EQ(read_file(folder.path() / "weights.csv"),
            "sensor,t,part,weight\nusbl,0.1,all,0.25\noptical,0.5,orientation,0.125\n");
}

TEST(EstimateFiles, QuotesSensorNames) {
  const ScratchFolder folder;
  Estimate estimate = made_up();
  estimate.sensors[0].name = "front, \"left\"";
  estimate.measurements[0].parts[0].weight = 0.25;
  estimate.held_out.push_back({HeldOut{0, 0, Vector<1>(0.5), Matrix<1, 1>::Identity()}, 0.5, {}});
  write_results(estimate, Scenario(), folder.path());
  EXPECT_THAT(read_file(folder.path() / "weights.csv"), HasSubstr("\n\"front, \"\"left\"\"\",0.1,all,0.25\n"));
  EXPECT_THAT(read_file(folder.path() / "held_out.csv"), HasSubstr("\n\"front, \"\"left\"\"\",0.5,,1,1,0.25,0.5,1\n"));
}

TEST(EstimateFiles, WritesInputsOfPlots) {
  const ScratchFolder folder;
  Estimate estimate = made_up();
  estimate.frame = Frame::ned_frd();
  Scenario scenario;
  scenario.truth_chaser = {{0, SE3(SO3(), {1, 2, 3})}, {1, SE3(SO3(), {1, 2, 3})}};
  scenario.truth_orientation = false;
  scenario.data.sensors.push_back({.name = "usbl", .type = SensorType::position, .delay = 0.1});
  scenario.data.sensors[0].measurements.push_back({.t = 0.2, .position = {1, 2, 3}});
  write_results(estimate, scenario, folder.path());
  EXPECT_EQ(read_file(folder.path() / "target_fixes.csv"), "t,sensor,type,x_m,y_m,z_m\n0.1,usbl,position,2,1,-3\n");
  EXPECT_EQ(
      read_file(folder.path() / "chaser_truth.tum"),
      tum_header + std::string("# no orientation\n0.1 2 1 -3 0 0 0 1\n# no orientation\n0.3333333333333333 2 1 -3 "
                               "0 0 0 1\n"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "target_truth.tum"));
  EXPECT_THAT(read_file(folder.path() / "summary.json"), HasSubstr("\"frame\": \"NED-FRD\""));
}

TEST(EstimateFiles, WritesCellsOfStatesThatTheBodyHas) {
  struct Case {
    const char* name;
    Eigen::Index n;
    bool rotation;
  };
  for (const auto& [name, n, rotation] : {Case{"pose in space", 6, true},
                                          {"pose in the plane", 3, true},
                                          {"point in space", 3, false},
                                          {"point in the plane", 2, false}}) {
    SCOPED_TRACE(name);
    MotionInstant body{.position = {1, 2, 3}, .twist = Eigen::VectorXd::Constant(n, 0.5)};
    if (rotation) body.rotation = SO3::Exp({0, 0, 1});
    body.covariance = Eigen::VectorXd::LinSpaced(2 * n, 1, double(2 * n)).asDiagonal();
    const ScratchFolder folder;
    write_states_at({{.t = 1, .chaser = body, .target = body}}, Frame::enu_flu(), true, folder.path());
    const std::vector<std::string> header = cells(folder.path() / "target_at.csv", 0),
                                   row = cells(folder.path() / "target_at.csv", 1);
    ASSERT_EQ(row.size(), header.size());
    for (std::size_t k = 0; k < row.size(); ++k) {
      const std::string& column = header[k];
      bool filled = column == "t" || (column != "note" && (rotation || column.find_first_of("qw") != 0));
      if (!rotation && column.find_first_of("cd") == 0) filled = column[1] <= '3' && column[2] <= '3';
      EXPECT_EQ(!row[k].empty(), filled) << column << " is " << row[k];
      if (column.find_first_of("cd") == 0 && column[1] != column[2] && filled) EXPECT_EQ(row[k], "0") << column;
    }
    const auto at = [&](const std::string& column) {
      return row[std::size_t(std::find(header.begin(), header.end(), column) - header.begin())];
    };
    EXPECT_EQ(at("c11") + " " + at("c22") + " " + at("d11"), "1 2 " + std::to_string(n + 1));
    EXPECT_EQ(at("c33"), n == 6 || !(n == 2 || rotation) ? "3" : "0");
    if (rotation) EXPECT_EQ(at("c66"), std::to_string(n));
  }
}

TEST(EstimateFiles, WritesFixesOfEachSensorInTimeOrder) {
  const ScratchFolder folder;
  Scenario scenario;
  scenario.data.sensors = {{.name = "lidar", .type = SensorType::position},
                           {.name = "camera, left", .type = SensorType::pose},
                           {.name = "modem", .type = SensorType::range}};
  const double second = 1.0 / 3.0;
  scenario.data.sensors[0].measurements = {{.t = 0.1, .position = {1, 2, 3}}, {.t = second, .position = {0, 0, 4}}};
  scenario.data.sensors[1].measurements = {{.t = 0.1, .position = {5, 0, 0}},
                                           {.t = second, .position = {6, 0, 0}, .held_out = true},
                                           {.t = 0.2, .position = {7, 0, 0}}};
  scenario.data.sensors[2].measurements = {{.t = 0.1, .range = 5}};
  write_results(made_up(), scenario, folder.path());
  EXPECT_EQ(read_file(folder.path() / "target_fixes.csv"),
            "t,sensor,type,x_m,y_m,z_m\n0.1,lidar,position,1,2,3\n0.1,\"camera, left\",pose,5,0,0\n"
            "0.3333333333333333,lidar,position,0.3333333333333333,0,4\n")
      << "held-out measurements and measurements between keyframes do not count";
}

TEST(EstimateFiles, WritesHeldOutMeasurements) {
  const ScratchFolder folder;
  Estimate estimate = made_up();
  estimate.held_out.push_back(
      {HeldOut{0, 0, Vector<2>(1, 3), Vector<2>(4, 1).asDiagonal().toDenseMatrix()}, 0.1, true});
  estimate.held_out.push_back({HeldOut{1, 0, Vector<1>(0.5), Matrix<1, 1>::Identity()}, 0.5, {}});
  write_results(estimate, Scenario(), folder.path());
  EXPECT_EQ(read_file(folder.path() / "held_out.csv"),
            "sensor,t,inlier,rows,rows_inside,squared_distance,residual_1,residual_2,sigma_1,sigma_2\n"
            "usbl,0.1,1,2,1,9.25,1,3,2,1\noptical,0.5,,1,1,0.25,0.5,,1,\n");
}

TEST(EstimateFiles, ThrowsIfFolderIsMissing) {
  EXPECT_THAT(error_of([] { write_results(made_up(), Scenario(), "/nonexistent"); }), HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace tandem

#include <algorithm>
#include <array>
#include <sstream>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "docking_lines.hpp"

namespace tandem {
namespace {

using Json = nlohmann::json;

TEST(TrackCommand, PrintsUpdatesAsJsonLines) {
  const Outcome run = track_lines(docking_lines(40), {"--json-lines"});
  ASSERT_EQ(run.status, 0) << run.errors;
  std::istringstream lines(run.output);
  int n = 0;
  double t = -1;
  for (std::string line; std::getline(lines, line); ++n) {
    const Json update = Json::parse(line);
    if (update["schema"] == "tandem.track/1") continue;  // the summary at the end
    EXPECT_GE(update["t"], t);
    t = update["t"];
    EXPECT_TRUE(update["sensors"]["usbl"].contains("rejected"));
    EXPECT_TRUE(update.contains("converged"));
    if (!update.contains("relative_m")) continue;
    ASSERT_EQ(update["ahead"].size(), 2);
    EXPECT_EQ(update["ahead"][1]["seconds"], 10);
    EXPECT_GT(update["ahead"][1]["sigma_m"][0], update["sigma_m"][0]) << "the uncertainty of a prediction is larger";
  }
  EXPECT_GT(n, 30);
}

Eigen::Vector3d vector_of(const Json& v) { return Eigen::Vector3d(v.get<std::array<double, 3>>().data()); }
Eigen::Matrix3d rotation_of(const Json& q) {
  return Eigen::Quaterniond(q.get<std::array<double, 4>>().data()).toRotationMatrix();  // x y z w
}

/// Returns the standard deviations of the target's position in the chaser's body, from the covariance of a line.
Eigen::Vector3d relative_sigmas(const Json& line) {
  const Json& rows = line["covariance"];
  const Eigen::Index n = Eigen::Index(rows.size());
  Eigen::MatrixXd S(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) S(i, j) = rows[std::size_t(i)][std::size_t(j)].get<double>();
  const Eigen::Matrix3d R = rotation_of(line["chaser_quaternion"]);
  const Eigen::Vector3d p = R.transpose() * (vector_of(line["target_m"]) - vector_of(line["chaser_m"]));
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, n);
  J.leftCols<3>() = -Eigen::Matrix3d::Identity();
  J.middleCols<3>(3) << 0, -p.z(), p.y(), p.z(), 0, -p.x(), -p.y(), p.x(), 0;
  J.middleCols<3>(6) =
      n == 12 ? R.transpose() * rotation_of(line["target_quaternion"]) : Eigen::Matrix3d(R.transpose());
  return (J * S * J.transpose()).diagonal().cwiseSqrt();
}

/// Motion hypotheses do not affect the window, so it is that of a track without them.
TEST(TrackCommand, CovariancesOfALineBelongToTheValuesBesideThem) {
  const std::string feed = docking_lines(40);
  const Outcome hypotheses = track_lines(feed, {"--json-lines"}),
                window = track_lines(feed, {"--json-lines", "--newest", "window", "--mode", "B"});
  ASSERT_EQ(hypotheses.status + window.status, 0) << hypotheses.errors << window.errors;
  std::istringstream lines(hypotheses.output), others(window.output);
  int n = 0, different = 0;
  for (std::string line, other; std::getline(lines, line) && std::getline(others, other);) {
    const Json a = Json::parse(line), b = Json::parse(other);
    if (a["schema"] == "tandem.track/1" || !b.contains("covariance") || !b.contains("sigma_m")) continue;
    if (std::any_of(b["sigma_m"].begin(), b["sigma_m"].end(), [](const Json& s) { return s.is_null(); })) continue;
    EXPECT_FALSE(b.contains("window"));
    const Eigen::Vector3d stated = vector_of(b["sigma_m"]);
    EXPECT_LE((relative_sigmas(b) - stated).norm(), 1e-6 * stated.norm()) << b["t"];
    ASSERT_TRUE(a.contains("window")) << line;
    EXPECT_FALSE(a.contains("covariance"));
    EXPECT_LE((vector_of(a["window"]["target_m"]) - vector_of(b["target_m"])).norm(), 1e-6);
    EXPECT_EQ(a["window"]["covariance"].size(), b["covariance"].size());
    different += (vector_of(a["target_m"]) - vector_of(b["target_m"])).norm() > 0.01;
    ++n;
  }
  EXPECT_GT(n, 20);
  EXPECT_GT(different, 5) << "hypotheses change the newest state";
}

}  // namespace
}  // namespace tandem

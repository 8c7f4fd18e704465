#include <cmath>
#include <numbers>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

/// A boat that circles at 1 m/s with GPS (degrees), compass (degrees) and a USBL head, and a target at rest 20 m deep.
class ImportCommand : public testing::Test {
 protected:
  ImportCommand() {
    std::filesystem::create_directory(log());
    std::string boat = "utc_ms,lat_deg,lon_deg,heading_deg\n", usbl = "utc_ms;range_m;bearing_deg;elevation_deg\n";
    for (int i = 0; i <= 120; ++i) {
      const double angle = i / 40.0, north = 40 * std::sin(angle), east = 40 * (1 - std::cos(angle));
      const long long ms = 1732600000000LL + 1000 * i;
      boat += fmt::format("{},{:.9f},{:.9f},{:.3f}\n", ms, 63.44 + north / 111497, 10.39 + east / 49889,
                          std::fmod(angle * kDegrees, 360));
      if (i % 3 != 0) continue;
      const double dn = 30 - north, de = 10 - east, horizontal = std::hypot(dn, de);
      usbl += fmt::format("{};{:.3f};{:.3f};{:.3f}\n", ms, std::hypot(horizontal, 20),
                          (std::atan2(de, dn) - angle) * kDegrees, -std::atan2(20, horizontal) * kDegrees);
    }
    scratch_.write("log/boat.csv", boat);
    scratch_.write("log/usbl.csv", usbl);
  }
  static constexpr double kDegrees = 180 / std::numbers::pi;
  static constexpr const char* kMap =
      "frame: NED-FRD\n"
      "origin: [63.44, 10.39]\n"
      "sensors:\n"
      "  gps: {type: gps, from: boat, fields: {latitude: lat_deg, longitude: lon_deg, height: =0}, sigma: [0.5, 0.5, "
      "0.3]}\n"
      "  compass: {type: heading, from: boat, fields: {heading: heading_deg}, sigma: [0.05, 0.05, 0.02]}\n"
      "  usbl: {type: range_bearing, fields: {range: range_m, azimuth: bearing_deg, elevation: -elevation_deg},\n"
      "         sigma: [0.5, 1 deg, 1 deg]}\n";

  std::string path(const std::string& name) const { return (scratch_.path() / name).string(); }
  std::string log() const { return path("log"); }
  std::string map(const std::string& text = kMap) const { return scratch_.write("map.yaml", text).string(); }
  ScratchFolder scratch_;
};

TEST_F(ImportCommand, ABoatWithGpsCompassAndUsblNeedsNoOdometry) {
  const Outcome imported = run_tandem({"import", log(), "--map", map(), "--out", path("scenario")});
  if (imported.errors.find("need GeographicLib") != std::string::npos) GTEST_SKIP() << "built without GeographicLib";
  ASSERT_EQ(imported.status, 0) << imported.errors;
  EXPECT_THAT(imported.output, HasSubstr("looks wrong\n  nothing\n"));
  const Outcome estimated = run_tandem({"estimate", path("scenario"), "--out", path("results"), "--plots", "off"});
  ASSERT_EQ(estimated.status, 0) << estimated.output << estimated.errors;
  // The last state of the target, at 30 m north, 10 m east and 20 m down.
  std::istringstream lines(read_file(path("results/target.tum")));
  std::string line, last;
  while (std::getline(lines, line)) last = line;
  double t = 0, x = 0, y = 0, z = 0;
  std::istringstream(last) >> t >> x >> y >> z;
  EXPECT_EQ(t, 1732600120);
  EXPECT_NEAR(x, 30, 0.6);
  EXPECT_NEAR(y, 10, 0.6);
  EXPECT_NEAR(z, 20, 0.6);
}

TEST_F(ImportCommand, ListsTheStreams) {
  const Outcome run = run_tandem({"import", log(), "--list"});
  EXPECT_EQ(run.status, 0) << run.errors;
  EXPECT_THAT(run.output, AllOf(HasSubstr("boat\n    121 rows, 1 Hz, 2024-11-26T05:46:40.000Z"),
                                HasSubstr("utc_ms, range_m, bearing_deg, elevation_deg")));
}

TEST_F(ImportCommand, WritesNothingAfterAnError) {
  std::string wrong = kMap;
  wrong.replace(wrong.find("range_m"), 7, "rnge_m");
  EXPECT_THAT(rejection_as_given({"import", log(), "--map", map(wrong), "--out", path("scenario")}),
              HasSubstr("map.yaml:6: fields: usbl has no field 'rnge_m'; did you mean range_m?"));
  EXPECT_FALSE(std::filesystem::exists(path("scenario")));
  EXPECT_THAT(files(scratch_.path()), testing::UnorderedElementsAre("log", "map.yaml"))
      << "no temporary folder is left";
  EXPECT_THAT(rejection_as_given({"import", log()}), HasSubstr("needs --out DIR for the scenario, or --list"));
  EXPECT_THAT(rejection_as_given({"import", log(), "--out", path("scenario")}),
              HasSubstr("has no message whose meaning is known"));
  scratch_.write("cut.bag", std::string("#ROSBAG V2.0\n\x45\0\0\0\x0c", 18));
  EXPECT_THAT(rejection_as_given({"import", path("cut.bag"), "--out", path("scenario")}),
              HasSubstr("has no messages (the file is truncated or corrupted: the record at byte 13"));
}

TEST_F(ImportCommand, KeepsAFolderThatIsNotEmpty) {
  scratch_.write("log/notes.md", "mine");
  EXPECT_THAT(rejection_as_given({"import", log(), "--map", map(), "--out", log()}), HasSubstr("use --force"));
}

}  // namespace
}  // namespace tandem

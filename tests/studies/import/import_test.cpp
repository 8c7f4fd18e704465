#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/import/import.hpp>
#include <tandem/studies/import/import_axes.hpp>
#include <tandem/studies/import/import_report.hpp>
#include <tandem/studies/recording/message_decoder.hpp>
#include <tandem/studies/scenario/scenario.hpp>

#include "studies/recording/written_recordings.hpp"
#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A folder with the log of a boat, and the scenario that its import writes.
class ImportTest : public testing::Test {
 protected:
  ImportTest() {
    std::filesystem::create_directories(log());
    std::filesystem::create_directories(scenario());
  }
  std::filesystem::path log() const { return scratch_.path() / "log"; }
  std::filesystem::path scenario() const { return scratch_.path() / "scenario"; }
  void write(const std::string& file, const std::string& text) const { scratch_.write("log/" + file, text); }

  /// Odometry at 10 Hz along north, 5 m deep, and a target 30 m ahead at the surface, seen at 1 Hz.
  void write_boat_log(const std::string& elevation_sign = "") const {
    std::string nav = "timestamp_ms,north_m,east_m,depth_m,roll_deg,pitch_deg,heading_deg\n";
    std::string usbl = "timestamp_ms;range_m;bearing_deg;elevation_deg;ok\n";
    for (int i = 0; i <= 200; ++i) {
      const double t = 0.1 * i, depth = 10 + 5 * std::sin(0.3 * t);
      nav += std::to_string(1732600000000LL + 100 * i) + "," + std::to_string(t) + ",2," + std::to_string(depth) +
             ",0,0,0\n";
      if (i % 10 != 0) continue;
      const double range = std::hypot(30, depth), elevation = std::asin(depth / range) * 180 / std::numbers::pi;
      usbl += std::to_string(1732600000000LL + 100 * i) + ";" + std::to_string(range) + ";350;" + elevation_sign +
              std::to_string(elevation) + ";" + (i == 50 ? "0" : "1") + "\n";
    }
    write("nav.csv", nav);
    write("usbl.csv", usbl);
  }
  static std::string boat_map(const std::string& elevation = "-elevation_deg") {
    return "frame: NED-FRD\n"
           "sensors:\n"
           "  odometry: {type: odometry, from: nav, fields: {position: [north_m, east_m, depth_m], roll: roll_deg, "
           "pitch: pitch_deg, heading: heading_deg}}\n"
           "  fix: {type: range_bearing, from: usbl, where: [ok = 1], sigma: [0.5, 2 deg, 2 deg], delay: 0.1,\n"
           "        fields: {range: range_m, azimuth: bearing_deg, elevation: " +
           elevation + "}}\n";
  }

  Import import(const std::string& map) const {
    const auto file = scratch_.write("map.yaml", map);
    const auto recording = open_recording(log(), read_table_settings(file));
    return import_recording(*recording, read_import_map(file, *recording), [] {});
  }
  Scenario imported(const std::string& map) const {
    write_import(import(map), scenario());
    return read_scenario(scenario());
  }
  std::string error_of_map(const std::string& map) const {
    return error_of([&] { import(map); });
  }

  ScratchFolder scratch_;
};

TEST_F(ImportTest, ListsAssumedConventions) {
  write_boat_log();
  const std::vector<std::string> assumed = import(boat_map()).assumptions;
  EXPECT_THAT(assumed, Contains("fix: mounted at the origin of the body, along its axes"));
  EXPECT_THAT(assumed, Contains("fix: observes the origin of the target"));
  EXPECT_THAT(assumed, Contains(HasSubstr("fix: azimuths turn from x towards y (starboard)")));
  EXPECT_THAT(assumed, Contains("odometry: north is true north"));
  EXPECT_THAT(assumed, Contains(HasSubstr("noise.constant_twist: [")));
  EXPECT_THAT(assumed, testing::Not(Contains(HasSubstr("fix: delay"))));  // the map states it
  EXPECT_THAT(assumed, testing::Not(Contains(HasSubstr("fix: sigma"))));
}

TEST_F(ImportTest, WritesAScenarioThatReadsBack) {
  write_boat_log();
  const Scenario read = imported(boat_map());
  ASSERT_EQ(read.data.odometry.size(), 201u);
  EXPECT_EQ(read.data.odometry.front().t, 1732600000);
  EXPECT_NEAR(read.data.odometry.front().value.translation().x(), 2, 1e-9) << "east";
  EXPECT_NEAR(read.data.odometry.front().value.translation().z(), -10, 1e-9);
  ASSERT_EQ(read.data.sensors.size(), 1u);
  const TargetSensor& fix = read.data.sensors[0];
  EXPECT_EQ(fix.measurements.size(), 20u) << "21 rows without the one that is not ok";
  EXPECT_NEAR(fix.measurements[0].azimuth, 10 * std::numbers::pi / 180, 1e-9) << "350 deg to starboard is 10 to port";
  EXPECT_GT(fix.measurements[0].elevation, 0) << "the surface is above the chaser";
  EXPECT_NEAR(fix.sigma[1], 2 * std::numbers::pi / 180, 1e-6);
  EXPECT_EQ(fix.delay, 0.1);
}

TEST_F(ImportTest, ReportsDroppedRowsWithReasonAndExample) {
  write_boat_log();
  const Import result = import(boat_map());
  const std::string report = import_report(result);
  EXPECT_THAT(report, HasSubstr("fix: 1 row: ok = 1 is not met (first: line 7, t = 1732600005.000, value 0)"));
  EXPECT_THAT(report, HasSubstr("range_m [m], bearing_deg [deg], -elevation_deg [deg]"));
  EXPECT_THAT(import_json(result, "out"), HasSubstr("\"reason\": \"ok = 1 is not met\""));
}

TEST_F(ImportTest, NoticesAnElevationOfTheWrongSign) {
  write_boat_log();
  EXPECT_THAT(import(boat_map()).findings, IsEmpty());
  EXPECT_THAT(import(boat_map("elevation_deg")).findings,
              Contains(HasSubstr("fix: the sign of the elevation looks wrong")));
}

TEST_F(ImportTest, NamesLineFieldAndRemedyOfAWrongMap) {
  write_boat_log();
  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  const std::string map = boat_map();
  EXPECT_THAT(error_of_map(replaced(map, "range: range_m", "range: rage_m")),
              AllOf(HasSubstr("map.yaml:5"), HasSubstr("no field 'rage_m'; did you mean range_m?")));
  EXPECT_THAT(error_of_map(replaced(map, "range: range_m", "range: \"range_m [cubit]\"")),
              HasSubstr("unknown unit 'cubit'"));
  EXPECT_THAT(error_of_map(replaced(map, "range: range_m", "range: bearing_deg")),
              HasSubstr("bearing_deg is in deg by its name or source, but length is expected"));
  EXPECT_THAT(error_of_map(replaced(map, "from: usbl", "from: usb")),
              AllOf(HasSubstr("no stream 'usb'"), HasSubstr("(streams: nav, usbl)")));
  EXPECT_THAT(error_of_map(replaced(map, "range_bearing", "range_baring")), HasSubstr("did you mean range_bearing?"));
  EXPECT_THAT(error_of_map(replaced(map, "heading: heading_deg", "")), HasSubstr("needs an orientation"));
  EXPECT_THAT(error_of_map(replaced(map, "roll: roll_deg, pitch: pitch_deg, heading: heading_deg",
                                    "euler: [roll_deg, pitch_deg, heading_deg]")),
              HasSubstr("the order of three Euler angles is ambiguous; give euler_order"));
  EXPECT_THAT(error_of_map(replaced(map, "ok = 1", "ok is 1")), HasSubstr("is not of the form FIELD = VALUE"));
  EXPECT_THAT(error_of_map(replaced(map, "ok = 1", "ok = 7")),
              AllOf(HasSubstr("no row of usbl is usable"), HasSubstr("21 × ok = 7 is not met")));
  EXPECT_THAT(error_of_map(replaced(map, "from: usbl,", "from: usbl, axes: FRU, ")), HasSubstr("left-handed"));
  EXPECT_THAT(
      error_of_map(replaced(map, "from: usbl,", "from: usbl, axes: NED, ")),
      HasSubstr("axes NED are those of the world, but a range_bearing is along the axes of the body: give FRD"));
  EXPECT_THAT(error_of_map("sensors: {gps: {type: gps, from: nav, axes: FRD, fields: {position: [north_m, east_m, "
                           "depth_m]}}}"),
              HasSubstr("axes FRD are those of a body, but a gps is along the axes of the world: give NED or ENU"));
}

TEST_F(ImportTest, NoticesTwoClocks) {
  write_boat_log();
  std::string map = boat_map();
  map.replace(map.find("from: usbl,"), 11, "from: usbl, time: {offset: 3600},");
  EXPECT_THAT(error_of_map(map), AllOf(HasSubstr("do not overlap in time, so their clocks differ"),
                                       HasSubstr("2024-11-26T06:46:40.000Z")));
}

TEST_F(ImportTest, NoticesAClockThatOverlapsInPart) {
  write_boat_log();
  std::string map = boat_map();
  map.replace(map.find("from: usbl,"), 11, "from: usbl, time: {offset: 10},");
  EXPECT_THAT(import(map).findings, Contains(AllOf(HasSubstr("fix: 10 of 20 rows ("),
                                                   HasSubstr("are outside the time of "
                                                             "odometry ("),
                                                   HasSubstr("is its clock right?"))));
}

TEST_F(ImportTest, NoticesMillisecondsReadAsSeconds) {
  std::string boat = "timestamp,x,y\n";
  for (int i = 0; i < 30; ++i) boat += std::to_string(12000 + 500 * i) + ",0,0\n";
  write("boat.csv", boat);
  EXPECT_THAT(import("sensors: {gps: {type: gps, from: boat, fields: {position: [x, y, =0]}}}\n").findings,
              Contains("gps: rows are 500 s apart; is the unit of time right?"));
}

TEST_F(ImportTest, ConvertsTimesOfGpsWeeksAndLatencies) {
  write("gnss.csv", "week,tow_ms,age_ms,x,y,z,h\n2342,193618000,500,0,0,0,0\n2342,193619000,500,1,0,0,0\n");
  const Import result = import(
      "sensors:\n  gps: {type: gps, from: gnss, time: {field: tow_ms, week: week, epoch: gps}, latency: age_ms,\n"
      "        fields: {position: [x, y, z]}}\n");
  EXPECT_NEAR(result.sensors[0]->t(0), 315964800 + 2342 * 604800.0 + 193618 - 18 - 0.5, 1e-6);
}

TEST_F(ImportTest, ConvertsTimesOfDayWithDates) {
  write("pos.csv", "date;time;x\n2024-11-26;05:46:40.5;1\n2024-11-26;05:46:41,5;2\n");
  for (const std::string date : {"date", "2024-11-26"}) {
    const Import result = import("sensors:\n  gps: {type: gps, from: pos, time: {field: time, date: " + date +
                                 "}, fields: {position: [x, =0, =0]}}\n");
    EXPECT_NEAR(result.sensors[0]->t(1), 1732600001.5, 1e-6);
  }
}

TEST_F(ImportTest, ListsOtherStreamsAndJudgesTheElevationOfABoat) {
  std::string usbl = "t,range,az,el\n", boat = "t,x,y,heading_deg\n";
  for (int i = 0; i < 30; ++i) {
    usbl += std::to_string(i) + ",30,10,-40\n";
    boat += std::to_string(i) + ",0,0,0\n";
  }
  write("usbl.csv", usbl);
  write("boat.csv", boat);
  write("wind.csv", boat);
  const auto map = [](const std::string& elevation) {
    return "sensors:\n  gps: {type: gps, from: boat, fields: {position: [x, y, =0]}}\n"
           "  usbl: {type: range_bearing, fields: {range: range, azimuth: \"az [deg]\", elevation: \"" +
           elevation + " [deg]\"}}\n";
  };
  const Import right = import(map("el"));
  EXPECT_THAT(right.findings, IsEmpty());
  EXPECT_THAT(right.map.unused, ElementsAre("1 other stream not imported: wind"));
  EXPECT_THAT(import(map("-el")).findings, Contains(HasSubstr("the sign of the elevation looks wrong")));
}

TEST_F(ImportTest, DropsFixesBeforeTheFirstAndMakesALocalFrame) {
  write("boat.csv", "t,lat,lon,hdg_deg\n0,0,0,0\n1,63.44,10.39,90\n2,63.441,10.39,90\n3,63.44,10.391,90\n");
  const std::string map =
      "sensors:\n  gps: {type: gps, from: boat, fields: {latitude: lat, longitude: lon, height: =0}}\n"
      "  compass: {type: heading, from: boat, north: magnetic, fields: {heading: hdg_deg}}\ndeclination: 5\n";
#ifdef TANDEM_HAS_GEOGRAPHICLIB
  const Import result = import(map);
  EXPECT_EQ(result.sensors[0]->dropped().begin()->first, "before the first fix: latitude and longitude are 0");
  EXPECT_NEAR(result.sensors[0]->at(0, 1), 0, 1e-6);
  EXPECT_NEAR(result.sensors[0]->at(1, 2), 111.5, 0.3) << "north";
  EXPECT_NEAR(result.sensors[0]->at(2, 1), 49.9, 0.3) << "east";
  EXPECT_NEAR(result.frame->origin().latitude, 63.44, 1e-12);
  // Heading 95 degrees is a yaw of -5 from east.
  EXPECT_NEAR(result.sensors[1]->at(1, 3), std::sin(-2.5 * std::numbers::pi / 180), 1e-9);
  EXPECT_THAT(error_of_map(map.substr(0, map.find("declination"))), HasSubstr("give declination"));
  write_import(result, scenario());
  EXPECT_TRUE(read_scenario(scenario()).navigation);
#else
  EXPECT_THAT(error_of_map(map), HasSubstr("install libgeographiclib-dev"));
#endif
}

TEST_F(ImportTest, ConvertsPressureDepthAndUnits) {
  write("deep.csv",
        "t,p_bar,vx,vy,vz,gx,gy,gz,ax,ay,az\n0,2.02650,1000,0,0,90,0,0,0,0,-1\n1,2.0,1000,0,0,90,0,0,0,0,-1\n");
  const Import result = import(
      "water: {density: 1000}\nsensors:\n"
      "  depth: {type: depth, from: deep, fields: {pressure: p_bar}}\n"
      "  dvl: {type: dvl, from: deep, axes: {x: starboard, y: forward, z: up}, fields: {velocity: [\"vx [mm/s]\", vy, "
      "vz]}}\n"
      "  imu: {type: imu, from: deep, axes: FRD, fields: {acceleration: [\"ax [g]\", \"ay [g]\", \"az [g]\"],\n"
      "        angular_rate: [\"gx [deg/s]\", gy, gz]}}\n");
  EXPECT_NEAR(result.sensors[0]->at(0, 1), -101325 / (1000 * 9.80665), 1e-3);
  EXPECT_NEAR(result.sensors[1]->at(0, 2), -1, 1e-9) << "starboard is -y";
  EXPECT_NEAR(result.sensors[2]->at(0, 3), 9.80665, 1e-9);
  EXPECT_NEAR(result.sensors[2]->at(0, 4), std::numbers::pi / 2, 1e-9);
  EXPECT_THAT(result.findings, IsEmpty());
}

TEST_F(ImportTest, ReadsQuaternionsInBothOrdersAndEulerAnglesInAnyOrder) {
  const double s = std::sin(0.2), c = std::cos(0.2);
  write("a.csv",
        "t,q0,q1,q2,q3,e0,e1,e2\n0," + std::to_string(c) + ",0,0," + std::to_string(s) + ",0.4,0,0\n1,1,0,0,0,0,0,0\n");
  for (const std::string orientation :
       {"quaternion_wxyz: [q0, q1, q2, q3]", "quaternion_xyzw: [q1, q2, q3, q0]", "euler: [e0, e1, e2]"}) {
    const Import result = import("sensors:\n  h: {type: heading, from: a, " +
                                 std::string(orientation.starts_with("euler") ? "euler_order: zyx, " : "") +
                                 "fields: {" + orientation + "}}\n");
    EXPECT_NEAR(result.sensors[0]->at(0, 3), s, 1e-6) << orientation;
    EXPECT_NEAR(result.sensors[0]->at(0, 4), c, 1e-6) << orientation;
  }
}

TEST_F(ImportTest, KnownMessagesNeedNoMap) {
  using namespace written;
  std::string records = Mcap::schema(1, "geometry_msgs/msg/TwistWithCovarianceStamped",
                                     "std_msgs/Header header\nTwistWithCovariance twist\n====\nMSG: std_msgs/Header\n"
                                     "builtin_interfaces/Time stamp\nstring frame_id\n====\nMSG: "
                                     "geometry_msgs/TwistWithCovariance\nTwist twist\nfloat64[36] covariance\n====\n"
                                     "MSG: geometry_msgs/Twist\nVector3 linear\nVector3 angular\n====\n"
                                     "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n") +
                        Mcap::channel(1, 1, "/dvl/twist");
  for (int i = 0; i < 4; ++i) {
    Cdr cdr;
    cdr.add(std::int32_t(100 + i)).add(std::uint32_t(0)).text("base_link");
    for (const double v : {1.0 + i, 0.5, 0.0, 0.0, 0.0, 0.0}) cdr.add(v);
    for (int k = 0; k < 36; ++k) cdr.add(k % 7 == 0 ? 0.0004 : 0.0);
    records += Mcap::message(1, 100.2 + i, cdr.str());
  }
  const auto recording =
      open_recording(scratch_.write("a.mcap", Mcap::start() + Mcap::chunk("", records) + Mcap::end()));
  const Import result = import_recording(*recording, known_import_map(*recording), [] {});
  ASSERT_EQ(result.sensors.size(), 1u);
  EXPECT_EQ(result.sensors[0]->sensor().name, "dvl_twist");
  EXPECT_EQ(result.sensors[0]->t(1), 101) << "the stamp, not the receive time";
  EXPECT_EQ(result.sensors[0]->at(1, 1), 2);
  EXPECT_THAT(
      result.sensors[0]->stated_sigma(),
      ElementsAre(testing::DoubleNear(0.02, 1e-6), testing::DoubleNear(0.02, 1e-6), testing::DoubleNear(0.02, 1e-6)));
}

/// A recording with one stream of a common message, without rows to read.
class OneStream : public Recording {
 public:
  explicit OneStream(const std::string& type) {
    file_ = "one.mcap";
    RecordedStream stream{"/topic", type};
    stream.fields = fields_of(*parse_message_definition(type, builtin_definition(type), false));
    stream.time_field = "header.stamp";
    stream.rows = 1;
    streams_.push_back(stream);
  }
  void read(const std::vector<RowRequest>&, const std::function<void()>&) override {}
};

TEST(KnownMessages, RulesMatchTheDefinitionsOfRos) {
  for (const std::string type :
       {"sensor_msgs/Imu", "sensor_msgs/NavSatFix", "sensor_msgs/FluidPressure", "sensor_msgs/MagneticField",
        "nav_msgs/Odometry", "geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped",
        "geometry_msgs/PointStamped", "geometry_msgs/TwistStamped", "geometry_msgs/TwistWithCovarianceStamped",
        "marine_acoustic_msgs/Dvl"}) {
    const ImportMap map = known_import_map(OneStream(type));
    EXPECT_THAT(map.unused, IsEmpty()) << type;
    ASSERT_EQ(map.sensors.size(), 1u) << type;
    for (const ImportCondition& condition : map.sensors[0].conditions) EXPECT_NE(condition.field, "") << type;
  }
}

TEST(ImportAxes, MapBetweenAnyRightHandedAxes) {
  EXPECT_EQ(axis_map("NED", "ENU").apply({1, 2, 3}), (std::array{2.0, 1.0, -3.0}));
  EXPECT_EQ(axis_map("FRD", "FLU").apply({1, 2, 3}), (std::array{1.0, -2.0, -3.0}));
  EXPECT_EQ(axis_map("RFU", "FLU").apply({1, 2, 3}), (std::array{2.0, -1.0, 3.0}));
  EXPECT_TRUE(axis_map("ENU", "ENU").is_identity());
}

}  // namespace
}  // namespace tandem

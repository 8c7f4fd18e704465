#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/import/frame_names.hpp>
#include <tandem/studies/import/import.hpp>

#include "studies/recording/read_rows.hpp"
#include "studies/recording/written_recordings.hpp"
#include "studies/scratch.hpp"

/// Imports of messages whose meaning is known.
namespace tandem {
namespace {

using namespace written;
using testing::Contains;
using testing::HasSubstr;

class KnownMessagesTest : public testing::Test {
 protected:
  Import import(const std::string& name, const std::string& bytes) const { return import(scratch_.write(name, bytes)); }
  Import import(const std::filesystem::path& file) const {
    const auto recording = open_recording(file);
    return import_recording(*recording, known_import_map(*recording), [] {});
  }
  Import import_with(const std::string& map, const std::string& log) const {
    const auto recording = open_recording(scratch_.write("a.nmea", log));
    return import_recording(*recording, read_import_map(scratch_.write("map.yaml", map), *recording), [] {});
  }
  /// Returns a bag with a point in a frame.
  std::filesystem::path points(const std::string& frame) const {
    Cdr cdr;
    cdr.add(std::int32_t(100)).add(std::uint32_t(0)).text(frame).add(1.0).add(2.0).add(3.0);
    const std::string file = (scratch_.path() / "points.db3").string();
    std::filesystem::remove(file);
    write_db3(file, "geometry_msgs/msg/PointStamped", "", {{100.1, cdr.str()}, {101.1, cdr.str()}});
    return file;
  }
  /// Returns a bag without definitions with one velocity over ground and one through the water.
  std::filesystem::path dvl() const {
    std::vector<std::pair<double, std::string>> messages;
    for (const int mode : {1, 2}) {
      Cdr cdr;
      cdr.add(std::int32_t(99 + mode)).add(std::uint32_t(0)).text("dvl").add(std::uint8_t(mode)).add(std::uint8_t(0));
      cdr.add(0.3).add(0.01).add(0.05);
      for (int i = 0; i < 9; ++i) cdr.add(i % 4 == 0 ? 1e-4 : 0);
      cdr.add(5.0).add(0.0).add(0.3).add(std::uint8_t(4)).add(1500.0f).add(true).add(true);
      for (int i = 0; i < 16; ++i) cdr.add(i < 12 ? 0.5 : 5.8);  // directions and ranges of the beams
      for (int i = 0; i < 16; ++i) cdr.add(0.25f);
      messages.emplace_back(99.5 + mode, cdr.str());
    }
    const std::string file = (scratch_.path() / "dvl.db3").string();
    write_db3(file, "marine_acoustic_msgs/msg/Dvl", "", messages);
    return file;
  }
  ScratchFolder scratch_;
};

/// Returns the heading of a row clockwise from north, in degrees.
double heading(const ImportedSensor& sensor, std::size_t row) {
  const double yaw = 2 * std::atan2(sensor.at(row, 3), sensor.at(row, 4)) * 180 / std::numbers::pi;
  return std::fmod(90 - yaw + 720, 360);
}

TEST_F(KnownMessagesTest, HeadingsOfNmeaAreTrueIfTheSentencesStateTheVariation) {
  const std::string fix = "$GPRMC,010000.00,A,6326.4,N,01023.4,E,2.0,33.0,261124,3.2,E\r\n";
  const std::string log = fix + "$HCHDG,100.0,1.0,W,4.5,E\r\n";
  const Import result = import("a.nmea", log);
  EXPECT_NEAR(heading(*result.sensors.at(0), 0), 103.5, 1e-9);
  EXPECT_THAT(result.assumptions, Contains(HasSubstr("deviation and variation of the sentences are added")));
  for (const auto& [sentence, true_heading] : {std::pair{"$HCHDG,358.0,,,4.5,E", 2.5}, {"$HCHDG,2.0,,,4.5,W", 357.5}}) {
    const Import north = import("north.nmea", fix + sentence + "\r\n");
    EXPECT_NEAR(heading(*north.sensors.at(0), 0), true_heading, 1e-9);
    EXPECT_THAT(north.findings, testing::Not(Contains(HasSubstr("heading_true reaches"))));
    EXPECT_THAT(north.findings, testing::Not(Contains(HasSubstr("heading reaches"))));
    const auto rows = read_rows(*open_recording(scratch_.path() / "north.nmea"), "HDG", {"heading_true"});
    EXPECT_NEAR(rows.at(0).numbers[0], true_heading, 1e-9);
  }
  EXPECT_THAT(result.assumptions, testing::Not(Contains(HasSubstr("declination"))));
  // A declination of the map replaces the variation.
  const Import given = import_with("declination: 10\nsensors: {h: {from: HDG}}\n", log);
  EXPECT_NEAR(heading(*given.sensors.at(0), 0), 109, 1e-9);
  const Import without = import("a.nmea", fix + "$HCHDG,100.0,1.0,W,,\r\n");
  EXPECT_NEAR(heading(*without.sensors.at(0), 0), 99, 1e-9);
  EXPECT_THAT(without.assumptions, Contains(HasSubstr("declination: 0")));
}

#ifdef TANDEM_HAS_GEOGRAPHICLIB
TEST_F(KnownMessagesTest, ArduPilotImportsTheFirstOfTwoReceivers) {
  const auto gps = [](std::uint8_t instance, std::uint64_t t) {
    return dataflash_message(130, bytes(t) + bytes(instance) + bytes(std::uint8_t(3)) +
                                      bytes(std::int32_t(634400000 + 1000 * instance)) +
                                      bytes(std::int32_t(103900000)) + bytes(std::int16_t(0)));
  };
  std::string log = dataflash_format(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") +
                    dataflash_format(130, 3 + 20, "GPS", "QBBLLc", "TimeUS,I,Status,Lat,Lng,Alt");
  for (std::uint64_t t = 1000000; t < 3000000; t += 1000000) log += gps(0, t) + gps(1, t + 1000);
  const Import result = import("a.bin", log);
  ASSERT_EQ(result.sensors.size(), 1u);
  EXPECT_EQ(result.sensors[0]->rows(), 2u);
  EXPECT_THAT(result.map.unused, Contains(HasSubstr("GPS.1: GPS is the first of these devices")));
  const auto recording = open_recording(scratch_.path() / "a.bin");
  ASSERT_TRUE(recording->find("GPS.1"));
  EXPECT_EQ(recording->find("GPS")->rows, 2u);
  const Import second = import_recording(
      *recording, read_import_map(scratch_.write("map.yaml", "sensors: {aft: {from: GPS.1}}\n"), *recording), [] {});
  EXPECT_EQ(second.sensors[0]->rows(), 2u);
  EXPECT_NEAR(second.frame->origin().latitude, 63.4401, 1e-7);
}

TEST_F(KnownMessagesTest, Px4PositionsHaveTwoVersions) {
  const auto log = [](const std::string& fields, const std::string& values) {
    std::string text = ulog_start() + ulog_message('F', "vehicle_gps_position:uint64_t timestamp;" + fields) +
                       ulog_message('A', bytes(std::uint8_t(0)) + bytes(std::uint16_t(5)) + "vehicle_gps_position");
    for (const std::uint64_t t : {1000000u, 2000000u})
      text += ulog_message('D', bytes(std::uint16_t(5)) + bytes(t) + values + "\3");
    return text;
  };
  const Import before = import(
      "a.ulg", log("int32_t lat;int32_t lon;int32_t alt;uint8_t fix_type;",
                   bytes(std::int32_t(471000000)) + bytes(std::int32_t(85000000)) + bytes(std::int32_t(500000))));
  const Import since_1_14 =
      import("b.ulg", log("double latitude_deg;double longitude_deg;double altitude_msl_m;uint8_t fix_type;",
                          bytes(47.1) + bytes(8.5) + bytes(500.0)));
  for (const Import* result : {&before, &since_1_14}) {
    ASSERT_TRUE(result->frame);
    EXPECT_NEAR(result->frame->origin().latitude, 47.1, 1e-9);
    EXPECT_NEAR(result->frame->origin().longitude, 8.5, 1e-9);
    EXPECT_NEAR(result->frame->origin().height, 500, 1e-9);
  }
}
#endif

// https://github.com/apl-ocean-engineering/marine_msgs: the z axis points where the DVL looks.
TEST_F(KnownMessagesTest, DvlPointsDownAndMeasuresOverGround) {
  const auto recording = open_recording(dvl());
  const auto rows = read_rows(*recording, "/fix", {"num_good_beams", "sound_speed", "range[3]", "beam_velocity[3]"});
  EXPECT_THAT(rows.at(0).numbers, testing::ElementsAre(4, 1500, 5.8, 0.25));
  const Import result = import(recording->file());
  const ImportedSensor& sensor = *result.sensors.at(0);
  ASSERT_EQ(sensor.rows(), 1u);
  EXPECT_EQ(sensor.at(0, 1), 0.3);
  EXPECT_EQ(sensor.at(0, 2), -0.01);
  EXPECT_EQ(sensor.at(0, 3), -0.05);
  EXPECT_THAT(sensor.dropped(), testing::ElementsAre(testing::Key("velocity_mode = 1 is not met")));
}

TEST(FrameNames, OfTheWorld) {
  for (const char* name : {"map", "/map", "map_ned", "odom_frame", "utm", "world_enu", "local_origin", "robot1/odom",
                           "ODOM", "earth", "local_origin_ned", "map2"})
    EXPECT_TRUE(is_world_frame(name)) << name;
  for (const char* name : {"", "base_link", "/camera", "mapper", "usbl", "needle", "base_link_ned", "map/camera"})
    EXPECT_FALSE(is_world_frame(name)) << name;
}

TEST_F(KnownMessagesTest, PointsInAFrameOfTheWorldAreNotThoseOfTheTarget) {
  const std::string error = error_of([&] { import(points("/map_ned")); });
  EXPECT_THAT(error, HasSubstr("gives no sensor, which is not a scenario"));
  EXPECT_THAT(error, HasSubstr("/fix: no usable row (2 × header.frame_id /map_ned is a frame of the world"));
}

TEST_F(KnownMessagesTest, TheFrameOfTheChaserIsNamed) {
  const auto recording = open_recording(points("camera"));
  ImportMap map = known_import_map(*recording);
  ImportedSensor sensor(map.sensors.at(0), map);
  recording->read({sensor.request()}, [] {});
  EXPECT_EQ(sensor.rows(), 2u);
  EXPECT_THAT(sensor.frames(), testing::ElementsAre("camera"));
}

}  // namespace
}  // namespace tandem

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/recording/recorded_time.hpp>

#include "studies/recording/read_rows.hpp"
#include "studies/recording/written_recordings.hpp"
#include "studies/scratch.hpp"

/// Reads logs of vehicles, receivers and instruments that the tests write.
namespace tandem {
namespace {

using namespace written;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;

std::string unit_of_field(const RecordedStream& stream, const std::string& name) {
  const RecordedField* field = find_field(stream, name);
  return field ? field->unit : "no such field";
}

std::string ardupilot_log() {
  const std::string gps = bytes(std::uint64_t(2500000)) + bytes(std::uint8_t(3)) + bytes(std::int32_t(634400000)) +
                          bytes(std::int32_t(-103900000)) + bytes(std::int16_t(-150));
  return dataflash_format(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") +
         dataflash_format(130, 3 + gps.size(), "GPS", "QBLLc", "TimeUS,Status,Lat,Lng,Alt") +
         dataflash_message(130, gps) + dataflash_message(130, gps);
}

TEST(Logs, ReadArduPilotLogsByTheirOwnDescription) {
  const ScratchFolder scratch;
  const auto recording = open_recording(scratch.write("a.bin", ardupilot_log()));
  EXPECT_THAT(recording->defects(), IsEmpty());
  const RecordedStream* gps = recording->find("GPS");
  ASSERT_TRUE(gps);
  EXPECT_EQ(gps->type, "ArduPilot/GPS");
  EXPECT_EQ(gps->time_field, "TimeUS");
  EXPECT_EQ(unit_of_field(*gps, "Lat"), "deg");
  const auto rows = read_rows(*recording, "GPS", {"TimeUS", "Status", "Lat", "Lng", "Alt"});
  ASSERT_THAT(rows, SizeIs(2));
  EXPECT_THAT(rows[0].numbers, ElementsAre(2.5, 3, DoubleNear(63.44, 1e-9), DoubleNear(-10.39, 1e-9), -1.5));
}

TEST(Logs, SkipDamagedBytesOfArduPilotLogs) {
  const ScratchFolder scratch;
  const std::string log = ardupilot_log();
  const auto recording = open_recording(scratch.write("a.bin", log.substr(0, 178) + "damage" + log.substr(178)));
  EXPECT_THAT(recording->defects(), ElementsAre(HasSubstr("6 damaged bytes are skipped, the first at byte 178")));
  EXPECT_THAT(read_rows(*recording, "GPS", {"Status"}), SizeIs(2));
}

TEST(Logs, ReadPx4Logs) {
  const ScratchFolder scratch;
  const std::string data = bytes(std::uint64_t(3000000)) + bytes(1.0f) + bytes(2.0f) + bytes(3.0f) + "\1";
  const std::string log = ulog_start() + ulog_message('F', "imu:uint64_t timestamp;float[3] accel;bool ok;") +
                          ulog_message('A', bytes(std::uint8_t(0)) + bytes(std::uint16_t(5)) + "imu") +
                          ulog_message('A', bytes(std::uint8_t(1)) + bytes(std::uint16_t(6)) + "imu") +
                          ulog_message('D', bytes(std::uint16_t(5)) + data) +
                          ulog_message('D', bytes(std::uint16_t(6)) + data) +
                          ulog_message('O', bytes(std::uint16_t(20)));
  const auto recording = open_recording(scratch.write("a.ulg", log));
  EXPECT_THAT(recording->defects(), ElementsAre(HasSubstr("dropped messages for 0.020 s")));
  ASSERT_THAT(recording->streams(), SizeIs(2));
  EXPECT_EQ(recording->streams()[1].name, "imu.1");
  const auto rows = read_rows(*recording, "imu", {"accel[2]", "timestamp", "ok"});
  ASSERT_THAT(rows, SizeIs(1));
  EXPECT_THAT(rows[0].numbers, ElementsAre(3, 3, 1));
}

TEST(Logs, ReadPx4BesideDamage) {
  const ScratchFolder scratch;
  const auto data = [](std::uint64_t t) { return ulog_message('D', bytes(std::uint16_t(5)) + bytes(t) + bytes(1.5f)); };
  const std::string start = ulog_start() + ulog_message('F', "depth:uint64_t timestamp;float z;") +
                            ulog_message('A', bytes(std::uint8_t(0)) + bytes(std::uint16_t(5)) + "depth");
  std::string before = start, after;
  for (std::uint64_t i = 1; i < 4; ++i) before += data(i * 1000000);
  for (std::uint64_t i = 7; i < 12; ++i) after += data(i * 1000000);
  std::string too_long = data(5000000);
  too_long[0] = 30;
  for (const std::string& damage :
       {std::string(40, '\xEE'), std::string(40, '\0'), std::string("\xFF\xFF\x44") + "abc", too_long}) {
    const auto recording = open_recording(scratch.write("a.ulg", before + damage + after));
    const std::string next = std::to_string(before.size() + damage.size());
    EXPECT_THAT(recording->defects(), ElementsAre(HasSubstr("the record at byte " + std::to_string(before.size()) +
                                                            " is damaged; reading goes on at byte " + next)));
    EXPECT_THAT(read_rows(*recording, "depth", {"timestamp"}), SizeIs(testing::Ge(8u)));
    EXPECT_EQ(recording->streams()[0].last, 11);
  }
}

/// A line with noise, and the zeros that a logger leaves when it loses power, cost only the lines in which they are.
TEST(Logs, ReadNmeaBesideDamage) {
  const ScratchFolder scratch;
  const std::string sentence = "$HEHDT,274.07,T*19\r\n";
  std::string noisy = sentence + sentence;
  noisy[4] = '\x01';
  for (const std::string& text : {noisy, sentence + std::string(4000, '\0') + "\n" + sentence}) {
    const auto recording = open_recording(scratch.write("a.nmea", text));
    EXPECT_EQ(recording->format(), "NMEA");
    EXPECT_FALSE(read_rows(*recording, "HDT", {"heading"}).empty());
  }
  EXPECT_THAT(error_of([&] { open_recording(scratch.write("a.bin", std::string("PK\3\4\x14\0\6\0\0\0\0\1", 12))); }),
              HasSubstr("unknown format"));
}

TEST(Logs, ReadNmeaWithDatesAndChecksums) {
  const ScratchFolder scratch;
  const auto file = scratch.write("a.nmea",
                                  "$GPGGA,235959.50,6326.4000,N,01023.4000,W,4,09,0.9,12.5,M,40.0,M,,\r\n"
                                  "$HEHDT,274.07,T*19\r\n"
                                  "$HEHDT,100.00,T*00\r\n"
                                  "$GPRMC,235959.50,A,6326.4,N,01023.4,W,10.0,90.0,261124,3.0,E\r\n"
                                  "$GPVTG,90.0,T,,M,10.0,N,18.0,K\r\n"
                                  "$GPGGA,000000.50,6326.4000,N,01023.4000,W,4,09,0.9,12.5,M,40.0,M,,\r\n"
                                  "$PSIMSSB,1,B,3.5\r\n");
  const auto recording = open_recording(file);
  EXPECT_THAT(recording->defects(),
              ElementsAre(HasSubstr("1 lines with a wrong checksum are skipped, the first is line 3")));
  const auto gga = read_rows(*recording, "GGA", {"time", "latitude", "longitude", "quality", "altitude"});
  ASSERT_THAT(gga, SizeIs(2));
  EXPECT_EQ(utc_text(gga[0].numbers[0]), "2024-11-26T23:59:59.500Z") << "the date of the later RMC";
  EXPECT_EQ(utc_text(gga[1].numbers[0]), "2024-11-27T00:00:00.500Z") << "after midnight";
  EXPECT_NEAR(gga[0].numbers[1], 63.44, 1e-9);
  EXPECT_NEAR(gga[0].numbers[2], -10.39, 1e-9);
  EXPECT_THAT(read_rows(*recording, "HDT", {"heading"}), SizeIs(1));
  EXPECT_NEAR(read_rows(*recording, "VTG", {"speed"})[0].numbers[0], 5, 1e-9);
  EXPECT_NEAR(read_rows(*recording, "RMC", {"speed"})[0].numbers[0], 5.1444, 1e-4);
  const auto vendor = read_rows(*recording, "PSIMSSB", {"2", "3"});
  ASSERT_THAT(vendor, SizeIs(1));
  EXPECT_EQ(vendor[0].texts[0], "B");
  EXPECT_EQ(vendor[0].numbers[1], 3.5);
}

TEST(Logs, ReadJsonLinesByTheirType) {
  const ScratchFolder scratch;
  const auto file = scratch.write(
      "dvl.json",
      "{\"time\":106.3,\"vx\":0.1,\"vy\":-0.2,\"vz\":0.05,\"velocity_valid\":true,\"covariance\":[[1,0],[0,2]],"
      "\"time_of_validity\":1638191471563017,\"type\":\"velocity\"}\n"
      "not json\n"
      "{\"ts\":49056.8,\"x\":1.5,\"type\":\"position_local\"}\n");
  const auto recording = open_recording(file);
  EXPECT_THAT(recording->defects(), ElementsAre(HasSubstr("the first is line 2")));
  const RecordedStream* velocity = recording->find("velocity");
  ASSERT_TRUE(velocity);
  EXPECT_EQ(velocity->type, "WaterLinked/velocity");
  EXPECT_EQ(velocity->time_field, "time_of_validity");
  const auto rows = read_rows(*recording, "velocity", {"vy", "velocity_valid", "covariance[1][1]", "missing"});
  ASSERT_THAT(rows, SizeIs(1));
  EXPECT_THAT(rows[0].numbers, ElementsAre(-0.2, 1, 2, testing::IsNan()));
}

TEST(Tables, DetectDelimiterHeaderAndDecimalComma) {
  const ScratchFolder scratch;
  const auto recording = open_recording(scratch.write("usbl.csv",
                                                      "\xEF\xBB\xBF# made by a logger\n"
                                                      "time [ms];range (cm);mode\r\n"
                                                      "1000;12,5;AUTO\r\n"
                                                      "2000;;MANUAL\r\n"));
  const RecordedStream& stream = recording->streams().front();
  EXPECT_EQ(stream.name, "usbl");
  EXPECT_EQ(stream.time_field, "time [ms]");
  EXPECT_EQ(unit_of_field(stream, "range (cm)"), "cm");
  EXPECT_EQ(stream.first, 1);
  const auto rows = read_rows(*recording, "usbl", {"range (cm)", "mode"});
  ASSERT_THAT(rows, SizeIs(2));
  EXPECT_EQ(rows[0].numbers[0], 12.5);
  EXPECT_TRUE(std::isnan(rows[1].numbers[0]));
  EXPECT_EQ(rows[1].texts[1], "MANUAL");
}

TEST(Tables, NumberTheColumnsWithoutAHeader) {
  const ScratchFolder scratch;
  TableSettings settings;
  settings.missing = {"-9999"};
  const auto recording = open_recording(scratch.write("a.txt", "0.0  1.5 -9999\n0.1  2.5 \t7\n"), settings);
  const auto rows = read_rows(*recording, "a", {"1", "3"});
  ASSERT_THAT(rows, SizeIs(2));
  EXPECT_TRUE(std::isnan(rows[0].numbers[1]));
  EXPECT_THAT(rows[1].numbers, ElementsAre(0.1, 7));
}

TEST(Tables, QuotedCellsMayHaveTheDelimiter) {
  const ScratchFolder scratch;
  const auto recording = open_recording(scratch.write("a.csv", "t,note,x\n1,\"a, b\",2\n"));
  const auto rows = read_rows(*recording, "a", {"note", "x"});
  EXPECT_EQ(rows.at(0).texts[0], "a, b");
  EXPECT_EQ(rows.at(0).numbers[1], 2);
}

TEST(Recordings, NameWhatTheyCannotRead) {
  const ScratchFolder scratch;
  EXPECT_THAT(error_of([&] { open_recording(scratch.path() / "none.bag"); }), HasSubstr("none.bag is missing"));
  EXPECT_THAT(error_of([&] { open_recording(scratch.write("a.bin", "")); }), HasSubstr("is empty"));
  EXPECT_THAT(error_of([&] { open_recording(scratch.write("a.bin", std::string("\0\1\2\3", 4))); }),
              AllOf(HasSubstr("unknown format"), HasSubstr(".mcap")));
  const auto recording = open_recording(scratch.write("a.csv", "t,range_m\n1,2\n"));
  EXPECT_THAT(error_of([&] { read_rows(*recording, "a", {"rnge_m"}); }), HasSubstr("did you mean range_m?"));
}

TEST(RecordedTime, ParsesTextsAndZones) {
  for (const double factor : {1.0, 1e3, 1e6, 1e9})
    EXPECT_NEAR(seconds_by_magnitude(factor * 1732600000), 1732600000, 1e-3) << factor;
  EXPECT_EQ(seconds_by_magnitude(12.5), 12.5);
  EXPECT_EQ(parse_time_text("2024-11-26T05:46:40.5Z"), 1732600000.5);
  EXPECT_EQ(parse_time_text("2024/11/26 05:46:40"), 1732600000);
  EXPECT_EQ(parse_time_text("2024-11-26T06:46:40+01:00"), 1732600000);
  EXPECT_EQ(parse_time_text("26.11.2024 05:46:40"), 1732600000);
  EXPECT_EQ(parse_time_text("20241126T054640.5Z"), 1732600000.5);
  EXPECT_EQ(packed_time_of_day(10203.5), 3723.5);
  EXPECT_TRUE(std::isnan(packed_time_of_day(6000)));
  EXPECT_EQ(parse_time_text("01:00:00.25"), 3600.25);
  EXPECT_FALSE(parse_time_text("2024-13-26"));
  EXPECT_FALSE(parse_time_text("AUTO"));
  EXPECT_EQ(utc_text(1732600000.123), "2024-11-26T05:46:40.123Z");
}

}  // namespace
}  // namespace tandem

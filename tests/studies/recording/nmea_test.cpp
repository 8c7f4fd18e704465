#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/recording/nmea_sentence.hpp>
#include <tandem/studies/recording/recorded_time.hpp>

#include "studies/recording/read_rows.hpp"
#include "studies/scratch.hpp"

/// Times, cut lines and headings of NMEA logs.
namespace tandem {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string line(const std::string& content, const std::string& prefix = "") {
  unsigned sum = 0;
  for (const char c : content) sum ^= static_cast<unsigned char>(c);
  char checksum[4];
  std::snprintf(checksum, sizeof checksum, "*%02X", sum);
  return prefix + "$" + content + checksum + "\r\n";
}
std::string gga(const std::string& time, const std::string& quality = "1", const std::string& talker = "GP") {
  return line(talker + "GGA," + time + ",6326.4,N,01023.4,E," + quality + ",08,0.9,12.5,M,40.0,M,,");
}
std::string rmc(const std::string& time, const std::string& date, const std::string& status = "A") {
  return line("GPRMC," + time + "," + status + ",6326.4,N,01023.4,E,2.0,33.0," + date + ",3.2,E");
}
std::string hdt(int degrees) { return line("HEHDT," + std::to_string(degrees) + ".0,T"); }

class NmeaTest : public testing::Test {
 protected:
  std::unique_ptr<Recording> open(const std::string& text) const {
    return open_recording(scratch_.write("a.nmea", text));
  }
  /// Returns the times of a type of sentence as UTC, or as numbers without a date.
  std::vector<std::string> times(const std::string& text, const std::string& type) const {
    std::vector<std::string> result;
    for (const TestRow& row : read_rows(*open(text), type, {"time"}))
      result.push_back(std::isnan(row.numbers[0]) ? "none" : utc_text(row.numbers[0]));
    return result;
  }
  ScratchFolder scratch_;
};

TEST_F(NmeaTest, ADateAppliesToTheSentencesBeforeMidnight) {
  const std::string log = gga("235959.00") + hdt(1) + rmc("000000.00", "271124") + gga("000000.00") + hdt(2);
  EXPECT_THAT(times(log, "GGA"), ElementsAre("2024-11-26T23:59:59.000Z", "2024-11-27T00:00:00.000Z"));
  EXPECT_THAT(times(log, "HDT"), ElementsAre("2024-11-26T23:59:59.000Z", "2024-11-27T00:00:00.000Z"));
  EXPECT_EQ(utc_text(open(log)->find("GGA")->first), "2024-11-26T23:59:59.000Z") << "also in the list of streams";
}

TEST_F(NmeaTest, TalkersOutOfOrderCrossMidnightOnce) {
  const std::string log = gga("235959.70") + gga("235959.30", "1", "GN") + gga("000000.20") +
                          gga("235959.80", "1", "GN") + gga("000000.70") + gga("000000.30", "1", "GN");
  EXPECT_THAT(times(log, "GGA"),
              ElementsAre("1970-01-01T23:59:59.700Z", "1970-01-01T23:59:59.300Z", "1970-01-02T00:00:00.200Z",
                          "1970-01-01T23:59:59.800Z", "1970-01-02T00:00:00.700Z", "1970-01-02T00:00:00.300Z"));
}

TEST_F(NmeaTest, DatesOfJoinedLogsApplyFromTheirStart) {
  const std::string log =
      rmc("180000.00", "261124") + gga("180001.00") + gga("100000.00") + rmc("100001.00", "291124") + gga("100002.00");
  EXPECT_THAT(times(log, "GGA"),
              ElementsAre("2024-11-26T18:00:01.000Z", "2024-11-29T10:00:00.000Z", "2024-11-29T10:00:02.000Z"));
}

TEST_F(NmeaTest, SentencesWithoutAFixGiveNoDate) {
  const std::string log = gga("010000.00", "0") + rmc("010000.00", "060180", "V") + hdt(1) + gga("010001.00") +
                          rmc("010001.00", "261124") + hdt(2);
  EXPECT_THAT(times(log, "HDT"), ElementsAre("2024-11-26T01:00:00.000Z", "2024-11-26T01:00:01.000Z"));
  const auto never = open(gga("010000.00", "0") + rmc("010000.00", "060180", "V"));
  EXPECT_THAT(never->defects(), ElementsAre(HasSubstr("no sentence with a fix has a date")));
}

TEST_F(NmeaTest, TimesBeforeTheFirstFixAreIgnoredIfTheyDisagree) {
  const std::string log = gga("000012.00", "0") + hdt(1) + gga("134503.00") + hdt(2) + rmc("134503.00", "261124") +
                          gga("000020.00", "0", "GN") + gga("134504.00") + hdt(3);
  EXPECT_THAT(times(log, "HDT"), ElementsAre("none", "2024-11-26T13:45:03.000Z", "2024-11-26T13:45:04.000Z"));
  EXPECT_THAT(times(log, "GGA"), ElementsAre("none", "2024-11-26T13:45:03.000Z", "none", "2024-11-26T13:45:04.000Z"));
}

TEST_F(NmeaTest, ZdaGivesADateOnceTheReceiverHasAFix) {
  const std::string cold = line("GPZDA,010000.00,06,01,1980,00,00") + gga("010000.00", "0") + hdt(1);
  const std::string warm = gga("010001.00") + line("GPZDA,010001.00,26,11,2024,00,00") + hdt(2);
  EXPECT_THAT(times(cold + warm, "HDT"), ElementsAre("2024-11-26T01:00:00.000Z", "2024-11-26T01:00:01.000Z"));
  EXPECT_THAT(times(line("GPZDA,010001.00,26,11,2024,00,00") + hdt(2), "HDT"), ElementsAre("2024-11-26T01:00:01.000Z"))
      << "no sentence has a status";
}

TEST_F(NmeaTest, SentencesWithoutATimeAreSpreadBetweenFixes) {
  std::string log = rmc("010000.00", "261124");
  for (int second = 0; second < 3; ++second) {
    log += gga("01000" + std::to_string(second) + ".00");
    for (int i = 0; i < 4; ++i) log += hdt(i);
  }
  const auto recording = open(log);
  const auto rows = read_rows(*recording, "HDT", {"time"});
  ASSERT_EQ(rows.size(), 12u);
  for (std::size_t i = 0; i < rows.size(); ++i)
    EXPECT_DOUBLE_EQ(rows[i].numbers[0], 1732582800 + 0.25 * static_cast<double>(i));
  EXPECT_THAT(recording->find("HDT")->time_note, HasSubstr("spread evenly"));
  EXPECT_THAT(recording->find("GGA")->time_note, IsEmpty());
}

TEST_F(NmeaTest, APauseOfTheLogDoesNotStretchTheTimes) {
  std::string log = rmc("010000.00", "261124") + hdt(1) + hdt(2) + rmc("010001.00", "261124") + hdt(3) + hdt(4) +
                    rmc("010041.00", "261124");
  EXPECT_THAT(times(log, "HDT"), ElementsAre("2024-11-26T01:00:00.000Z", "2024-11-26T01:00:00.500Z",
                                             "2024-11-26T01:00:01.000Z", "2024-11-26T01:00:02.000Z"));
}

/// The clock of the logger is ahead by an hour.
TEST_F(NmeaTest, SentencesWithoutATimeTakeTheShiftedReceiveTime) {
  std::string log = line("HEHDT,1.0,T", "2024-11-26T02:00:00.350Z ");
  log += line("GPRMC,010000.50,A,6326.4,N,01023.4,E,2.0,33.0,261124,3.2,E", "2024-11-26T02:00:00.600Z ");
  log += line("HEHDT,2.0,T", "2024-11-26T02:00:00.750Z ") + line("HEHDT,3.0,T", "2024-11-26T02:00:00.800Z ");
  EXPECT_THAT(times(log, "HDT"),
              ElementsAre("2024-11-26T01:00:00.250Z", "2024-11-26T01:00:00.650Z", "2024-11-26T01:00:00.700Z"));
}

TEST_F(NmeaTest, WithoutFixesTheTimeIsTheReceiveTime) {
  EXPECT_THAT(times(line("HEHDT,1.0,T", "2024-11-26T02:00:00.350Z "), "HDT"), ElementsAre("2024-11-26T02:00:00.350Z"));
}

TEST_F(NmeaTest, LinesWithoutTheChecksumOfTheirTypeAreCut) {
  const auto recording = open(hdt(274) + hdt(275) + "$HEHDT,27\r\n" + "$HEHDT,2" + hdt(276) + "$PSIMSSB,1\r\n");
  EXPECT_THAT(recording->defects(), testing::Contains(HasSubstr("1 lines are skipped as cut")));
  std::vector<double> headings;
  for (const TestRow& row : read_rows(*recording, "HDT", {"heading"})) headings.push_back(row.numbers[0]);
  EXPECT_THAT(headings, ElementsAre(274, 275, 276)) << "the sentence behind a cut one is whole";
  EXPECT_TRUE(recording->find("PSIMSSB")) << "a type without checksums";
}

TEST_F(NmeaTest, HeadingsIncludeDeviationAndVariation) {
  const auto recording = open(line("HCHDG,100.0,1.0,W,4.5,E") + line("HCHDG,100.0,,,4.5,W"));
  const auto rows = read_rows(*recording, "HDG", {"heading", "heading_magnetic", "heading_true"});
  EXPECT_THAT(rows[0].numbers, ElementsAre(100, 99, 103.5));
  EXPECT_THAT(rows[1].numbers, ElementsAre(100, 100, 95.5));
  const auto without = open(line("HCHDG,100.0,1.0,E,,"));
  EXPECT_FALSE(find_field(*without->find("HDG"), "heading_true")) << "no variation is stated";
  EXPECT_EQ(read_rows(*without, "HDG", {"heading_magnetic"})[0].numbers[0], 101);
}

}  // namespace
}  // namespace tandem

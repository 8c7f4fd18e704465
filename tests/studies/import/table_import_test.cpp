#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/import/import.hpp>
#include <tandem/studies/recording/recorded_units.hpp>
#include <tandem/studies/scenario/scenario.hpp>

#include "studies/scratch.hpp"

/// Imports tables of unusual shapes, and maps with wrong values.
namespace tandem {
namespace {

class TableImportTest : public testing::Test {
 protected:
  TableImportTest() { std::filesystem::create_directories(scenario()); }
  std::filesystem::path scenario() const { return scratch_.path() / "scenario"; }

  Import import(const std::string& table, const std::string& map) const {
    const auto file = scratch_.write("map.yaml", map), log = scratch_.write("log.csv", table);
    const auto recording = open_recording(log, read_table_settings(file));
    return import_recording(*recording, read_import_map(file, *recording), [] {});
  }
  /// Imports the field of a sensor of one quantity.
  Import import(const std::string& table, const std::string& type, const std::string& fields,
                const std::string& rest = "") const {
    return import(table, rest + "\nsensors:\n  s: {type: " + type + ", from: log, fields: {" + fields + "}}\n");
  }
  void import_with(const std::string& settings) const {
    const std::string map = "sensors:\n  gps: {type: gps, from: log, fields: {position: [x, y, z]},\n    ";
    write_import(import("t,x,y,z\n0,0,0,0\n1,1,1,1\n", map + settings + "}\n"), scenario());
  }

  ScratchFolder scratch_;
};

std::vector<double> times(const Import& import) {
  std::vector<double> result;
  for (std::size_t i = 0; i < import.sensors[0]->rows(); ++i) result.push_back(import.sensors[0]->t(i));
  return result;
}

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST_F(TableImportTest, ColumnNumbersSelectColumnsWithTheSameName) {
  const Import result =
      import("time,x,y,z,time,x,y,z\n0,1,2,3,10,4,5,6\n1,1,2,3,11,4,5,6\n",
             "sensors:\n  s: {type: gps, from: log, time: \"5\", fields: {position: [\"6\", \"7\", \"8\"]}}\n");
  const ImportedSensor& s = *result.sensors[0];
  EXPECT_THAT(times(result), ElementsAre(10, 11));
  EXPECT_THAT((std::vector{s.at(0, 1), s.at(0, 2), s.at(0, 3)}), ElementsAre(4, 5, 6));
  EXPECT_THAT(result.defects, Contains(HasSubstr("the header repeats time, x, y and z")));
}

TEST_F(TableImportTest, UnitsOfHeadersAreFoundInAnyCaseOrRefused) {
  const auto depth_of = [&](const std::string& column, const std::string& quantity = "depth") {
    return -import("t," + column + "\n0,100\n1,100\n", "depth", quantity + ": \"" + column + "\"").sensors[0]->at(0, 1);
  };
  EXPECT_NEAR(depth_of("depth (Ft)"), 30.48, 1e-9);
  EXPECT_NEAR(depth_of("depth_feet"), 30.48, 1e-9);
  EXPECT_NEAR(depth_of("depth_fathoms"), 182.88, 1e-9);
  EXPECT_NEAR(depth_of("pressure [dBar]", "pressure"), (1e6 - 101325) / (1025 * 9.80665), 1e-6);
  for (const std::string column : {"depth [cubits]", "depth [Mm]"})
    EXPECT_THAT(error_of([&] { depth_of(column); }),
                AllOf(HasSubstr("map.yaml:3"), HasSubstr(column), HasSubstr("write \"" + column + " [UNIT]\"")));
  EXPECT_NEAR(import("t,depth [cubits]\n0,2\n1,2\n", "depth", "depth: \"depth [cubits] [km]\"").sensors[0]->at(0, 1),
              -2000, 1e-9);
  EXPECT_THAT(error_of([&] { import("t,heading_grad\n0,2\n1,2\n", "heading", "heading: heading_grad"); }),
              HasSubstr("ambiguous"));
}

TEST(RecordedUnits, MatchInAnyCaseUnlessTheCaseDistinguishesThem) {
  const auto named = [](const char* text) {
    const auto unit = find_unit(text);
    return unit ? std::string(unit->name) : "";
  };
  for (const auto& [text, name] : {std::pair{"Knots", "kn"},
                                   {"PSI", "psi"},
                                   {"mBar", "mbar"},
                                   {"Deg", "deg"},
                                   {"MS", "ms"},
                                   {"MBAR", "mbar"},
                                   {"M", "m"},
                                   {"Gradians", "gon"},
                                   {"NM", "nmi"},
                                   {"Ms", ""},
                                   {"Mm", ""},
                                   {"t", ""},
                                   {"G", ""},
                                   {"grad", ""}})
    EXPECT_EQ(named(text), name) << text;
  EXPECT_EQ(unit_in_name("data[3]"), "");
  EXPECT_EQ(unit_in_name("position (x)"), "");
  EXPECT_EQ(unit_in_name("depth [furlongs]"), "furlongs");
}

TEST_F(TableImportTest, AnglesBeyondATurnLookWrong) {
  const std::string table = "t,heading,roll,pitch\n0,300,1,-2\n1,302,1,-2\n";
  EXPECT_THAT(import(table, "heading", "heading: heading").findings,
              Contains("s: heading reaches 302 rad; is it in degrees (FIELD [deg])?"));
  EXPECT_THAT(import(table, "heading", "roll: roll, pitch: pitch, yaw: =0").findings,
              Contains(HasSubstr("s: pitch reaches -2 rad; is it in degrees")));
  EXPECT_THAT(import(table, "heading", "heading: \"heading [deg]\"").findings, IsEmpty());
}

TEST_F(TableImportTest, MissingValuesAreComparedAsNumbers) {
  const Import result =
      import("t,z\n0,-9999.000\n1,-5\n2,-9999\n3,4\n", "depth", "depth: z", "tables: {missing: [-9999]}");
  EXPECT_THAT(times(result), ElementsAre(1, 3));
  EXPECT_EQ(result.sensors[0]->dropped().at("no number in z").example, "line 2, t = 0.000, z has no value");
}

TEST_F(TableImportTest, TimesOfDayContinueAfterMidnight) {
  const std::string date = "time: {date: 2024-11-26}";
  const double midnight = 1732665600;
  const Import texts = import("time,z\n23:59:59,1\n00:00:01,1\n", "depth", "depth: z", date);
  EXPECT_THAT(times(texts), ElementsAre(midnight - 1, midnight + 1));
  EXPECT_THAT(texts.findings, IsEmpty());
  const Import packed = import("utc,z\n235959.5,1\n000001.25,1\n", "depth", "depth: z",
                               "time: {date: 2024-11-26, field: utc, unit: hhmmss}");
  EXPECT_THAT(times(packed), ElementsAre(midnight - 0.5, midnight + 1.25));
  EXPECT_THAT(import("utc,z\n151358,1\n151359,1\n151400,1\n", "depth", "depth: z").findings,
              ElementsAre("s: the times in utc look like hhmmss; give time: {field: utc, unit: hhmmss}"));
  EXPECT_THAT(import("t,z\n158,1\n159,1\n200,1\n201,1\n260,1\n", "depth", "depth: z").findings,
              Not(Contains(HasSubstr("hhmmss"))));
}

TEST_F(TableImportTest, DateAndTimeMayBeTwoColumns) {
  for (const std::string date : {"26.11.2024", "2024-11-26", "20241126"})
    for (const std::string header : {"date,time,z\n", "Date,UTC,z\n"}) {
      const Import result = import(header + date + ",05:46:40,1\n" + date + ",05:46:41,1\n", "depth", "depth: z");
      EXPECT_THAT(times(result), ElementsAre(1732600000, 1732600001)) << date << header;
      EXPECT_THAT(result.assumptions, Contains(HasSubstr("with the date in ")));
    }
  EXPECT_THAT(times(import("date,time,z\n2024-11-26 05:46:40,0.5,1\n2024-11-26 05:46:41,1.5,1\n", "depth", "depth: z")),
              ElementsAre(1732600000, 1732600001))
      << "the first column that is a time by its name";
}

TEST_F(TableImportTest, DroppedRowsAreShownWithLineAndText) {
  const Import result = import("time,z\nyesterday,1\n1,1\n2,-\n3,1\n", "depth", "depth: z");
  EXPECT_EQ(result.sensors[0]->dropped().at("no time").example, "line 2, time is 'yesterday'");
  EXPECT_EQ(result.sensors[0]->dropped().at("no number in z").example, "line 4, t = 2.000, z is '-'");
}

TEST_F(TableImportTest, ACommentMayNameTheColumns) {
  EXPECT_THAT(times(import("% exported\n%time,field.z\n5,1\n6,1\n", "depth", "depth: field.z")), ElementsAre(5, 6));
  EXPECT_THAT(times(import("# one, two\n5,1\n6,1\n", "depth", "depth: \"2\"", "time: \"1\"")), ElementsAre(5, 6));
}

TEST_F(TableImportTest, DecimalCommasMayBeQuoted) {
  const Import result = import("t,z\n\"0,5\",\"1,25\"\n\"1,5\",\"1,25\"\n", "depth", "depth: z");
  EXPECT_THAT(times(result), ElementsAre(0.5, 1.5));
  EXPECT_EQ(result.sensors[0]->at(0, 1), -1.25);
}

TEST_F(TableImportTest, LongRowsMayComeLate) {
  std::string table;
  for (int i = 0; i < 100; ++i) table += "D," + std::to_string(i) + ",1\n";
  const Import result = import(table + "P,7,1,2,3\n",
                               "sensors:\n  s: {type: gps, from: log, where: [1 = P], time: \"2\", fields: {position: "
                               "[\"3\", \"4\", \"5\"]}}\n");
  EXPECT_THAT(times(result), ElementsAre(7));
}

TEST_F(TableImportTest, CellsWithLineBreaksAreNamed) {
  const Import result = import("t,note,z\n0,\"a\nb\",1\n1,ok,1\n", "depth", "depth: z");
  EXPECT_THAT(result.defects, ElementsAre(HasSubstr("line 2: a quoted cell is not closed")));
  EXPECT_THAT(error_of([&] { import("t,note,z\n0,\"a\nb\",1\n", "depth", "depth: z"); }),
              HasSubstr("line 2: a quoted cell is not closed"));
}

TEST_F(TableImportTest, RefusesSettingsThatAScenarioCannotHave) {
  const std::pair<std::string, std::string> wrong[] = {{"sigma: [1, 1]", "sigma"},
                                                       {"sigma: [-1, 1, 1]", "sigma"},
                                                       {"loss: cauchi:2", "loss"},
                                                       {"delay: -3", "delay"},
                                                       {"delay: 800 ms", "delay"},
                                                       {"position: [1, 2]", "position"},
                                                       {"sigma: [1, 1, 1], position: [20 cm, 0, 0]", "position"}};
  for (const auto& entry : wrong)
    EXPECT_THAT(error_of([&] { import_with(entry.first); }), HasSubstr("map.yaml:3: gps: " + entry.second))
        << entry.first;
  EXPECT_THAT(error_of([&] { import_with("sigma: [1 deg, 1, 1]"); }), HasSubstr("deg is a unit of angle"));
  EXPECT_NO_THROW(import_with("sigma: [10 cm, 1, 1], position: [0.2, 0, 0], delay: 0.8, loss: cauchy:2"));
}

TEST_F(TableImportTest, OdometryHasNoiseWithoutASensorOfTheTarget) {
  const std::string map =
      "sensors:\n  o: {type: odometry, from: log, fields: {position: [x, =0, =0], yaw: =0}}\n"
      "  gps: {type: gps, from: log, fields: {position: [x, =0, =0]}}\n";
  write_import(import("t,x\n0,0\n1,1\n", map), scenario());
  EXPECT_EQ(read_scenario(scenario()).data.odometry.size(), 2u);
  EXPECT_THAT(
      error_of([&] { write_import(import("t,x\n0,0\n1,1\n", map + "noise: {odometry: [1, 2]}\n"), scenario()); }),
      HasSubstr("map.yaml:4: odometry"));
}

TEST_F(TableImportTest, RefusesATimeThatNoStreamHas) {
  EXPECT_THAT(error_of([&] { import("t,host_ms,z\n0,0,1\n1,1,1\n", "depth", "depth: z", "time: hots_ms"); }),
              AllOf(HasSubstr("map.yaml:1"), HasSubstr("no stream has the field 'hots_ms'; did you mean host_ms?")));
}

}  // namespace
}  // namespace tandem

#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/import/import.hpp>
#include <tandem/studies/import/import_report.hpp>
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
using testing::FloatEq;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::Pointwise;

TEST_F(TableImportTest, StatedSigmasAreInTheOrderOfTheConvertedAxes) {
  const std::string table = "t,sb,fw,up,vs,vf,vu\n0,5,20,1,0.01,4,0.25\n1,5,20,1,0.01,4,0.25\n";
  const std::string gps = "  gps: {type: gps, from: log, fields: {position: [sb, fw, up]}}\n";
  const auto sigma = [&](const std::string& type, const std::string& fields) {
    const Import result = import(table, "sensors:\n  s: {type: " + type +
                                            ", from: log, axes: {x: starboard, y: forward, z: up}, fields: {" + fields +
                                            "}, covariance: [vs, vf, vu]}\n" + gps);
    return result.sensors[0]->stated_sigma();
  };
  EXPECT_THAT(sigma("position", "position: [sb, fw, up]"), Pointwise(FloatEq(), {2.0f, 0.1f, 0.5f}));
  EXPECT_THAT(sigma("dvl", "velocity: [sb, fw, up]"), Pointwise(FloatEq(), {2.0f, 0.1f, 0.5f}));
  EXPECT_THAT(sigma("range_bearing", "range: fw, azimuth: up, elevation: up"),
              Pointwise(FloatEq(), {0.1f, 2.0f, 0.5f}));
}

TEST_F(TableImportTest, InfiniteRangesAreMissing) {
  const Import result = import("t,r,x\n0,10,0\n1,inf,0\n2,12,0\n",
                               "sensors:\n  s: {type: range, from: log, fields: {range: r}}\n"
                               "  gps: {type: gps, from: log, fields: {position: [x, x, x]}}\n");
  EXPECT_THAT(times(result), ElementsAre(0, 2));
}

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
  // A heading in degrees may count turns.
  EXPECT_THAT(import("t,heading\n0,359\n1,361\n", "heading", "heading: \"heading [deg]\"").findings, IsEmpty());
  EXPECT_THAT(import("t,heading\n0,35900\n1,35910\n", "heading", "heading: \"heading [deg]\"").findings,
              ElementsAre("s: heading reaches 3.591e+04 deg; is its unit deg?"));
}

TEST_F(TableImportTest, ColumnsAreFoundWithoutTheirUnits) {
  const std::string table = "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], v_x [m s^-1], q_w []\n";
  const std::string row = ",1,2,3,0.5,1\n";
  for (const std::string unit : {"", " [m]"}) {
    const Import result =
        import(table + "1403636580838555648" + row + "1403636581838555648" + row,
               "sensors:\n  s: {type: gps, from: log, where: [q_w = 1], fields: {position: [\"p_RS_R_x" + unit +
                   "\", \"p_RS_R_y" + unit + "\", \"p_RS_R_z" + unit + "\"]}}\n");
    EXPECT_NEAR(times(result)[0], 1403636580.8385556, 1e-6);
    EXPECT_EQ(result.sensors[0]->at(0, 2), 2);
    EXPECT_THAT(stream_list(*open_recording(scratch_.path() / "log.csv")), HasSubstr("q_w []\n"));
  }
  const auto file = scratch_.write("a.jsonl", "{\"t\":1,\"a\":[1,2],\"b\":0}\n{\"t\":2,\"a\":[1,2,3],\"b\":0}\n");
  EXPECT_THAT(stream_list(*open_recording(file)), HasSubstr("a[0..2], b"));
  for (const auto& [unit, quantity] :
       {std::pair{"m s^-1", Quantity::speed}, {"m s^-2", Quantity::acceleration}, {"rad s^-1", Quantity::angular_rate}})
    EXPECT_EQ(find_unit(unit).value().quantity, quantity) << unit;
  EXPECT_THAT(error_of([&] { import("t,x [m],x [cm]\n0,1,2\n1,1,2\n", "depth", "depth: x"); }),
              HasSubstr("has no field 'x'"));
  EXPECT_EQ(import("t,x [cm],x\n0,1,2\n1,1,2\n", "depth", "depth: x").sensors[0]->at(0, 1), -2);
  EXPECT_EQ(import("t,x [cm]\n0,1\n1,1\n", "depth", "depth: x").sensors[0]->at(0, 1), -0.01);
  EXPECT_THAT(error_of([&] { import("1,2,3\n2,3,4\n", "depth", "depth: x", "time: \"1\""); }),
              Not(HasSubstr("did you mean")));
}

TEST_F(TableImportTest, KeysWithoutEffectAreRefused) {
  const std::string log = "t,z,h\n0,1,2\n1,1,2\n", head = "sensors:\n  s: {from: log, ";
  const std::pair<std::string, std::string> wrong[] = {
      {"declination: 4\n" + head + "type: heading, fields: {heading: h}}\n",
       "map.yaml:1: declination has no effect, since no heading is magnetic"},
      {"magnetic_model: a.wmm\n" + head + "type: depth, fields: {depth: z}}\n", "magnetic_model has no effect"},
      {"declination: 4\nmagnetic_model: a.wmm\n" + head + "type: heading, north: magnetic, fields: {heading: h}}\n",
       "map.yaml:2: magnetic_model has no effect beside declination"},
      {"water: {density: 1000}\n" + head + "type: depth, fields: {depth: z}}\n", "water has no effect"},
      {head + "type: depth, north: magnetic, fields: {depth: z}}\n", "map.yaml:2: north has no effect"},
      {head + "type: heading, euler_order: zyx, fields: {heading: h}}\n", "map.yaml:2: euler_order has no effect"},
      {head + "type: depth, covariance: [v], fields: {depth: z}}\n", "has no field 'v'"}};
  for (const auto& entry : wrong)
    EXPECT_THAT(error_of([&] { import(log, entry.first); }), HasSubstr(entry.second)) << entry.first;
  for (const std::string key : {"latitude: 91", "gravity: 981"})
    EXPECT_THAT(error_of([&] {
                  write_import(
                      import("t,x\n0,0\n1,1\n", key + "\nsensors:\n"
                                                      "  o: {type: odometry, from: log, fields: {position: [x, "
                                                      "=0, =0], yaw: =0}}\n"
                                                      "  p: {type: position, from: log, fields: {position: [x, "
                                                      "=0, =0]}}\n"),
                      scenario());
                }),
                AllOf(HasSubstr("map.yaml:1"), HasSubstr("outside")));
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

TEST(RecordedTime, ReadsTheFormsOfSpreadsheetsAndLoggers) {
  constexpr double kTime = 1732600000;  // 2024-11-26T05:46:40Z
  for (const char* text : {"26.11.2024 05:46:40", "26-Nov-2024 05:46:40", "26/november/2024 5:46:40 AM",
                           "26 Nov 2024 05:46:40 GMT", "2024-11-26 05:46:40 UTC", "2024-11-26 07:46:40 +0200",
                           "20241126 054640", "20241126T05:46:40Z", "20241126_054640", "20241126054640Z"})
    EXPECT_EQ(parse_time_text(text), kTime) << text;
  for (const char* text : {"26/11/2024 05:46:40", "26-11-2024, 05:46:40", "26/11/2024  5:46:40 am"}) {
    EXPECT_EQ(parse_time_text(text, DateOrder::dmy), kTime) << text;
    EXPECT_EQ(parse_time_text(text, DateOrder::mdy), std::nullopt) << text;
    EXPECT_EQ(parse_time_text(text), std::nullopt) << text;
  }
  EXPECT_EQ(parse_time_text("11/26/2024 05:46:40", DateOrder::mdy), kTime);
  EXPECT_EQ(parse_time_text("11/26/2024 5:46:40 PM", DateOrder::mdy), kTime + 43200);
  EXPECT_EQ(parse_time_text("12:00:01 AM"), 1);
  EXPECT_EQ(parse_time_text("12:00:01 pm"), 43201);
  for (const char* text : {"13:00:00 PM", "0:00:00 AM", "26-Nox-2024", "26/11-2024", "26 11 2024", "20241326 054640"})
    EXPECT_EQ(parse_time_text(text, DateOrder::dmy), std::nullopt) << text;
  EXPECT_EQ(seconds_by_magnitude(20241126054640), kTime);
  EXPECT_EQ(seconds_by_magnitude(1732600000000), kTime);
}

TEST_F(TableImportTest, AValueAboveTwelveTellsTheOrderOfDayAndMonth) {
  const auto table = [](const std::string& first, const std::string& second) {
    return "time,z\n" + first + " 23:59:59,1\n" + second + " 00:00:01,1\n";
  };
  const auto depth = [&](const std::string& log, const std::string& more = "") {
    return import(log, "depth", "depth: z", more);
  };
  constexpr double kMidnight = 1733788800;  // 2024-12-10
  EXPECT_THAT(times(depth(table("26/11/2024", "10/12/2024"))), ElementsAre(1732665599, kMidnight + 1));
  const Import american = depth(table("12/09/2024", "12/10/2024") + "12/26/2024 00:00:00,1\n");
  EXPECT_THAT(times(american), ElementsAre(kMidnight - 1, kMidnight + 1, 1735171200));
  EXPECT_THAT(american.assumptions, Contains(HasSubstr("dates are month/day/year")));
  const std::string ambiguous = table("09/12/2024", "10/12/2024");
  EXPECT_THAT(error_of([&] { depth(ambiguous); }),
              AllOf(HasSubstr("'09/12/2024 23:59:59'"), HasSubstr("give tables: {date_order: dmy}")));
  EXPECT_THAT(times(depth(ambiguous, "tables: {date_order: dmy}")), ElementsAre(kMidnight - 1, kMidnight + 1));
  EXPECT_THAT(error_of([&] { depth(ambiguous, "tables: {date_order: ymd}"); }),
              HasSubstr("dmy (day/month/year) or mdy"));
  EXPECT_THAT(times(depth("Date,Time,z\n11/26/2024,5:46:40 AM,1\n11/26/2024,5:46:41 AM,1\n")),
              ElementsAre(1732600000, 1732600001));
  EXPECT_THAT(error_of([&] { depth("Date,Time,z\n12/10/2024,05:46:40,1\n"); }), HasSubstr("Date has the date"));
}

TEST_F(TableImportTest, NumbersMayBeDatesOrDaysOfASpreadsheet) {
  const Import packed = import("utc,z\n20241126054640,1\n20241126054641,1\n", "depth", "depth: z");
  EXPECT_THAT(times(packed), ElementsAre(1732600000, 1732600001));
  const auto recording = open_recording(scratch_.write("ms.csv", "t,z\n1732600000000,1\n1732600000500,1\n"));
  EXPECT_EQ(recording->streams()[0].last - recording->streams()[0].first, 0.5);
  const std::string days = "t,z\n45622.240740,1\n45622.240752,1\n45622.240764,1\n";
  EXPECT_THAT(
      import(days, "depth", "depth: z").findings,
      ElementsAre("s: the times in t look like days since 1899-12-30, as spreadsheets count; give time: {field: "
                  "t, unit: days, offset: -2209161600}"));
  const Import read = import(days, "depth", "depth: z", "time: {field: t, unit: days, offset: -2209161600}");
  EXPECT_NEAR(times(read)[0], 1732600000, 1);
  EXPECT_THAT(read.findings, IsEmpty());
  EXPECT_THAT(import("t,z\n45622.0,1\n45622.5,1\n45623.0,1\n", "depth", "depth: z").findings, IsEmpty());
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

TEST_F(TableImportTest, QuotedCellsMayHaveLineBreaks) {
  const Import result = import("t,note,z\n0,\"a\n\"\"b\"\"\n,c\",1\n1,5\" pipe,2\nx,ok,2\n", "depth", "depth: z");
  EXPECT_THAT(times(result), ElementsAre(0, 1));
  EXPECT_EQ(result.sensors[0]->dropped().at("no time").example, "line 6, t is 'x'");
  EXPECT_THAT(result.defects, IsEmpty());
  std::string open = "t,note,z\n0,\"a,1\n";
  for (int i = 1; i < 200; ++i) open += std::to_string(i) + ",b,1\n";
  const Import unclosed = import(open, "depth", "depth: z");
  EXPECT_EQ(unclosed.sensors[0]->rows(), 199u);
  EXPECT_THAT(unclosed.defects, ElementsAre(HasSubstr("line 2: a quoted cell is not closed within")));
}

TEST_F(TableImportTest, TheTableBeginsAfterOtherLines) {
  const std::string table = "time,z,note\n0,1,\n1,2,ok\n2,3,\n";
  for (const std::string before : {"Logger 12\nSerial, 77\n\n", "Start, 2024-11-26, 05:46, x\n"}) {
    const Import result = import(before + table, "depth", "depth: z");
    EXPECT_THAT(times(result), ElementsAre(0, 1, 2));
    EXPECT_EQ(result.sensors[0]->dropped().size(), 0u);
    const auto first = std::count(before.begin(), before.end(), '\n') + 1;
    EXPECT_THAT(result.format, HasSubstr("begins at line " + std::to_string(first)));
  }
  EXPECT_EQ(import(table, "depth", "depth: z").format, "table");
  EXPECT_EQ(import("1,2\n3,4,5\n4,5,6\n5,6,7\n", "depth", "depth: \"2\"", "time: \"1\"").sensors[0]->read(), 4u)
      << "rows of numbers are no other lines";
}

TEST_F(TableImportTest, TimesWithoutUnitAreNamedByTheirMagnitude) {
  const auto assumed = [&](const std::string& t, const std::string& more = "") {
    return import("t,z\n" + t + ",1\n", "depth", "depth: z", more).assumptions;
  };
  EXPECT_THAT(assumed("5"), Contains("s: times are in seconds"));
  EXPECT_THAT(assumed("1732600000000"), Contains("s: times are in ms, by their magnitude"));
  EXPECT_THAT(assumed("1732600000000000000"), Contains("s: times are in ns, by their magnitude"));
  EXPECT_THAT(assumed("2024-11-26 05:46:40"), Not(Contains(HasSubstr("times are in"))));
  EXPECT_THAT(error_of([&] { assumed("5", "time: receive"); }),
              HasSubstr("no receive time, since the recording has none"));
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

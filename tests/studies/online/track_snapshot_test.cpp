#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/online/track_snapshot.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

/// Returns a rotation whose quaternion has norm 1 exactly, so that normalising it again does not change it.
SO3 turned(double by) { return SO3(SO3::Quaternion(by < 0 ? -0.5 : 0.5, 0.5, 0.5, by > 0.7 ? -0.5 : 0.5)); }

TrackSnapshot full_snapshot() {
  TrackSnapshot s;
  s.scenario = "small";
  s.streams = {"ENU-FLU", "usbl (t,x,y,z)"};
  s.t = 12.5;
  s.chaser = SE3(turned(1), {1, 2, 3});
  s.start = Alignment{.t = 3.25};
  s.start->state = {SE3(turned(2), {4, 5, 6}), {0.1, 0.2, 0.3}, (Vector<6>() << 1, 2, 3, 4, 5, 6).finished()};
  s.start->sigmas = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, (Vector<6>() << 6, 5, 4, 3, 2, 1).finished()};
  s.lines = {{1.5, 0, true, Stamped<SE3>{1.5, SE3(turned(0.5), {0.1, 1e300, -1e-300})}},
             {2.5, 1, false, ImuSample{2.5, {1, 2, 9.81}, {0.1, 0.2, 0.3}}},
             {3.5, 2, false, EgoMeasurement{3.5, {3, 2, 1}, turned(0.25)}},
             {4.5, 3, false, Measurement{4.5, {7, 8, 9}, turned(-1), 10, 0.5, -0.25, false, 2}}};
  s.feed.rows = {3, 0, 7};
  s.feed.clocks = {99.5, -HUGE_VAL, {{1e-9, -3600, 12.25, 0.1, 0.01, 1}, {}}};
  s.feed.rejected_lines = {{{"usbl", "repeats a time"}, 3}};
  s.health.sensors = {{"usbl", 5, 2, 1, 12.0, 11.5, 0.75}, {"optical", 0, 0, 0, {}, {}, {}}};
  s.health.sensors[0].innovations = {{3, 1.5, 5.25, 2.125, 0.5, -0.25}, {}};
  s.health.sensors[0].worst = {{12, 1, -2.5}};
  s.health.resets = 2;
  s.health.suspensions = 1;
  s.health.converged = false;
  s.health.unconverged_since = 11;
  s.hypotheses = {7.5, {1, -0.5, 1e-300, 1e300}};
  s.faulty_intervals = {5, 2, true, FaultyIntervalDetector::Interval{10, 12, true}, {}};
  s.num_lines = 1234;
  s.not_converged = 7;
  s.first = 0.5;
  s.last = 13;
  s.seconds = 42;
  s.rejected_lines = {{{"usbl", "rejected by the gate"}, 2}};
  s.partial = {"0123abc", {1, 2, std::uintmax_t(1) << 40}, 17};
  return s;
}

TEST(TrackSnapshot, RestoresAllFields) {
  const TrackSnapshot s = full_snapshot(), back = parse_snapshot(bytes_of(s), "file");
  EXPECT_TRUE(bytes_of(back) == bytes_of(s)) << "all fields are read and written";
  EXPECT_EQ(back.scenario, s.scenario);
  EXPECT_EQ(back.streams, s.streams);
  EXPECT_EQ(back.t, s.t);
  ASSERT_TRUE(back.start);
  EXPECT_EQ(back.chaser.translation(), s.chaser.translation());
  EXPECT_EQ(back.start->state.bias, s.start->state.bias);
  EXPECT_EQ(back.start->sigmas.bias, s.start->sigmas.bias);
  ASSERT_EQ(back.lines.size(), s.lines.size());
  for (std::size_t i = 0; i < s.lines.size(); ++i) {
    EXPECT_EQ(back.lines[i].t, s.lines[i].t);
    EXPECT_EQ(back.lines[i].stream, s.lines[i].stream);
    EXPECT_EQ(back.lines[i].time_reset, s.lines[i].time_reset);
    EXPECT_EQ(back.lines[i].data.index(), i);
    std::visit([&](const auto& data) { EXPECT_EQ(data.t, s.lines[i].t); }, back.lines[i].data);
  }
  EXPECT_EQ(std::get<0>(back.lines[0].data).value.translation(), Vector<3>(0.1, 1e300, -1e-300));
  EXPECT_EQ(std::get<1>(back.lines[1].data).specific_force, Vector<3>(1, 2, 9.81));
  EXPECT_EQ(std::get<2>(back.lines[2].data).value, Vector<3>(3, 2, 1));
  EXPECT_EQ(std::get<3>(back.lines[3].data).height, 2);
  EXPECT_EQ(back.feed.rows, s.feed.rows);
  EXPECT_EQ(back.feed.clocks.base, -HUGE_VAL);
  EXPECT_EQ(back.feed.clocks.streams[0].offset, -3600);
  EXPECT_FALSE(back.feed.clocks.streams[1].last);
  EXPECT_EQ(back.feed.rejected_lines, s.feed.rejected_lines);
  ASSERT_TRUE(back.hypotheses);
  EXPECT_EQ(back.hypotheses->t, 7.5);
  EXPECT_EQ(back.hypotheses->numbers, s.hypotheses->numbers);
  EXPECT_EQ(back.health.sensors[0].sigmas, 0.75);
  ASSERT_EQ(back.health.sensors[0].innovations.size(), 2u);
  EXPECT_EQ(back.health.sensors[0].innovations[0].n, 3u);
  EXPECT_EQ(back.health.sensors[0].innovations[0].products, 2.125);
  EXPECT_EQ(back.health.sensors[0].innovations[0].last, -0.25);
  ASSERT_EQ(back.health.sensors[0].worst.size(), 1u);
  EXPECT_EQ(back.health.sensors[0].worst[0].component, 1u);
  EXPECT_EQ(back.health.sensors[0].worst[0].residual, -2.5);
  EXPECT_EQ(back.faulty_intervals.now->since, 10);
  EXPECT_FALSE(back.faulty_intervals.longest);
  EXPECT_EQ(back.partial.sizes, s.partial.sizes);
  EXPECT_EQ(back.partial.records, 17u);
}

TEST(TrackSnapshot, RejectsInvalidFiles) {
  const std::string good = bytes_of(full_snapshot());
  const auto why = [](const std::string& bytes) { return error_of([&] { parse_snapshot(bytes, "FILE"); }); };
  EXPECT_EQ(why(""), "FILE is not a snapshot of tandem track");
  EXPECT_EQ(why("t,x,y,z\n"), "FILE is not a snapshot of tandem track");
  std::string other = good;
  other[other.find('\n') - 1] = '9';
  EXPECT_THAT(why(other), HasSubstr("another version of tandem"));
  for (std::size_t cut = good.find('\n') + 1; cut < good.size(); cut += 7)
    EXPECT_THAT(why(good.substr(0, cut)), HasSubstr("FILE: the snapshot is damaged")) << cut;
  for (std::size_t at = good.find('\n') + 1; at < good.size(); at += 7) {
    std::string corrupt = good;
    corrupt[at] ^= 0x10;
    EXPECT_THAT(why(corrupt), HasSubstr("FILE: the snapshot is damaged")) << at;
  }
}

/// A file with the right checksum may still be from an untrusted source.
TEST(TrackSnapshot, RejectsInvalidValues) {
  const auto why = [](auto change) {
    TrackSnapshot s = full_snapshot();
    change(s);
    return error_of([&] { parse_snapshot(bytes_of(s), "FILE"); });
  };
  const auto invalid = HasSubstr("FILE: the snapshot has invalid contents; move the file away");
  EXPECT_THAT(why([](TrackSnapshot& s) { s.t = HUGE_VAL; }), invalid);
  EXPECT_THAT(why([](TrackSnapshot& s) { s.lines[2].t = HUGE_VAL; }), invalid);
  EXPECT_THAT(why([](TrackSnapshot& s) { s.health.sensors[0].sigmas = std::nan(""); }), invalid);
  EXPECT_THAT(why([](TrackSnapshot& s) { s.feed.clocks.streams[0].unit = 0; }), invalid);
  EXPECT_THAT(why([](TrackSnapshot& s) { s.feed.clocks.streams[0].agreeing = -1; }), invalid);
  EXPECT_THAT(why([](TrackSnapshot& s) { s.partial.run = "../../x"; }), invalid);
  EXPECT_THAT(why([](TrackSnapshot& s) { s.partial.records = ~std::size_t(0); }), invalid);
  EXPECT_THAT(why([](TrackSnapshot& s) { s.chaser = SE3(SO3(), {1, HUGE_VAL, 3}); }), invalid);
}

TEST(TrackSnapshot, RejectsOtherScenarios) {
  const ScratchFolder scratch;
  write_small_scenario(scratch);
  const Scenario settings = read_settings(scratch.path(), RowsIn::files);
  EXPECT_FALSE(read_snapshot(scratch.path() / "none", settings));
  TrackSnapshot s = full_snapshot();
  const auto file = scratch.write("s", bytes_of(s));
  EXPECT_THAT(error_of([&] { read_snapshot(file, settings); }),
              HasSubstr("s is a snapshot of 'small' with ENU-FLU and "));
  const FeedStreams streams(settings);
  s.streams = streams_of(settings, streams);
  EXPECT_THAT(error_of([&] { read_snapshot(scratch.write("s", bytes_of(s)), settings); }),
              HasSubstr("invalid contents"))
      << "lines of other streams";
  s.lines.resize(1);
  s.feed.clocks.streams.resize(streams.all().size());
  EXPECT_TRUE(read_snapshot(scratch.write("s", bytes_of(s)), settings));
  s.scenario = "another";
  EXPECT_THAT(error_of([&] { read_snapshot(scratch.write("s", bytes_of(s)), settings); }), HasSubstr("of 'another'"));
  EXPECT_THAT(error_of([&] { read_snapshot(scratch.path(), settings); }), HasSubstr("is a folder, not a file"));
}

}  // namespace
}  // namespace tandem

#include <atomic>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <tandem/studies/online/online_feed.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

std::vector<std::string> arrivals(OnlineFeed& feed) {
  std::vector<std::string> lines;
  while (const auto line = feed.next())
    lines.push_back(feed.streams().all()[line->stream].name + " " + std::to_string(line->t).substr(0, 4));
  return lines;
}

/// A file descriptor from which a text can be read.
class Input {
 public:
  explicit Input(const std::string& text) : file_(std::tmpfile()) {
    std::fwrite(text.data(), 1, text.size(), file_);
    std::fflush(file_);
    lseek(descriptor(), 0, SEEK_SET);
  }
  ~Input() { std::fclose(file_); }
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;
  int descriptor() const { return fileno(file_); }

 private:
  std::FILE* file_;
};

class OnlineFeedTest : public testing::Test {
 protected:
  OnlineFeedTest() { write_small_scenario(folder_); }

  Scenario settings(RowsIn rows = RowsIn::files) const { return read_settings(folder_.path(), rows); }

  ScratchFolder folder_;
};

TEST_F(OnlineFeedTest, ReadsSettingsWithoutRows) {
  const Scenario all = read_scenario(folder_.path()), only = settings();
  EXPECT_TRUE(only.data.odometry.empty());
  EXPECT_FALSE(only.has_truth());
  ASSERT_EQ(only.data.sensors.size(), all.data.sensors.size());
  for (std::size_t i = 0; i < all.data.sensors.size(); ++i) {
    EXPECT_TRUE(only.data.sensors[i].measurements.empty());
    EXPECT_EQ(only.data.sensors[i].name, all.data.sensors[i].name);
    EXPECT_EQ(only.data.sensors[i].sigma, all.data.sensors[i].sigma);
  }
  EXPECT_EQ(only.data.noise.constant_twist, all.data.noise.constant_twist);
  EXPECT_EQ(only.data.keyframe_interval, all.data.keyframe_interval);
}

TEST_F(OnlineFeedTest, MergesFilesByTime) {
  FolderFeed feed(settings());
  EXPECT_THAT(arrivals(feed),
              ElementsAre("odometry 0.00", "odometry 1.00", "usbl 1.00", "odometry 2.00", "optical 2.00",
                          "odometry 3.00", "optical 3.00", "odometry 4.00", "usbl 4.50", "odometry 5.00"));
  EXPECT_TRUE(feed.rejected_lines().counts().empty());
}

/// Streams quote names like the CSV files that Tandem writes.
TEST_F(OnlineFeedTest, AcceptsQuotedNames) {
  folder_.write("scenario.yaml",
                read_file(folder_.path() / "scenario.yaml") +
                    "sensors:\n  \"a, \\\"b\\\"\": {type: position, file: usbl.csv, sigma: [1, 1, 1]}\n");
  const Input input("\"a, \"\"b\"\"\",1.0,5,0,0\n\"optical\",2,5,0,0,0,0,0,1\n");
  const std::atomic<bool> stop{false};
  std::vector<std::string> warnings;
  StreamFeed feed(settings(RowsIn::stream), input.descriptor(), "input", stop,
                  [&](const std::string& warning) { warnings.push_back(warning); });
  EXPECT_THAT(arrivals(feed), ElementsAre("a, \"b\" 1.00", "optical 2.00"));
  EXPECT_THAT(warnings, testing::IsEmpty());
}

TEST_F(OnlineFeedTest, ParsesFilesAndStreamsAlike) {
  folder_.write("scenario.yaml", read_file(folder_.path() / "scenario.yaml") + "frame: NED-FRD\n");
  const Input input("odometry,1,1,2,3,0,0,0.6,0.8\nusbl,1,5,1,2\noptical, 2 , 5,1,-2, 0.1,0,0,0.99498743710662\n");
  const std::atomic<bool> stop{false};
  StreamFeed stream(settings(RowsIn::stream), input.descriptor(), "here", stop,
                    [](const std::string& text) { FAIL() << text; });
  folder_.write("chaser_odometry.tum", "1 1 2 3 0 0 0.6 0.8\n");
  folder_.write("usbl.csv", "t,x,y,z\n1,5,1,2\n");
  folder_.write("optical.csv", "t,x,y,z,qx,qy,qz,qw\n2,5,1,-2,0.1,0,0,0.99498743710662\n");
  FolderFeed files(settings());
  for (int i = 0; i < 3; ++i) {
    const auto a = stream.next(), b = files.next();
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->t, b->t);
    EXPECT_EQ(a->stream, b->stream);
    ASSERT_EQ(a->data.index(), b->data.index());
    if (const auto* m = std::get_if<Measurement>(&a->data)) {
      EXPECT_EQ(m->position, std::get<Measurement>(b->data).position);
      EXPECT_EQ(m->rotation.matrix(), std::get<Measurement>(b->data).rotation.matrix());
      EXPECT_EQ(m->position.y(), -1.0) << "to starboard";
    } else {
      EXPECT_EQ(std::get<Stamped<SE3>>(a->data).value.matrix(), std::get<Stamped<SE3>>(b->data).value.matrix());
      EXPECT_EQ(std::get<Stamped<SE3>>(a->data).value.translation(), Vector<3>(2, 1, -3)) << "east, north, up";
    }
  }
  EXPECT_FALSE(stream.next() || files.next());
}

TEST_F(OnlineFeedTest, UsesLateFixesAndCountsRepeatedOnes) {
  folder_.write("usbl.csv", "t,x,y,z\n1,5,0,0\n0.5,5,0,0\n4.5,5,0,0\n4.5,5,0,0\n4,5,0,0\n0.5,5,0,0\n");
  FolderFeed feed(settings());
  EXPECT_EQ(arrivals(feed).size(), 12u);
  EXPECT_THAT(feed.rejected_lines().counts(),
              ElementsAre(Pair(Pair("usbl", "repeats a time"), 1), Pair(Pair("usbl", "repeats an earlier line"), 1)));
}

TEST_F(OnlineFeedTest, DiscardsSingleTimeJumps) {
  folder_.write("usbl.csv", "t,x,y,z\n1,5,0,0\n1e9,5,0,0\n4.5,5,0,0\n");
  FolderFeed feed(settings());
  EXPECT_EQ(arrivals(feed).size(), 10u);
  EXPECT_THAT(feed.rejected_lines().counts(),
              testing::Contains(Pair(Pair("usbl", "time jumps away from all other streams"), 1)));
  folder_.write("chaser_odometry.tum",
                "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n5000 2 0 0 0 0 0 1\n5001 3 0 0 0 0 0 1\n5002 4 0 0 0 0 0 1\n5003 5 "
                "0 0 0 0 0 1\n5004 6 0 0 0 0 0 1\n");
  folder_.write("usbl.csv", "t,x,y,z\n1,5,0,0\n");
  folder_.write("optical.csv", "t,x,y,z,qx,qy,qz,qw\n");
  FolderFeed later(settings());
  EXPECT_THAT(arrivals(later), ElementsAre("odometry 0.00", "odometry 1.00", "usbl 1.00", "odometry 5000",
                                           "odometry 5001", "odometry 5002", "odometry 5003", "odometry 5004"));
}

TEST_F(OnlineFeedTest, ThrowsOnMalformedLineOfFile) {
  folder_.write("usbl.csv", "t,x,y,z\n1,5,0,0\n2,5,zero,0\n");
  FolderFeed feed(settings());
  EXPECT_THAT(error_of([&] { arrivals(feed); }), HasSubstr("usbl.csv:3: y is 'zero', not a number"));
  folder_.write("usbl.csv", "t,x,y,z\n1,5,0,0\n");
  folder_.write("optical.csv", "t,x,y,z,qx,qy,qz,qw\n2,5,0,0,0,0,0,2\n");
  EXPECT_THAT(error_of([&] { const FolderFeed broken(settings()); }),
              HasSubstr("optical.csv:2: quaternion 0 0 0 2 has norm 2"));
  std::filesystem::remove(folder_.path() / "chaser_odometry.tum");
  EXPECT_THAT(error_of([&] { const FolderFeed broken(settings()); }), HasSubstr("chaser_odometry.tum is missing"));
}

TEST_F(OnlineFeedTest, WarnsOfMalformedLinesOfStream) {
  for (const char* file : {"chaser_odometry.tum", "usbl.csv", "optical.csv"})
    std::filesystem::remove(folder_.path() / file);
  const Input input(
      "# by "
      "hand\r\n\nodometry,0,0,0,0,0,0,0,1\r\nusbk,1,5,0,0\nusbl,1,5,0\nusbl,1,5,0,inf\noptical,1,5,0,0,0,0,0,0.5\n" +
      ("usbl,1,2," + std::string(10'000, '3')) + ",4\nusbl,1,5,0,0");
  std::vector<std::string> warnings;
  const std::atomic<bool> stop{false};
  StreamFeed feed(settings(RowsIn::stream), input.descriptor(), "here", stop,
                  [&](const std::string& text) { warnings.push_back(text); });
  EXPECT_THAT(arrivals(feed), ElementsAre("odometry 0.00", "usbl 1.00"));
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("here:4: unknown sensor 'usbk'; did you mean usbl?"),
                                    HasSubstr("here:5: expected 4 columns (t,x,y,z), found 3"),
                                    HasSubstr("here:6: z is inf; numbers must be finite"),
                                    HasSubstr("here:7: quaternion 0 0 0 0.5 has norm 0.5"),
                                    HasSubstr("here:8: the line is longer than 4096 characters")));
  EXPECT_THAT(feed.rejected_lines().counts(),
              ElementsAre(Pair(Pair("optical", "malformed"), 1), Pair(Pair("unknown", "malformed"), 1),
                          Pair(Pair("usbl", "malformed"), 3)));
}

TEST_F(OnlineFeedTest, SettledLinesOfAllStreamsComeInOrder) {
  std::string text;
  for (const double t : {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0}) {
    text += fmt::format("odometry,{},0,0,0,0,0,0,1\n", t);
    if (t == 4) text += "usbl,1.5,1,0,0\nusbl,3.5,1,0,0\nusbl,2.5,1,0,0\n";
  }
  const Input input(text);
  const std::atomic<bool> stop{false};
  StreamFeed feed(settings(RowsIn::stream), input.descriptor(), "here", stop,
                  [](const std::string& why) { FAIL() << why; });
  feed.set_settling_time(3);
  EXPECT_THAT(arrivals(feed),
              ElementsAre("odometry 0.00", "odometry 1.00", "usbl 1.50", "odometry 2.00", "usbl 2.50", "odometry 3.00",
                          "usbl 3.50", "odometry 4.00", "odometry 5.00", "odometry 6.00"));
}

TEST_F(OnlineFeedTest, OdometrySettlesToo) {
  std::string text;
  for (const double t : {0.0, 2.0, 1.0, 4.0, 3.0, 3.0, 5.0, 6.0, 7.0, 8.0, 4.5, 9.0})
    text += fmt::format("odometry,{},0,0,0,0,0,0,1\n", t);
  const Input input(text);
  const std::atomic<bool> stop{false};
  StreamFeed feed(settings(RowsIn::stream), input.descriptor(), "here", stop,
                  [](const std::string& why) { FAIL() << why; });
  feed.set_settling_time(3);
  EXPECT_THAT(arrivals(feed),
              ElementsAre("odometry 0.00", "odometry 1.00", "odometry 2.00", "odometry 3.00", "odometry 4.00",
                          "odometry 5.00", "odometry 6.00", "odometry 7.00", "odometry 8.00", "odometry 9.00"));
  EXPECT_THAT(feed.rejected_lines().counts(), ElementsAre(Pair(Pair("odometry", "time runs backwards"), 2)))
      << "one repeats a time, one is later than the settling time";
}

TEST_F(OnlineFeedTest, StopsWaitingOnRequest) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  std::atomic<bool> stop{true};
  StreamFeed feed(settings(RowsIn::stream), ends[0], "here", stop, [](const std::string&) {});
  EXPECT_FALSE(feed.next()) << "although the other end is open";
  close(ends[0]);
  close(ends[1]);
}

TEST_F(OnlineFeedTest, ReadsStreamsOfOwnSensors) {
  folder_.write("scenario.yaml",
                "frame: NED-FRD\n"
                "sensors:\n"
                "  imu: {type: imu, file: imu.csv, accelerometer: 1.0e-3, gyroscope: 2.0e-4,\n"
                "        accelerometer_bias_walk: 5.0e-5, gyroscope_bias_walk: 2.0e-6}\n"
                "  depth: {type: depth, file: depth.csv, sigma: [0.1]}\n");
  for (const char* file : {"chaser_odometry.tum", "usbl.csv", "optical.csv"})
    std::filesystem::remove(folder_.path() / file);
  const Input input("imu,0.01,1,2,3,4,5,6\ndepth,0.01,7\n");
  const std::atomic<bool> stop{false};
  StreamFeed feed(settings(RowsIn::stream), input.descriptor(), "here", stop,
                  [](const std::string& text) { FAIL() << text; });
  const auto imu = feed.next(), depth = feed.next();
  ASSERT_TRUE(imu && depth);
  EXPECT_EQ(std::get<ImuSample>(imu->data).specific_force, Vector<3>(1, -2, -3));
  EXPECT_EQ(std::get<ImuSample>(imu->data).angular_rate, Vector<3>(4, -5, -6));
  EXPECT_EQ(std::get<EgoMeasurement>(depth->data).value.z(), -7.0);
}

}  // namespace
}  // namespace tandem

#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/live/track.hpp>
#include <tandem/studies/live/track_report.hpp>

#include "fault_list.hpp"
#include "shared_data.hpp"

/// Every fault on every recording: what is tracked stays finite, and after 30 s of good data it is as near to the truth as
/// if nothing had been.
namespace tandem::faults {
namespace {

using ::testing::HasSubstr;

constexpr double kRecovery = 30;  // s
constexpr double kRatio = 1.5;

struct Tracked {
  struct Sample {
    double t, error;
  };
  std::vector<Sample> errors;  // of the newest state, m
  std::string told;            // notices, complaints and why lines were refused
  std::size_t most_keyframes = 0;
  bool finite = true;
  std::size_t resets = 0, suspensions = 0;
};

/// The mean over the keyframes that are later than `from` s; nothing without one.
std::optional<double> mean_error(const Tracked& run, double from) {
  double sum = 0;
  int n = 0;
  for (const Tracked::Sample& sample : run.errors)
    if (sample.t > from) {
      sum += sample.error;
      ++n;
    }
  if (n == 0) return {};
  return sum / n;
}

Tracked run_lines(const Recording& recording, const std::string& text) {
  Tracked run;
  const Scenario settings = read_settings(recording.settings.folder, RowsIn::stream);
  LiveOptions options;
  options.online.lag.max_iterations = 12;
  const auto tell = [&](const std::string& sentence) { run.told += sentence + "\n"; };
  options.tell = tell;
  const std::atomic<bool> stop{false};
  std::size_t given = 0;
  StreamFeed feed(
      settings,
      [&](std::string& to) {
        const std::size_t n = std::min<std::size_t>(4096, text.size() - given);
        to.append(text, given, n);
        given += n;
        return n > 0;
      },
      "feed", stop, tell);
  const Track track = tandem::track(settings, options, feed, [&](const TrackRecord& record) {
    run.most_keyframes = std::max(run.most_keyframes, record.keyframes);
    run.finite &= record.chaser.translation().allFinite() && (!record.target || record.target->position.allFinite());
    if (!record.new_keyframe) return;
    const TrackError error = track_error(recording.settings, record, options);
    const std::optional<double> size = record.target ? error.relative.position : error.chaser_position;
    if (size) run.errors.push_back({record.t, *size});
  });
  for (const auto& [what, n] : track.refused.counts()) run.told += what.first + ": " + what.second + "\n";
  run.resets = track.health.resets;
  run.suspensions = track.health.suspensions;
  return run;
}

struct Case {
  std::string recording, sensor;
  double from, until;  // s after the first line
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.recording; }

class Faults : public ::testing::TestWithParam<Case> {};

TEST_P(Faults, PassAndLeaveNoMark) {
  TANDEM_NEEDS_SHARED(all_faults().size());
  const Case& c = GetParam();
  const Recording recording(shared_path("data/" + c.recording), c.until);
  const Tracked undisturbed = run_lines(recording, recording.text());
  const Site site{recording.lines.front().t + c.from, recording.motion, c.sensor};
  std::size_t faults = 0;
  for (const Fault& fault : all_faults()) {
    if (fault.odometry_only && recording.motion != "odometry") continue;
    SCOPED_TRACE(fault.name);
    Recording faulty = recording;
    const double until = fault.inject(faulty.lines, site);
    const Tracked run = run_lines(recording, faulty.text());
    EXPECT_TRUE(run.finite);
    EXPECT_LE(run.most_keyframes, 2 * undisturbed.most_keyframes);
    EXPECT_THAT(run.told, HasSubstr(fault.said));
    const auto expected = mean_error(undisturbed, until + kRecovery), found = mean_error(run, until + kRecovery);
    EXPECT_TRUE(expected) << "the recording is too short";
    EXPECT_TRUE(found) << "the track has ended, told: " << run.told.substr(0, 600);
    if (expected && found) {
      EXPECT_LE(*found, kRatio * *expected)
          << run.resets << " resets, " << run.suspensions << " suspensions, told: " << run.told.substr(0, 600);
    }
    ++faults;
  }
  EXPECT_GE(faults, 40u);
}

const auto name_of_case = [](const auto& info) { return info.param.recording; };
INSTANTIATE_TEST_SUITE_P(Simulated, Faults, ::testing::Values(Case{"docking_a", "usbl", 30, 100}), name_of_case);
INSTANTIATE_TEST_SUITE_P(Recorded, Faults,
                         ::testing::Values(Case{"kitti_0020_012", "optical", 12, 64},
                                           Case{"auv_akit_03", "dvl", 40, 90}, Case{"ferry_22_1", "lidar", 31, 74},
                                           Case{"auv_akit_01", "dvl", 40, 90}),
                         name_of_case);

}  // namespace
}  // namespace tandem::faults

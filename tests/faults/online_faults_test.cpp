#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/online/track.hpp>
#include <tandem/studies/online/track_report.hpp>

#include "fault_list.hpp"
#include "shared_data.hpp"

/// Injects each fault into feeds of several recordings. The track must stay finite, and 30 s after the fault it must be
/// as accurate as without it.
namespace tandem::faults {
namespace {

using ::testing::HasSubstr;

constexpr double kRecovery = 30;        // s
constexpr double kMaxErrorRatio = 1.5;  // relative to the error without the fault

struct Tracked {
  struct Sample {
    double t, error;
  };
  std::vector<Sample> errors;  // position errors of the newest states [m]
  std::string messages;        // notices, warnings and rejection reasons
  std::size_t max_keyframes = 0;
  bool finite = true;
  std::size_t resets = 0, suspensions = 0;
};

/// Returns the mean error over the keyframes later than `from` [s], or nothing if there are none.
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
  TrackOptions options;
  options.online.lag.max_iterations = 12;
  const auto add_message = [&](const std::string& sentence) { run.messages += sentence + "\n"; };
  options.on_notice = add_message;
  options.on_rejected_value = [&](const std::string&, const std::string& sentence) { add_message(sentence); };
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
      "feed", stop, add_message);
  const Track track = tandem::track(settings, options, feed, [&](const TrackRecord& record) {
    run.max_keyframes = std::max(run.max_keyframes, record.keyframes);
    run.finite &= record.chaser.translation().allFinite() && (!record.target || record.target->position.allFinite());
    if (!record.new_keyframe) return;
    const TrackError error = track_error(recording.settings, record, options);
    const std::optional<double> size = record.target ? error.relative.position : error.chaser_position;
    if (size) run.errors.push_back({record.t, *size});
  });
  for (const auto& [what, n] : track.rejected_lines.counts()) run.messages += what.first + ": " + what.second + "\n";
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

TEST_P(Faults, TrackRecovers) {
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
    EXPECT_LE(run.max_keyframes, 2 * undisturbed.max_keyframes);
    EXPECT_THAT(run.messages, HasSubstr(fault.expected_message));
    const auto expected = mean_error(undisturbed, until + kRecovery), found = mean_error(run, until + kRecovery);
    EXPECT_TRUE(expected) << "the recording is too short";
    EXPECT_TRUE(found) << "the track has ended, messages: " << run.messages.substr(0, 600);
    if (expected && found) {
      EXPECT_LE(*found, kMaxErrorRatio * *expected)
          << run.resets << " resets, " << run.suspensions << " suspensions, messages: " << run.messages.substr(0, 600);
    }
    ++faults;
  }
  EXPECT_GE(faults, 40u);
}

const auto name_of_case = [](const auto& info) { return info.param.recording; };
INSTANTIATE_TEST_SUITE_P(LongSimulated, Faults, ::testing::Values(Case{"docking_a", "usbl", 30, 100}), name_of_case);
INSTANTIATE_TEST_SUITE_P(Recorded, Faults,
                         ::testing::Values(Case{"kitti_0020_012", "optical", 12, 64},
                                           Case{"auv_akit_03", "dvl", 40, 90}, Case{"ferry_22_1", "lidar", 31, 74},
                                           Case{"auv_akit_01", "dvl", 40, 90}),
                         name_of_case);

}  // namespace
}  // namespace tandem::faults

#include <algorithm>
#include <array>
#include <utility>

#include <tandem/studies/online/online_feed.hpp>

#include "fuzz/input.hpp"

namespace {

using namespace tandem;

Scenario settings(const std::string& yaml) { return read_settings(yaml, "/", RowsIn::stream); }

/// Three scenarios: with odometry, planar, and in NED with the chaser's own sensors and a target.
const std::array<Scenario, 3>& scenarios() {
  static const std::array<Scenario, 3> all = {
      settings("name: by odometry\n"
               "noise: {prior: [1, 1, 1, 1, 1, 1], odometry: [1, 1, 1, 1, 1, 1], constant_twist: [1, 1, 1, 1, 1, 1],\n"
               "  usbl: [1, 1, 1], optical: [1, 1, 1, 1, 1, 1]}\n"
               "sensors:\n"
               "  sonar: {type: range_bearing, file: sonar.csv, sigma: [1, 1, 1]}\n"
               "  ping: {type: range, file: ping.csv, sigma: 1}\n"),
      settings("name: planar\n"
               "group: SE2\n"
               "noise: {prior: [1, 1, 1], odometry: [1, 1, 1], constant_twist: [1, 1, 1], usbl: [1, 1]}\n"
               "sensors:\n"
               "  camera: {type: bearing, file: camera.csv, sigma: 1}\n"),
      settings("name: own sensors\n"
               "frame: NED-FRD\n"
               "noise: {constant_twist: [1, 1, 1, 1, 1, 1]}\n"
               "sensors:\n"
               "  imu: {type: imu, file: imu.csv, accelerometer: 1, gyroscope: 1, accelerometer_bias_walk: 1,\n"
               "    gyroscope_bias_walk: 1}\n"
               "  dvl: {type: dvl, file: dvl.csv, sigma: [1, 1, 1]}\n"
               "  depth: {type: depth, file: depth.csv, sigma: 1}\n"
               "  gps: {type: gps, file: gps.csv, sigma: [1, 1, 1]}\n"
               "  heading: {type: heading, file: heading.csv, sigma: [1, 1, 1]}\n"
               "  usbl2: {type: usbl_spherical, file: usbl2.csv, sigma: [1, 1, 1]}\n")};
  return all;
}

}  // namespace

// Input of tandem track --stdin. The first byte selects the scenario, the second one the size of the portions.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const Scenario& scenario = scenarios()[input.below(scenarios().size())];
  const std::size_t portion = input.byte() + std::size_t(1);
  const std::string text = input.text();
  std::size_t given = 0;
  const auto more = [&](std::string& to) {
    const std::size_t n = std::min(portion, text.size() - given);
    to.append(text, std::exchange(given, given + n), n);
    return n > 0;
  };

  const std::atomic<bool> stop = false;
  std::size_t warnings = 0, taken = 0;
  StreamFeed feed(scenario, more, "<stdin>", stop, [&](const std::string& warning) {
    ++warnings;
    fuzz::expect(fuzz::is_printable(warning), "a warning is one printable line");
  });
  while (const auto line = feed.next()) {
    ++taken;
    fuzz::expect(line->stream < feed.streams().all().size(), "a line belongs to a stream");
  }
  std::size_t rejected = 0;
  for (const auto& [why, n] : feed.rejected_lines().counts()) rejected += n;
  const auto lines = std::size_t(std::count(text.begin(), text.end(), '\n')) + 1;
  fuzz::expect(given == text.size() && taken + rejected <= lines, "everything is read, and no line is counted twice");
  fuzz::expect(warnings <= rejected, "each warning belongs to a rejected line");
  return 0;
}

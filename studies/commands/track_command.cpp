#include <algorithm>
#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/track_command.hpp>
#include <tandem/studies/live/track.hpp>
#include <tandem/studies/live/track_files.hpp>
#include <tandem/studies/live/track_lines.hpp>
#include <tandem/studies/live/track_report.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_folder.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// An update: fixes after a gap, when the target may have turned meanwhile, take more than those that follow one another.
constexpr int kIterations = 12;

double parse_positive(const std::string& option, const std::string& text) {
  const double value = parse_magnitude(option, text);
  if (value <= 0) throw Error(fmt::format("{} is above zero, not {}", option, quote(text)));
  return value;
}

TrackOptions options_of(const TrackArguments& arguments) {
  TrackOptions options;
  TrackingArguments tracking = arguments.tracking;
  if (!tracking.limits && (tracking.surge || tracking.yaw_rate)) tracking.limits = "soft";
  options.online.tracking = tracking_options(tracking);
  options.online.ego.loss = options.online.tracking.loss;
  options.online.ego.dvl_scale = arguments.dvl_scale;
  FixedLagOptions& lag = options.online.lag;
  lag.max_iterations = kIterations;
  if (arguments.keyframes) {
    lag.max_keyframes = parse_count("--keyframes", *arguments.keyframes);
    if (lag.max_keyframes < 3) throw Error("--keyframes is 3 or more: the target's motion ties three keyframes");
    lag.window = HUGE_VAL;
  }
  if (arguments.window) lag.window = parse_positive("--window", *arguments.window);
  if (arguments.iterations) lag.max_iterations = parse_count("--iterations", *arguments.iterations);
  if (arguments.alignment) options.online.alignment = parse_positive("--alignment", *arguments.alignment);
  if (arguments.predict) {
    options.ahead.clear();
    for (const std::string_view part : split(*arguments.predict, ','))
      options.ahead.push_back(parse_positive("--predict", std::string(part)));
  }
  if (arguments.until) options.until = parse_magnitude("--until", *arguments.until);
  options.realtime = arguments.realtime;
  options.stop = &interrupted();
  if (arguments.realtime && arguments.standard_input)
    throw Error("--realtime is for a folder's files: lines of --stdin come at their own pace");
  return options;
}

/// Options about a target need one, those about the chaser's own sensors need these.
void check(const Scenario& settings, const TrackArguments& arguments) {
  const TrackingArguments& t = arguments.tracking;
  for (const auto& [option, given] : {std::pair{"--mode", t.mode.has_value()},
                                      {"--model", t.model.has_value()},
                                      {"--junction", t.junction.has_value()},
                                      {"--roll-pitch", t.roll_pitch.has_value()},
                                      {"--non-holonomic", t.non_holonomic.has_value()},
                                      {"--surge", t.surge.has_value()},
                                      {"--yaw-rate", t.yaw_rate.has_value()},
                                      {"--predict", arguments.predict.has_value()}})
    if (given && settings.data.sensors.empty())
      throw Error(fmt::format("{} is about a target, and {} has no sensor that sees one", option, t.scenario));
  const bool own = !moves_by_odometry(settings);
  if (arguments.alignment && !own)
    throw Error(
        fmt::format("--alignment is about the chaser's own sensors, and in {} it moves by odometry", t.scenario));
  const auto is_dvl = [](const EgoSensor& sensor) { return sensor.type == EgoSensorType::dvl; };
  if (arguments.dvl_scale &&
      !(own && std::any_of(settings.navigation->sensors.begin(), settings.navigation->sensors.end(), is_dvl)))
    throw Error(fmt::format("--dvl-scale needs a dvl by which the chaser moves, and {} has none", t.scenario));
}

std::unique_ptr<LiveFeed> feed_of(const Scenario& settings, bool standard_input) {
  if (!standard_input) return std::make_unique<FolderFeed>(settings);
  return std::make_unique<StreamFeed>(
      settings, STDIN_FILENO, "standard input", interrupted(),
      [](const std::string& complaint) { fmt::print(stderr, "tandem: {}; the line is left out\n", complaint); });
}

}  // namespace

int run_track(const TrackArguments& arguments) {
  const TrackOptions options = options_of(arguments);
  std::optional<OutputFolder> out;
  if (arguments.out) out.emplace(*arguments.out);
  Scenario scenario = settings_with(arguments.tracking, arguments.standard_input ? RowsIn::stream : RowsIn::files);
  check(scenario, arguments);
  const std::unique_ptr<LiveFeed> feed = feed_of(scenario, arguments.standard_input);

  stop_on_interrupt();
  const bool print = !arguments.quiet && !arguments.json;
  TrackLines lines(scenario.frame, !scenario.data.sensors.empty(), scenario.data.planar);
  const Track result = track(scenario, options, *feed, [&](const TrackRecord& record) {
    if (!print) return;
    const std::string text = lines(record);
    if (text.empty()) return;
    fmt::print("{}", text);
    std::fflush(stdout);
  });
  if (result.records.size() == 0) {
    fmt::print(stderr, "tandem: {}{}\n",
               result.interrupted ? "interrupted before there was anything to track" : "nothing could be tracked: ",
               result.interrupted ? ""
               : result.has_target
                   ? "no measurement gives the position of the target while the chaser's motion is known"
                   : "the chaser's own sensors say too little to start from");
    return 2;
  }

  read_truth(scenario);
  const TrackSummary summary = summarise(result, scenario, options);
  if (out)
    out->fill({"chaser.tum", "target.tum", "track.csv", "errors.csv", "summary.json"},
              [&](const std::filesystem::path& folder) { write_track(result, summary, scenario, options, folder); });
  if (arguments.json) {
    fmt::print("{}", track_json(result, summary));
  } else if (print) {
    fmt::print("\n{}", track_report(result, summary));
    if (out) fmt::print("\nWritten to {}\n", *arguments.out);
  }
  std::fflush(stdout);
  return 0;
}

}  // namespace tandem

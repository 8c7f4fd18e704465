#include <cerrno>
#include <cstdio>
#include <cstring>
#include <map>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/online/running_track_files.hpp>
#include <tandem/studies/online/track.hpp>
#include <tandem/studies/online/track_files.hpp>
#include <tandem/studies/online/track_json_line.hpp>
#include <tandem/studies/online/track_lines.hpp>
#include <tandem/studies/online/track_report.hpp>
#include <tandem/studies/online/track_snapshot.hpp>
#include <tandem/studies/online/watched_sensors.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Maximum number of iterations of an update. The first fixes after a gap need more than consecutive fixes do.
constexpr int kIterations = 12;

/// Source of the newest target state and of the predictions.
enum class Newest { hypotheses, window };

struct TrackRequest {
  ProblemRequest problem;
  TrackOptions track;
  std::optional<double> window, rate;  ///< s, and of the lines of JSON [Hz]
  std::optional<Newest> newest;
  std::optional<double> stamp_unit;  ///< s
  std::optional<std::filesystem::path> snapshot;
  std::optional<double> every, settle;  ///< s
  bool standard_input = false, json_lines = false;
  std::optional<LineCovariance> covariance;  ///< in the lines of JSON
  Output output;
};

int parse_window_keyframes(const std::string& option, const std::string& text) {
  const int keyframes = parse_count(option, text);
  if (keyframes < 3)
    throw Error(fmt::format("{} takes 3 or more, since the motion model joins three keyframes", option));
  return keyframes;
}

std::vector<double> parse_ahead(const std::string& option, const std::string& text) {
  std::vector<double> seconds;
  for (const std::string_view part : split(text, ',')) seconds.push_back(parse_positive(option, std::string(part)));
  constexpr double kDay = 86400;
  for (const double s : seconds)
    if (s > kDay)
      throw Error(fmt::format("{}: {:g} s is too far ahead; the maximum is a day ({:g} s)", option, s, kDay));
  return seconds;
}

double parse_gate(const std::string& option, const std::string& text) {
  return text == "off" ? HUGE_VAL : parse_positive(option, text);
}

std::optional<double> parse_stamp_unit(const std::string& option, const std::string& text) {
  if (text == "auto") return {};
  for (const auto& [word, seconds] : {std::pair{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}})
    if (text == word) return seconds;
  throw Error(fmt::format("{} takes auto, s, ms, us or ns, not {}", option, quote(text)));
}

/// Parses "M/N", M of N measurements.
std::pair<int, int> parse_fraction(const std::string& option, const std::string& text) {
  const std::vector<std::string_view> parts = split(text, '/');
  const auto rejections = parts.size() == 2 ? parse_positive_integer(parts[0]) : std::nullopt;
  const auto of = parts.size() == 2 ? parse_positive_integer(parts[1]) : std::nullopt;
  if (!rejections || !of || *rejections > *of)
    throw Error(fmt::format("{} takes M/N, M of the last N measurements, e.g. 3/4, not {}", option, quote(text)));
  return {*rejections, *of};
}

/// Checks that the file can be created in its folder.
std::filesystem::path parse_snapshot_file(const std::string& option, const std::string& text) {
  const std::filesystem::path file(text), folder = file.has_parent_path() ? file.parent_path() : ".";
  if (!file.has_filename() || std::filesystem::is_directory(file))
    throw Error(fmt::format("{} takes a file name, but {} is a folder", option, quote(text)));
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    throw Error(
        fmt::format("{} {}: cannot write to {}: {}", option, quote(text), folder.string(), std::strerror(errno)));
  return file;
}

LineCovariance parse_covariance(const std::string& option, const std::string& text) {
  for (const auto& [word, value] :
       {std::pair{"joint", LineCovariance::joint}, {"blocks", LineCovariance::blocks}, {"off", LineCovariance::off}})
    if (text == word) return value;
  throw Error(fmt::format("{} takes joint, blocks or off, not {}", option, quote(text)));
}

Newest parse_newest(const std::string& option, const std::string& text) {
  if (text == "hypotheses") return Newest::hypotheses;
  if (text == "window") return Newest::window;
  throw Error(fmt::format("{} takes hypotheses or window, not {}", option, quote(text)));
}

/// Selects motion hypotheses if they are supported and no target option is given. The window then uses Mode B, since it
/// need not estimate orientations that are not measured. Systematic errors alone exclude the hypotheses but keep Mode
/// B.
void choose_newest(const TrackRequest& request, const Scenario& scenario, bool model_given, OnlineOptions& online) {
  const std::string why_not = why_hypotheses_unsupported(scenario.data, moves_by_odometry(scenario));
  if (request.newest == Newest::hypotheses && !why_not.empty())
    throw Error(fmt::format("{} does not support --newest hypotheses: {}", request.problem.scenario, why_not));
  online.hypotheses = request.newest ? *request.newest == Newest::hypotheses : why_not.empty() && !model_given;
  TrackingData without_errors = scenario.data;
  for (TargetSensor& sensor : without_errors.sensors) sensor.error.reset();
  const bool could = why_hypotheses_unsupported(without_errors, moves_by_odometry(scenario)).empty() && !request.newest;
  if ((online.hypotheses || could) && !model_given) online.tracking.mode = Mode::B;
}

TrackOptions track_options(const TrackRequest& request) {
  TrackOptions options = request.track;
  OnlineOptions& online = options.online;
  online.tracking = tracking_options(request.problem, false);
  const NavigationOptions navigation = navigation_options(request.problem);
  online.ego = navigation.ego;
  online.alignment = navigation.alignment;
  if (online.lag.max_keyframes > 0) online.lag.window = HUGE_VAL;
  if (request.window) online.lag.window = *request.window;
  options.stop = &interrupted();
  if (!request.output.quiet) {
    options.on_notice = LimitedWarnings("notices", warn);
    options.on_rejected_value = [warnings = std::map<std::string, LimitedWarnings>()](
                                    const std::string& sensor, const std::string& sentence) mutable {
      warnings.try_emplace(sensor, "lines of " + printable(sensor) + " rejected", warn).first->second(sentence);
    };
  }
  if (request.json_lines && request.output.json)
    throw Error("--json-lines and --json exclude each other: one line for each update, or one summary");
  if ((request.rate || request.covariance) && !request.json_lines)
    throw Error(fmt::format("{} needs --json-lines", request.rate ? "--rate" : "--covariance"));
  if (request.settle && request.snapshot)
    throw Error("--settle and --snapshot exclude each other: the lines that wait are not in a snapshot");
  if (online.soften_infeasible && online.tracking.non_holonomic != Role::hard &&
      online.tracking.roll_pitch != Role::hard && request.problem.limits != Role::hard)
    throw Error("--soften needs a hard constraint: --limits, --non-holonomic or --roll-pitch hard");
  options.report = request.json_lines;
  options.report_covariance = request.covariance != LineCovariance::off;
  if (options.realtime && request.standard_input)
    throw Error("--realtime and --stdin exclude each other: standard input has its own pace");
  if (request.snapshot && !options.at.empty())
    throw Error("--at and --snapshot exclude each other: a snapshot has no states at given times");
  if (request.every && !request.snapshot) throw Error("--every needs --snapshot");
  if (request.every) options.snapshot_every = *request.every;
  return options;
}

std::unique_ptr<OnlineFeed> feed_of(const Scenario& settings, bool standard_input) {
  if (!standard_input) return std::make_unique<FolderFeed>(settings);
  return std::make_unique<StreamFeed>(
      settings, STDIN_FILENO, "standard input", interrupted(),
      [print = LimitedWarnings("rejected lines", warn)](const std::string& warning) mutable {
        print(warning + "; the line is rejected");
      });
}

/// Returns why there is no estimate at all.
std::string why_no_track(const Track& track) {
  if (track.interrupted) return "interrupted before tracking started";
  return std::string("nothing was tracked: ") +
         (track.has_target ? "no measurement gives the position of the target while the chaser's motion is known"
                           : "the data of the chaser's own sensors do not suffice for an initial state");
}

/// Returns why the track is unreliable, or an empty string.
std::string why_unreliable(const Track& track) {
  if (!track.faulty_interval) return "";
  const std::string what = "no update converged, or all measurements were rejected";
  if (track.faulty_interval->ongoing)
    return fmt::format("the track is unreliable since t = {:.1f} s: {}", track.faulty_interval->since, what);
  return fmt::format("the track was unreliable from t = {:.1f} s to {:.1f} s: {}", track.faulty_interval->since,
                     track.faulty_interval->until, what);
}

/// Runs the command. An interrupt ends it with the summary.
int run_track(const TrackRequest& request, const CommandOptions& option) {
  TrackOptions options = track_options(request);
  Scenario scenario =
      read_problem_settings(request.problem, option, request.standard_input ? RowsIn::stream : RowsIn::files);
  choose_newest(request, scenario, !option.given(kTarget).empty(), options.online);
  const std::unique_ptr<OnlineFeed> feed = feed_of(scenario, request.standard_input);
  if (request.stamp_unit) feed->set_unit(*request.stamp_unit);
  if (request.settle) feed->set_settling_time(*request.settle);
  if (!request.standard_input && !request.output.quiet)
    if (const std::string why = timestamp_overlap_warning(scenario); !why.empty()) warn(why);

  const bool tables = !request.output.quiet && !request.output.json && !request.json_lines;
  RunningTrackFiles files(
      {.snapshot = request.snapshot,
       .partial_results = request.output.folder ? std::optional(request.output.folder->partial()) : std::nullopt,
       .keep_all = request.standard_input,
       .announce = !request.output.quiet,
       .warn = [](const std::string& sentence) { warn(sentence); }},
      scenario, options.ahead);
  if (request.snapshot) options.on_snapshot = [&](TrackSnapshot snapshot) { files.add(std::move(snapshot)); };
  TrackJsonLines json_lines(scenario.frame, names_of_watched_sensors(scenario), options.ahead,
                            request.covariance.value_or(LineCovariance::joint), request.rate);
  TrackLines lines(scenario.frame, !scenario.data.sensors.empty(), scenario.data.planar, options.ahead);
  const auto each = [&](const TrackRecord& record) {
    files.add(record);
    if (!tables && !request.json_lines) return;
    const std::string text = tables ? lines(record) : json_lines(record);
    if (text.empty()) return;
    print(text);
    if (flush_output() != 0 && !files.has_results()) throw Error(output_failure());  // the rest could not be shown
  };
  const Track result = track(scenario, options, *feed, each, files.before());
  if (result.records.size() == 0) {
    warn(why_no_track(result));
    return kIncomplete;
  }

  read_truth(scenario);
  const TrackSummary summary = summarise(result, scenario, options);
  Results results;
  results.incomplete_reason = why_unreliable(result);
  if (const FitReport fit = track_fit(result.health); !fit.consistent()) results.misfit = fit.verdict();
  results.announces_folder = !request.json_lines;
  if (request.json_lines) print(track_json_summary_line(result, summary));
  if (!request.json_lines)
    results.table = [&] { return "\n" + track_report(result, summary) + states_at_text(result.at); };
  results.json = [&] { return track_json(result, summary); };
  results.plots_command = "track";
  results.write = [&](const std::filesystem::path& folder) { write_track(result, summary, scenario, options, folder); };
  const int status = finish(request.output, results);
  files.remove(result.ended && !request.standard_input);
  return status;
}

}  // namespace

Command track_command() {
  return {
      [](CommandOptions& option) {
        const auto request = std::make_shared<TrackRequest>();
        TrackOptions& track = request->track;
        track.online.lag.max_iterations = kIterations;
        option.details(
            "Prints one line per second of data with the target's range, bearing (positive to starboard), elevation, "
            "speed, heading (clockwise from north: the world's y axis, in NED-FRD its x axis) and the standard "
            "deviation "
            "of its position relative to the chaser. Then prints update times, rejected lines and measurements and, "
            "with "
            "truth, the errors of the newest states and of the predictions.\n"
            "Lines of --stdin are NAME,t,...: a sensor name and a row of its CSV file, or "
            "odometry,t,x,y,z,qx,qy,qz,qw.");
        option.exit_status(
            "Exit status: 0 tracked (also after an interrupt), 1 invalid input or usage, 2 nothing to track, or an "
            "unreliable track for --bad-after seconds or more.");
        add_problem(option, request->problem, true);
        add_own_sensors(option, request->problem.own, false);
        option.group(kTarget);
        option.flag("--soften",
                    "If no motion of the target satisfies the hard constraints, make them soft and reset the estimate "
                    "(default: exit with an error that names them)",
                    track.online.soften_infeasible);
        option.group("Data");
        option("--until", "SECONDS", "Stop after SECONDS of data [s] (default: all data)", track.until,
               parse_non_negative);
        option.flag("--realtime", "Process each line at its time instead of as fast as possible", track.realtime);
        option.flag("--stdin", "Read the data from standard input; SCENARIO then only gives scenario.yaml",
                    request->standard_input);
        option.advanced();
        option("--stamps", "auto|s|ms|us|ns", "Unit of the time stamps of all streams (default auto)",
               request->stamp_unit, parse_stamp_unit);
        option("--settle", "SECONDS",
               "Process each line SECONDS after its time, so that lines late by up to SECONDS come in order [s] "
               "(default 0)",
               request->settle, parse_positive);
        option.group("Window");
        option("--window", "SECONDS", "Length of the sliding window; older states are marginalised [s] (default 60)",
               request->window, parse_positive);
        option("--predict", "LIST", "Prediction times ahead of the newest state, comma-separated [s] (default 5,10)",
               track.ahead, parse_ahead);
        add_threads(option);
        option.advanced();
        option("--newest", "hypotheses|window",
               "Source of the target's newest state and predictions: motion hypotheses, or the motion model of the "
               "window (default: hypotheses if they are supported and no target option is given)",
               request->newest, parse_newest);
        option("--window-keyframes", "N",
               "Maximum number of keyframes in the window; without --window, the only limit (default: no limit)",
               track.online.lag.max_keyframes, parse_window_keyframes);
        option("--max-iterations", "N", "Maximum number of iterations of an update (default 12)",
               track.online.lag.max_iterations, parse_count);
        option.group("Gates and resets");
        ResetOptions& reset = track.online.reset;
        option("--gate", "SIGMAS|off",
               "Reject measurements whose innovation exceeds SIGMAS standard deviations (default 5)", reset.gate,
               parse_gate);
        option.advanced();
        option.set("--gate-reset", "M/N",
                   "Reset the estimate if the gate rejected M of the last N measurements of a sensor (default 3/4)",
                   [&reset](const std::string& name, const std::string& text) {
                     std::tie(reset.rejections, reset.rejection_window) = parse_fraction(name, text);
                   });
        option("--reset-after", "SECONDS",
               "Reset only after this duration of rejections without a used measurement of another sensor [s] (default "
               "7)",
               reset.reset_after, parse_non_negative);
        option("--unconverged-after", "SECONDS",
               "Reset the estimate if no update converges for SECONDS [s] (default 30)", reset.unconverged_after,
               parse_positive);
        option("--max-gap", "SECONDS", "Suspend tracking if there are no measurements for SECONDS [s] (default 60)",
               reset.max_gap, parse_positive);
        option("--lost-after", "SECONDS",
               "Report chaser or target as lost after SECONDS without an aiding measurement [s] (default 20)",
               reset.lost_after, parse_positive);
        option(
            "--invalid-after", "SECONDS",
            "Report chaser or target as invalid after SECONDS without an aiding measurement or a converged update [s] "
            "(default 40)",
            reset.invalid_after, parse_positive);
        option.everyday();
        option("--bad-after", "SECONDS", "Exit with status 2 if the track is unreliable for SECONDS [s] (default 60)",
               track.faulty_after, parse_positive);
        option.group("Snapshots");
        option("--snapshot", "FILE", "Write snapshots to FILE while tracking; if FILE exists, first resume from it",
               request->snapshot, parse_snapshot_file);
        option("--every", "SECONDS", "Wall-clock time between snapshots [s] (default 10)", request->every,
               parse_positive);
        add_output(option, request->output,
                   {.writes = "Write filtered trajectories, errors, summary.json and plots to DIR", .judges = true});
        add_at(option, track.at, request->output);
        option.flag("--json-lines", "Print each update as a line of JSON, and finally the summary as another one",
                    request->json_lines);
        option("--rate", "HZ", "With --json-lines: at most HZ lines per second of data [Hz] (default: every update)",
               request->rate, parse_positive);
        option("--covariance", "joint|blocks|off",
               "With --json-lines: the joint covariance of chaser and target, that of each, or none (default joint)",
               request->covariance, parse_covariance);
        return [request, &option] { return run_track(*request, option); };
      },
      true,
      [] {
        TrackOptions options;
        options.ahead = {5};
        std::vector<FileDescription> files = track_file_columns(options);
        for (FileDescription& file : files)
          for (auto& [column, what] : file.columns)
            if (const std::size_t at = column.find("ahead_5"); at != std::string::npos) column.replace(at + 6, 1, "H");
        files.push_back(track_json_keys());
        files.push_back(track_json_line_keys());
        return files;
      }};
}

TANDEM_COMMAND(track, "Estimation", "Track chaser and target online, line by line, over a sliding window")

}  // namespace tandem

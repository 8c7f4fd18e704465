#include <cerrno>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/live/partial_track.hpp>
#include <tandem/studies/live/track.hpp>
#include <tandem/studies/live/track_files.hpp>
#include <tandem/studies/live/track_json_line.hpp>
#include <tandem/studies/live/track_lines.hpp>
#include <tandem/studies/live/track_report.hpp>
#include <tandem/studies/live/track_snapshot.hpp>
#include <tandem/studies/navigation/navigated.hpp>
#include <tandem/studies/support/limited_complaints.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// An update: fixes after a gap, when the target may have turned meanwhile, take more than those that follow one another.
constexpr int kIterations = 12;

/// Where the target's newest state and predictions come from.
enum class Newest { hypotheses, window };

struct TrackRequest {
  ProblemRequest problem;
  LiveOptions live;
  std::optional<double> window;  ///< s
  std::optional<Newest> newest;
  std::optional<double> stamp_unit;  ///< s
  std::optional<std::filesystem::path> snapshot;
  std::optional<double> every;  ///< s
  bool standard_input = false, json_lines = false;
  Output output;
};

int parse_window_keyframes(const std::string& option, const std::string& text) {
  const int keyframes = parse_count(option, text);
  if (keyframes < 3) throw Error(fmt::format("{} is 3 or more: the target's motion ties three keyframes", option));
  return keyframes;
}

std::vector<double> parse_ahead(const std::string& option, const std::string& text) {
  std::vector<double> seconds;
  for (const std::string_view part : split(text, ',')) seconds.push_back(parse_positive(option, std::string(part)));
  constexpr double kDay = 86400;
  for (const double s : seconds)
    if (s > kDay)
      throw Error(fmt::format("{}: {:g} s ahead, nothing is told: a day, {:g} s, is the farthest", option, s, kDay));
  return seconds;
}

double parse_gate(const std::string& option, const std::string& text) {
  return text == "off" ? HUGE_VAL : parse_positive(option, text);
}

std::optional<double> parse_stamp_unit(const std::string& option, const std::string& text) {
  if (text == "auto") return {};
  for (const auto& [word, seconds] : {std::pair{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}})
    if (text == word) return seconds;
  throw Error(fmt::format("{} is auto, s, ms, us or ns, not {}", option, quote(text)));
}

/// "M/N": M of N measurements.
std::pair<int, int> parse_share(const std::string& option, const std::string& text) {
  const std::vector<std::string_view> parts = split(text, '/');
  const auto rejections = parts.size() == 2 ? whole_number(parts[0]) : std::nullopt;
  const auto of = parts.size() == 2 ? whole_number(parts[1]) : std::nullopt;
  if (!rejections || !of || *rejections > *of)
    throw Error(fmt::format("{} is M/N, M of the last N measurements, as in 3/4; not {}", option, quote(text)));
  return {*rejections, *of};
}

/// A file that can be written, or a name in a folder that one can be made in.
std::filesystem::path parse_snapshot_file(const std::string& option, const std::string& text) {
  const std::filesystem::path file(text), folder = file.has_parent_path() ? file.parent_path() : ".";
  if (!file.has_filename() || std::filesystem::is_directory(file))
    throw Error(fmt::format("{} is a file's name, and {} is a folder's", option, quote(text)));
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    throw Error(fmt::format("{} {}: nothing can be written to {}: {}", option, quote(text), folder.string(),
                            std::strerror(errno)));
  return file;
}

Newest parse_newest(const std::string& option, const std::string& text) {
  if (text == "hypotheses") return Newest::hypotheses;
  if (text == "window") return Newest::window;
  throw Error(fmt::format("{} is hypotheses or window, not {}", option, quote(text)));
}

/// Hypotheses where they can serve and nothing was said of how the target moves. Then the window need not guess an
/// orientation where none was measured; nor where an error that stays alone is why they cannot.
void choose_newest(const TrackRequest& request, const Scenario& scenario, bool model_given, OnlineOptions& online) {
  const std::string why_not = why_no_hypotheses(scenario.data, moves_by_odometry(scenario));
  if (request.newest == Newest::hypotheses && !why_not.empty())
    throw Error(fmt::format("--newest hypotheses cannot serve in {}: {}", request.problem.scenario, why_not));
  online.hypotheses = request.newest ? *request.newest == Newest::hypotheses : why_not.empty() && !model_given;
  TrackingData without_errors = scenario.data;
  for (TargetSensor& sensor : without_errors.sensors) sensor.error.reset();
  const bool could = why_no_hypotheses(without_errors, moves_by_odometry(scenario)).empty() && !request.newest;
  if ((online.hypotheses || could) && !model_given) online.tracking.mode = Mode::B;
}

LiveOptions live_options(const TrackRequest& request) {
  LiveOptions options = request.live;
  OnlineOptions& online = options.online;
  online.tracking = tracking_options(request.problem, false);
  const NavigationOptions navigation = navigation_options(request.problem);
  online.ego = navigation.ego;
  online.alignment = navigation.alignment;
  if (online.lag.max_keyframes > 0) online.lag.window = HUGE_VAL;
  if (request.window) online.lag.window = *request.window;
  options.stop = &interrupted();
  if (!request.output.quiet) options.tell = LimitedComplaints("notices", complain);
  if (request.json_lines && request.output.json)
    throw Error("--json-lines prints a line an update and --json one summary: give one of them");
  if (options.realtime && request.standard_input)
    throw Error("--realtime is for a folder's files: lines of --stdin come at their own pace");
  if (request.every && !request.snapshot) throw Error("--every is how often a --snapshot is written: give both");
  if (request.every) options.snapshot_every = *request.every;
  return options;
}

std::unique_ptr<LiveFeed> feed_of(const Scenario& settings, bool standard_input) {
  if (!standard_input) return std::make_unique<FolderFeed>(settings);
  return std::make_unique<StreamFeed>(
      settings, STDIN_FILENO, "standard input", interrupted(),
      [tell = LimitedComplaints("lines left out", complain)](const std::string& complaint) mutable {
        tell(complaint + "; the line is left out");
      });
}

std::string why_nothing(const Track& track) {
  if (track.interrupted) return "interrupted before there was anything to track";
  return std::string("nothing could be tracked: ") +
         (track.has_target ? "no measurement gives the position of the target while the chaser's motion is known"
                           : "the chaser's own sensors say too little to start from");
}

/// Why it is not to be relied on; empty where it is.
std::string why_bad(const Track& track) {
  if (!track.bad) return "";
  const std::string what = "updates did not converge, or all that was measured was rejected";
  if (track.bad->lasts) return fmt::format("not to be relied on since t = {:.1f} s: {}", track.bad->since, what);
  return fmt::format("not to be relied on from t = {:.1f} s to {:.1f} s: {}", track.bad->since, track.bad->until, what);
}

/// What goes to the disk while tracking: results beside --out, the snapshot, and what an earlier one left there. A disk that
/// does not take it does not end the track.
class OnDisk {
 public:
  OnDisk(const TrackRequest& request, const Scenario& scenario)
      : snapshot_(request.snapshot), rows_(scenario.frame, request.live.ahead, watched_sensors(scenario)) {
    std::optional<PartialTrack::Continues> continues;
    if (snapshot_) {
      if (auto before = read_snapshot(*snapshot_, scenario)) before_.emplace(TrackBefore{std::move(*before)});
      continues.emplace(PartialTrack::Continues{
          .keeps_all = request.standard_input,
          .record_bytes = record_bytes(request.live.ahead.size(), watched_sensors(scenario).size())});
      if (before_) continues->from = before_->snapshot.partial;
    }
    if (snapshot_ || request.output.folder) disk_.emplace(PartialTrack::period);
    if (request.output.folder) {
      partial_.emplace(request.output.folder->partial(), rows_, *disk_, continues, complain);
      if (before_) {
        before_->n = partial_->earlier();
        before_->records = partial_->records_file();
      }
    }
    if (before_ && !request.output.quiet)
      complain(fmt::format("going on from {}, which is of t = {:.1f} s", snapshot_->string(), before_->snapshot.t));
  }

  /// What the track goes on from.
  const std::optional<TrackBefore>& before() const { return before_; }

  void add(const TrackRecord& record) {
    try {
      if (partial_) partial_->add(record);
    } catch (const Error& error) {  // it could not be begun
      partial_.reset();
      tell_(std::string(error.what()) + "; the track goes on, its results are written at its end alone");
    }
    if (!disk_) return;
    if (const std::string why = disk_->failure(); !why.empty()) tell_(why + "; the track goes on");
  }
  void add(TrackSnapshot snapshot) {
    if (partial_) snapshot.partial = partial_->place();
    disk_->replace(*snapshot_, bytes_of(snapshot));
  }
  /// The results are where they are to be. Nobody goes on from an end; from another stop, by the snapshot, the next run.
  void remove(bool ended) {
    if (partial_ && (ended || !snapshot_)) partial_->remove();
    if (!ended || !snapshot_) return;
    disk_->flush();
    std::filesystem::remove(*snapshot_);
  }

 private:
  const std::optional<std::filesystem::path> snapshot_;
  const TrackRows rows_;
  std::optional<TrackBefore> before_;
  std::optional<DurableFiles> disk_;
  std::optional<PartialTrack> partial_;
  LimitedComplaints tell_{"failures to write", complain};
};

/// An interrupt ends it with the summary.
int run_track(const TrackRequest& request, const CommandOptions& option) {
  LiveOptions options = live_options(request);
  Scenario scenario =
      read_problem_settings(request.problem, option, request.standard_input ? RowsIn::stream : RowsIn::files);
  choose_newest(request, scenario, !option.given(kTarget).empty(), options.online);
  const std::unique_ptr<LiveFeed> feed = feed_of(scenario, request.standard_input);
  if (request.stamp_unit) feed->set_unit(*request.stamp_unit);
  if (!request.standard_input && !request.output.quiet)
    if (const std::string why = spans_apart(scenario); !why.empty()) complain(why);

  const bool print = !request.output.quiet && !request.output.json && !request.json_lines;
  const std::vector<std::string> sensors = watched_sensors(scenario);
  OnDisk on_disk(request, scenario);
  if (request.snapshot) options.on_snapshot = [&](TrackSnapshot snapshot) { on_disk.add(std::move(snapshot)); };
  TrackLines lines(scenario.frame, !scenario.data.sensors.empty(), scenario.data.planar, options.ahead);
  const auto each = [&](const TrackRecord& record) {
    on_disk.add(record);
    if (!print && !request.json_lines) return;
    const std::string text = print ? lines(record) : track_json_line(record, scenario.frame, sensors, options.ahead);
    if (text.empty()) return;
    fmt::print("{}", text);
    std::fflush(stdout);
  };
  const Track result = track(scenario, options, *feed, each, on_disk.before());
  if (result.records.size() == 0) {
    complain(why_nothing(result));
    return kNotDone;
  }

  read_truth(scenario);
  const TrackSummary summary = summarise(result, scenario, options);
  Results results;
  results.not_done = why_bad(result);
  if (!request.json_lines) results.table = [&] { return "\n" + track_report(result, summary); };
  results.json = [&] { return track_json(result, summary); };
  results.plots_of = "track";
  results.write = [&](const std::filesystem::path& folder) { write_track(result, summary, scenario, options, folder); };
  const int status = finish(request.output, results);
  on_disk.remove(result.ended && !request.standard_input);
  return status;
}

}  // namespace

Command track_command() {
  return {
      [](CommandOptions& option) {
        const auto request = std::make_shared<TrackRequest>();
        LiveOptions& live = request->live;
        live.online.lag.max_iterations = kIterations;
        option.footer(
            "Prints a line a second of data: of the target range, bearing (starboard positive), elevation, speed, "
            "heading (clockwise from north: the world's y, of NED-FRD x) and sigma of its position relative to the "
            "chaser; then how long updates took, what was refused and, where there is truth, errors of the newest "
            "state and of predictions.\n"
            "Lines of --stdin are NAME,t,...: the name of a sensor and a row of its csv, or "
            "odometry,t,x,y,z,qx,qy,qz,qw.\n"
            "Exit status: 0 tracked, also until an interrupt, 1 wrong input or usage, 2 there was nothing to "
            "track, or the track was not to be relied on for --bad-after seconds or more.");
        add_problem(option, request->problem, true);
        add_own_sensors(option, request->problem.own, false);
        option.group("Data");
        option("--until", "SECONDS", "Stop after so many seconds of data", live.until, parse_magnitude);
        option.flag("--realtime", "Each line at its time, not as fast as possible", live.realtime);
        option.flag("--stdin", "Settings from the folder's scenario.yaml, data from standard input",
                    request->standard_input);
        option("--stamps", "auto|s|ms|us|ns", "Unit of the stamps of all streams (default auto)", request->stamp_unit,
               parse_stamp_unit);
        option.group("Window");
        option("--newest", "hypotheses|window",
               "The target's newest state and predictions by motion hypotheses or by the window's model (default "
               "hypotheses where they can serve and no option says how the target moves)",
               request->newest, parse_newest);
        option("--window", "SECONDS", "What is older is marginalised (default 60)", request->window, parse_positive);
        option("--window-keyframes", "N", "And what is more than N keyframes back (alone: no other window)",
               live.online.lag.max_keyframes, parse_window_keyframes);
        option("--max-iterations", "N", "Stop an update after N iterations (default 12)",
               live.online.lag.max_iterations, parse_count);
        add_threads(option);
        option("--predict", "LIST", "Seconds ahead to predict the target (default 5,10)", live.ahead, parse_ahead);
        option.group("Trust");
        ResetOptions& reset = live.online.reset;
        option("--gate", "SIGMAS|off", "Leave out what is further from what is expected (default 5)", reset.gate,
               parse_gate);
        option.set("--gate-reset", "M/N", "Begin anew when M of the last N are left out (default 3/4)",
                   [&reset](const std::string& name, const std::string& text) {
                     std::tie(reset.rejections, reset.rejected_of) = parse_share(name, text);
                   });
        option("--reset-after", "SECONDS", "And over so long, no other sensor disagreeing (default 7)",
               reset.reset_after, parse_magnitude);
        option("--unconverged-after", "SECONDS", "Begin anew when no update converges for so long (default 30)",
               reset.unconverged_after, parse_positive);
        option("--max-gap", "SECONDS", "Suspend the track when nothing is measured for longer (default 60)",
               reset.max_gap, parse_positive);
        option("--lost-after", "SECONDS", "Call chaser or target lost when nothing aids it for longer (default 20)",
               reset.lost_after, parse_positive);
        option("--invalid-after", "SECONDS", "And invalid then, or when no update converges (default 40)",
               reset.invalid_after, parse_positive);
        option("--bad-after", "SECONDS", "Exit 2 when it was bad for so long (default 60)", live.bad_after,
               parse_positive);
        option.group("After a kill");
        option("--snapshot", "FILE", "Go on from FILE where it is there, and write it while tracking",
               request->snapshot, parse_snapshot_file);
        option("--every", "SECONDS", "So often (default 10)", request->every, parse_positive);
        add_output(option, request->output,
                   {.writes = "Write trajectories as filtered, track.csv, errors.csv, summary.json and plots to DIR"});
        option.flag("--json-lines", "Print each update as a line of JSON, with its health", request->json_lines);
        return [request, &option] { return run_track(*request, option); };
      },
      true};
}

}  // namespace tandem

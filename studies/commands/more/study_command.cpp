#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>
#include <tandem/studies/simulation/simulate_docking_files.hpp>
#include <tandem/studies/study/ready_studies.hpp>
#include <tandem/studies/study/study_ranks.hpp>
#include <tandem/studies/study/study_report.hpp>
#include <tandem/studies/study/study_run.hpp>
#include <tandem/studies/study/trial.hpp>
#include <tandem/studies/study/trial_dive.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/output_folder.hpp>
#include <tandem/studies/support/plots.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

struct StudyRequest {
  std::string action;
  std::vector<std::string> paths;
  std::string out;
  bool resume = false, quiet = false;
  int threads = 0;
  Shard shard;
  std::optional<PlotFormat> plots = PlotFormat::svg;
};

struct StudyAction {
  std::string name, takes, help;
  std::vector<std::string> options;  ///< of the command's that it knows
  int (*run)(const StudyRequest& request);
};

Shard parse_shard(const std::string& option, const std::string& text) {
  const auto parts = split(text, '/');
  const auto of = parts.size() == 2 ? whole_number(parts[1]) : std::nullopt;
  const auto index = parts.size() == 2 ? parse_number(parts[0]) : std::nullopt;
  if (!of || !index || *index != std::floor(*index) || *index < 0 || *index >= *of)
    throw Error(fmt::format("{} takes I/N, I from 0 to N − 1, e.g. 0/4, not {}", option, quote(text)));
  return {static_cast<std::size_t>(*index), static_cast<std::size_t>(*of)};
}

std::string time_text(double seconds) {
  const auto s = static_cast<long long>(std::min(std::max(seconds, 0.0), 1e9) + 0.5);
  if (s >= 3600) return fmt::format("{} h {:02} min", s / 3600, s / 60 % 60);
  return s >= 60 ? fmt::format("{} min {:02} s", s / 60, s % 60) : fmt::format("{} s", s);
}

/// One line on standard error, rewritten in place, where a terminal watches.
class StudyBar {
 public:
  explicit StudyBar(bool shown) : shown_(shown) {}
  ~StudyBar() {
    if (begun_) fmt::print(stderr, "\r\x1b[K");
  }
  StudyBar(const StudyBar&) = delete;
  StudyBar& operator=(const StudyBar&) = delete;

  void show(const StudyProgress& p) {
    const auto now = std::chrono::steady_clock::now();
    if (!shown_ || (begun_ && now - last_ < std::chrono::milliseconds(100))) return;
    begun_ = true;
    last_ = now;
    constexpr std::size_t width = 20;
    const std::size_t full = width * p.done / std::max<std::size_t>(1, p.all);
    fmt::print(stderr, "\r\x1b[K[{}{}] {} of {} trials, {:.3g}/s, {} left{}", std::string(full, '#'),
               std::string(width - full, '.'), p.done, p.all, p.rate, time_text(p.seconds_left),
               p.failed ? fmt::format(", {} failed", p.failed) : "");
    std::fflush(stderr);
  }

 private:
  bool shown_, begun_ = false;
  std::chrono::steady_clock::time_point last_;
};

std::string whole_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Writes the tables of a whole study into its folder, and prints them.
void finish_tables(const StudyDatabase& database, const std::string& folder, bool quiet) {
  const std::vector<TrialResult> results = database.results();
  const StudyTables tables = study_tables(database.study(), results);
  OutputFolder(folder).fill(
      [&](const std::filesystem::path& fresh) { write_study_tables(database.study(), tables, fresh); });
  if (!quiet)
    fmt::print("{}\n{}\nWritten to {}\n", printable_lines(study_report(database.study(), tables)),
               printable_lines(study_timing(tables)), printable(folder));
}

/// By `ranks` together where there are some, else by threads.
int run_whole_study_on(const StudyRequest& request, StudyRanks* ranks) {
  const std::filesystem::path file = study_file(request.paths.front());
  const Study study = read_study(file);
  if (ranks && (request.threads > 0 || request.shard.of > 1))
    throw Error(
        "under mpirun each rank does one trial at a time of all: --threads and --shard are for runs without it");
  if (ranks && !ranks->leads()) {
    ranks->work(study);
    return kDone;
  }
  const bool goes_on = request.resume && StudyDatabase::is_in(request.out);
  StudyDatabase database =
      goes_on ? StudyDatabase::resume(request.out, study) : StudyDatabase::create(request.out, study, whole_file(file));
  StudyRunOptions options;
  options.threads = request.threads;
  options.shard = request.shard;
  options.stop = &interrupted();
  StudyProgress progress;
  {
    StudyBar bar(!request.quiet && isatty(STDERR_FILENO));
    const LibrariesPrintToStderr redirection;
    options.progress = [&](const StudyProgress& p) { bar.show(p); };
    progress = ranks ? ranks->lead(database, options) : run_study(database, options);
  }
  if (ranks && ranks->lost() > 0)
    complain(
        fmt::format("{} ranks fell silent and were given up; others have done their trials. Should mpirun wait for "
                    "them, end it",
                    ranks->lost()));
  if (progress.done < progress.all) {
    complain(fmt::format("interrupted after {} of {} trials; go on with --resume", progress.done, progress.all));
    return kNotDone;
  }
  if (database.count() == study.trials())
    finish_tables(database, request.out, request.quiet);
  else if (!request.quiet)
    fmt::print("{} of {} trials are in {}; tandem study merge puts shards together\n", database.count(), study.trials(),
               request.out);
  return kDone;
}

int run_whole_study(const StudyRequest& request) {
  const std::unique_ptr<StudyRanks> ranks = StudyRanks::launched();
  if (!ranks) return run_whole_study_on(request, nullptr);
  try {
    return run_whole_study_on(request, ranks.get());
  } catch (const std::exception& error) {
    if (!ranks->leads()) std::this_thread::sleep_for(std::chrono::seconds(10));  // rank 0 says the same, and ends all
    complain(error.what());
    ranks->abandon(kWrongInput);
  }
}

int merge_studies(const StudyRequest& request) {
  const StudyDatabase first = StudyDatabase::read(request.paths.front());
  for (const std::string& path : request.paths)  // before anything is written
    if (StudyDatabase::read(path).study().canonical() != first.study().canonical())
      throw Error(fmt::format("{} has another study than {}: their hashes differ", path, request.paths.front()));
  StudyDatabase merged = StudyDatabase::create(request.out, first.study(), first.yaml());
  for (const std::string& path : request.paths) merge_study(merged, StudyDatabase::read(path));
  if (merged.count() == first.study().trials()) {
    finish_tables(merged, request.out, request.quiet);
    return kDone;
  }
  complain(
      fmt::format("{} of {} trials are there: a shard is missing or not done; tandem study run --resume --out {} "
                  "does what is left",
                  merged.count(), first.study().trials(), request.out));
  return kNotDone;
}

int export_study(const StudyRequest& request) {
  const StudyDatabase database = StudyDatabase::read(request.paths.front());
  const std::vector<TrialResult> results = database.results();
  const StudyTables tables = study_tables(database.study(), results);
  const std::string folder = request.out.empty() ? request.paths.front() : request.out;
  std::string note;
  OutputFolder(folder).fill([&](const std::filesystem::path& fresh) {
    write_study_tables(database.study(), tables, fresh);
    write_file(fresh / "trials.csv", trials_csv(database.study(), results));
    if (request.plots) note = draw_plots("study", *request.plots, fresh);
  });
  if (!request.quiet) fmt::print("Written to {}\n", printable(folder));
  if (!request.quiet && !note.empty()) complain(note);
  return kDone;
}

int show_study(const StudyRequest& request) {
  const StudyDatabase database = StudyDatabase::read(request.paths.front());
  const std::vector<TrialResult> results = database.results();
  const StudyTables tables = study_tables(database.study(), results);
  fmt::print("{}\n{}", printable_lines(study_report(database.study(), tables)), printable_lines(study_timing(tables)));
  return kDone;
}

/// That estimates a trial's folder as the study did, as far as a command's options can say it.
std::string command_of_trial(const Study& study, const TrialPlace& place, const TrialSettings& settings,
                             const std::string& folder) {
  std::string options;
  const auto add = [&](const std::string& option) { options += " " + option; };
  if (settings.loss.kind != Loss::Kind::none) add("--loss " + loss_text(settings.loss));
  if (settings.own.without) add("--without " + *settings.own.without);
  if (settings.own.dvl_scale) add("--dvl-scale");
  if (!study.has_target()) {
    if (settings.own.preintegrated) add("--preintegrated-dvl");
    return fmt::format("navigate {}{}", folder, options);
  }
  if (!settings.level) add("--roll-pitch off");
  if (settings.junction == Junction::direct) add("--junction direct");
  const std::string& model = study.models[place.model];
  if (settings.window > 0) {
    add(settings.newest.kind == NewestBy::Kind::window ? "--newest window" : "--newest hypotheses");
    const std::string of_model = model == "constant-twist" ? "" : " (and the options of " + model + ")";
    return fmt::format("track {} --window {:g}{}{}", folder, settings.window, options, of_model);
  }
  if (settings.own.preintegrated) add("--preintegrated-dvl");
  if (settings.max_keyframes > 0) add(fmt::format("--max-keyframes {:g}", settings.max_keyframes));
  if (const std::string& solver = study.solvers[place.solver]; solver != Study::kAutomatic) add("--solver " + solver);
  return fmt::format("models {} --models '{}'{}", folder, model, options);
}

int write_trial(const StudyRequest& request) {
  const std::string& of = request.paths[0];
  const Study study = StudyDatabase::is_in(of) ? StudyDatabase::read(of).study() : read_study(study_file(of));
  const auto number = parse_number(request.paths[1]);
  if (!number || *number < 0 || *number != std::floor(*number) || *number >= double(study.trials()))
    throw Error(fmt::format("trials of {} are 0 to {}, not {}", of, study.trials() - 1, quote(request.paths[1])));
  const TrialPlace place = study.place(static_cast<std::size_t>(*number));
  const TrialSettings settings = study.settings(place);
  if (settings.rendezvous)
    throw Error(fmt::format("trial {} of {} is a rendezvous, which has no recording: see tandem rendezvous --seed {}",
                            request.paths[1], of, settings.docking.seed));
  OutputFolder(request.out).fill([&](const std::filesystem::path& fresh) {
    if (study.simulation == Simulated::dive)
      write_dive(trial_dive(settings), settings.dive, fresh);
    else
      write_docking(trial_docking(settings), settings.docking, fresh);
  });
  if (request.quiet) return kDone;
  fmt::print("{}{}\nWritten to {}; see tandem {}\n", study.cell_text(place),
             study.cell_text(place).empty() ? study.models[place.model] : ", " + study.models[place.model], request.out,
             command_of_trial(study, place, settings, request.out));
  return kDone;
}

int list_studies(const StudyRequest&) {
  for (const std::string& name : ready_studies()) {
    const Study study = read_study(study_file(name));
    fmt::print("{:<16} {:>6} trials  {}\n", name, study.trials(), study.question);
  }
  return kDone;
}

const std::vector<StudyAction>& study_actions() {
  static const std::vector<StudyAction> all = {
      {"run",
       "FILE",
       "all trials of a study, a yaml file or the name of a ready one, into --out",
       {"--out", "--resume", "--threads", "--shard", "--quiet"},
       run_whole_study},
      {"merge", "DIR…", "shards of one study into --out", {"--out", "--quiet"}, merge_studies},
      {"export",
       "DIR",
       "trials.csv, the tables and plots of them, into the folder itself or --out",
       {"--out", "--plots", "--quiet"},
       export_study},
      {"show", "DIR", "the tables of the trials that are there", {}, show_study},
      {"trial", "FILE|DIR N", "the scenario folder of trial N, into --out", {"--out", "--quiet"}, write_trial},
      {"list", "", "the ready studies", {}, list_studies},
  };
  return all;
}

int run_study_command(const StudyRequest& request, const CommandOptions& option) {
  std::vector<std::string> names;
  for (const StudyAction& action : study_actions()) {
    names.push_back(action.name);
    if (action.name != request.action) continue;
    for (const std::string& given : option.given("Options"))
      if (std::find(action.options.begin(), action.options.end(), given) == action.options.end() &&
          given.starts_with("--"))
        throw Error(fmt::format("study {} takes no {}", action.name, given));
    const std::size_t wanted = action.takes.empty() ? 0 : split(action.takes, ' ').size();
    if (action.name == "merge" ? request.paths.empty() : request.paths.size() != wanted)
      throw Error(fmt::format("usage: tandem study {} {}", action.name, action.takes));
    if (request.out.empty() && action.name != "export" &&
        std::find(action.options.begin(), action.options.end(), "--out") != action.options.end())
      throw Error(fmt::format("study {} needs --out DIR", action.name));
    return action.run(request);
  }
  throw Error(fmt::format("there is no study {}{} (there are: {})", quote(request.action),
                          did_you_mean(request.action, names), listed(names)));
}

}  // namespace

Command study_command() {
  return {
      [](CommandOptions& option) {
        const auto request = std::make_shared<StudyRequest>();
        std::string footer;
        for (const StudyAction& action : study_actions())
          footer += fmt::format("{:<7} {:<11} {}\n", action.name, action.takes, action.help);
        footer += "Exit status: 0 done, however the trials did, 1 wrong input or usage, 2 interrupted or incomplete.";
        footer += "\nParameters of a study file:";
        footer += parameter_help(trial_parameters(Simulated::docking));
        footer += "\nParameters of one with simulation: dive:";
        footer += parameter_help(trial_parameters(Simulated::dive));
        option.footer(footer);
        option.argument("action", "ACTION", "run, merge, export, show, trial or list, see below", request->action);
        option.arguments("what", "WHAT", "What it is about, see below", request->paths);
        const auto text_as_it_is = [](const std::string&, const std::string& text) { return text; };
        option("--out", "DIR", "The folder of the study, or of what is written", request->out, text_as_it_is);
        option.flag("--resume", "Go on with the study that is in --out, or begin it", request->resume);
        option("--threads", "N", "Trials at a time (default: one each core)", request->threads, parse_count);
        option("--shard", "I/N", "Only trials whose number is I modulo N", request->shard, parse_shard);
        option("--plots", "svg|png|off", "Format of the plots of export (default svg)", request->plots, parse_plots);
        option.flag("--quiet", "Print no tables or progress", request->quiet);
        return [request, &option] { return run_study_command(*request, option); };
      },
      true};
}

}  // namespace tandem

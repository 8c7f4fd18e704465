#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>
#include <tandem/studies/simulation/simulate_docking_files.hpp>
#include <tandem/studies/study/builtin_studies.hpp>
#include <tandem/studies/study/study_ranks.hpp>
#include <tandem/studies/study/study_report.hpp>
#include <tandem/studies/study/study_run.hpp>
#include <tandem/studies/study/study_summary.hpp>
#include <tandem/studies/study/trial.hpp>
#include <tandem/studies/study/trial_dive.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/output_folder.hpp>
#include <tandem/studies/support/plots.hpp>
#include <tandem/studies/support/progress_line.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

struct StudyRequest {
  std::string action;
  std::vector<std::string> paths;
  std::string out;
  bool resume = false, full = false;
  int threads = 0;
  Shard shard;
  Output output;  ///< without the folder, which is `out`
  std::vector<std::string> result_files;
};

struct StudyAction {
  std::string name, takes, help;
  std::vector<std::string> options;  ///< names of the options that apply to the action
  int (*run)(const StudyRequest& request);
};

Shard parse_shard(const std::string& option, const std::string& text) {
  const auto parts = split(text, '/');
  const auto of = parts.size() == 2 ? parse_positive_integer(parts[1]) : std::nullopt;
  const auto index = parts.size() == 2 ? parse_number(parts[0]) : std::nullopt;
  if (!of || !index || *index != std::floor(*index) || *index < 0 || *index >= *of)
    throw Error(fmt::format("{} takes I/N with I from 0 to N-1, e.g. 0/4, not {}", option, quote(text)));
  return {static_cast<std::size_t>(*index), static_cast<std::size_t>(*of)};
}

std::string time_text(double seconds) {
  const auto s = static_cast<long long>(std::min(std::max(seconds, 0.0), 1e9) + 0.5);
  if (s >= 3600) return fmt::format("{} h {:02} min", s / 3600, s / 60 % 60);
  return s >= 60 ? fmt::format("{} min {:02} s", s / 60, s % 60) : fmt::format("{} s", s);
}

std::string progress_bar(const StudyProgress& p) {
  constexpr std::size_t width = 20;
  const std::size_t full = width * p.done / std::max<std::size_t>(1, p.all);
  return fmt::format("[{}{}] {} of {} trials, {:.3g}/s, {} left{}", std::string(full, '#'),
                     std::string(width - full, '.'), p.done, p.all, p.rate, time_text(p.seconds_left),
                     p.failed ? fmt::format(", {} failed", p.failed) : "");
}

/// Prints the results of the finished trials, and returns the exit status. `note` follows the tables.
int print_study(const StudyRequest& request, const Study& study, const StudyTables& tables, const std::string& folder,
                const std::string& note) {
  Results results;
  results.table = [&] {
    const std::string text = request.full ? study_report(study, tables) + "\n" + study_timing(tables)
                                          : study_summary(study, tables) + "\nAll tables: --full, or tables.txt.\n";
    return note.empty() ? text : text + "\n" + note + "\n";
  };
  results.json = [&] { return study_json(study, tables, folder); };
  const bool usable = std::any_of(tables.groups.begin(), tables.groups.end(),
                                  [](const StudyGroup& group) { return group.converged > 0; });
  if (!usable) results.incomplete_reason = fmt::format("none of the {} finished trials converged", tables.trials);
  return finish(request.output, results);
}

/// Returns the output folder of a request.
OutputFolder output_folder(const StudyRequest& request, const std::string& folder) {
  OutputFolder out(folder);
  if (request.output.force) out.force();
  return out;
}

/// Writes the tables of a complete study to its folder, and prints them.
int finish_tables(const StudyRequest& request, const StudyDatabase& database) {
  const std::vector<TrialResult> results = database.results();
  const StudyTables tables = study_tables(database.study(), results);
  output_folder(request, request.out).fill([&](const std::filesystem::path& fresh) {
    write_study_tables(database.study(), tables, fresh);
  });
  return print_study(request, database.study(), tables, request.out, "Written to " + request.out);
}

/// Runs a study with MPI ranks, or with threads if `ranks` is null.
int run_whole_study_on(const StudyRequest& request, StudyRanks* ranks) {
  if (!ranks || ranks->is_leader()) output_folder(request, request.out).check(request.result_files);
  const std::filesystem::path file = study_file(request.paths.front());
  const Study study = read_study(file);
  if (ranks && (request.threads > 0 || request.shard.of > 1))
    throw Error("--threads and --shard are not supported under mpirun, where each rank runs one trial at a time");
  if (ranks && !ranks->is_leader()) {
    ranks->run_worker(study);
    return kSuccess;
  }
  const bool resumes = request.resume && StudyDatabase::is_in(request.out);
  StudyDatabase database =
      resumes ? StudyDatabase::resume(request.out, study) : StudyDatabase::create(request.out, study, read_text(file));
  StudyRunOptions options;
  options.threads = request.threads;
  options.shard = request.shard;
  options.stop = &interrupted();
  StudyProgress progress;
  {
    ProgressLine line;
    if (request.output.shows_progress()) options.progress = [&](const StudyProgress& p) { line.show(progress_bar(p)); };
    const StdoutToStderr redirection;
    progress = ranks ? ranks->run_leader(database, options) : run_study(database, options);
  }
  if (ranks && ranks->lost_workers() > 0)
    warn(fmt::format("{} ranks stopped responding; other ranks ran their trials. If mpirun does not end, stop it",
                     ranks->lost_workers()));
  if (progress.done < progress.all) {
    warn(fmt::format("interrupted after {} of {} trials; use --resume to continue", progress.done, progress.all));
    return kIncomplete;
  }
  if (database.count() == study.trials()) return finish_tables(request, database);
  const std::vector<TrialResult> results = database.results();
  return print_study(request, study, study_tables(study, results), request.out,
                     fmt::format("{} of {} trials are in {}; use tandem study merge to combine shards",
                                 database.count(), study.trials(), request.out));
}

int run_whole_study(const StudyRequest& request) {
  const std::unique_ptr<StudyRanks> ranks = StudyRanks::launched();
  if (!ranks) return run_whole_study_on(request, nullptr);
  try {
    return run_whole_study_on(request, ranks.get());
  } catch (const std::exception& error) {
    if (!ranks->is_leader())
      std::this_thread::sleep_for(std::chrono::seconds(10));  // rank 0 probably has the same error and ends all
    warn(error.what());
    ranks->abandon(kInvalidInput);
  }
}

int merge_studies(const StudyRequest& request) {
  output_folder(request, request.out).check(request.result_files);
  const StudyDatabase first = StudyDatabase::read(request.paths.front());
  const std::vector<TrialResult> results = merged_results({request.paths.begin(), request.paths.end()});
  StudyDatabase merged = StudyDatabase::create(request.out, first.study(), first.yaml());
  merged.add_all(results);
  if (merged.count() == first.study().trials()) return finish_tables(request, merged);
  warn(
      fmt::format("{} of {} trials are present; add the missing shards, or run the other trials by tandem study run "
                  "--resume --out {}",
                  merged.count(), first.study().trials(), request.out));
  return kIncomplete;
}

int export_study(const StudyRequest& request) {
  const StudyDatabase database = StudyDatabase::read(request.paths.front());
  const std::vector<TrialResult> results = database.results();
  const StudyTables tables = study_tables(database.study(), results);
  const std::string folder = request.out.empty() ? request.paths.front() : request.out;
  std::string note;
  const std::filesystem::path run_file = std::filesystem::path(folder) / "run.yaml";  // belongs to the study run: kept
  if (request.out.empty() && std::filesystem::exists(run_file)) set_run_file(read_text(run_file));
  output_folder(request, folder).fill([&](const std::filesystem::path& fresh) {
    write_study_tables(database.study(), tables, fresh);
    write_file(fresh / "trials.csv", trials_csv(database.study(), results));
    if (request.output.plots) note = draw_plots("study", *request.output.plots, fresh);
  });
  if (!request.output.quiet && !note.empty()) warn(note);
  Results printed;
  printed.table = [&] { return fmt::format("Written to {}\n", folder); };
  printed.json = [&] { return study_json(database.study(), tables, folder); };
  return finish(request.output, printed);
}

int show_study(const StudyRequest& request) {
  const StudyDatabase database = StudyDatabase::read(request.paths.front());
  const std::vector<TrialResult> results = database.results();
  const StudyTables tables = study_tables(database.study(), results);
  return print_study(request, database.study(), tables, request.paths.front(), "");
}

/// A trial whose scenario folder was written.
struct WrittenTrial {
  std::size_t number;
  std::string cell, model, folder, command;
};

JsonFields<WrittenTrial> trial_fields() {
  using T = WrittenTrial;
  return JsonFields<T>()
      .add("trial", "number of the trial", [](const T& t) { return t.number; })
      .add("cell", "grid cell: values of the parameters that vary", [](const T& t) { return t.cell; })
      .add("model", "motion model and constraints", [](const T& t) { return t.model; })
      .add("folder", "the written scenario folder", [](const T& t) { return t.folder; })
      .add("command", "command that estimates it", [](const T& t) { return t.command; });
}

JsonFields<std::vector<Study>> list_fields() {
  return JsonFields<std::vector<Study>>().add_list(
      "studies", "built-in studies",
      JsonFields<Study>()
          .add("name", "name", [](const Study& s) { return s.name; })
          .add("trials", "number of trials", [](const Study& s) { return s.trials(); })
          .add("question", "question of the study", [](const Study& s) { return s.question; }),
      [](const std::vector<Study>& all) -> const std::vector<Study>& { return all; });
}

/// Returns the arguments of tandem that estimate the folder of a trial as the study did, as far as options can express
/// it.
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
    add(settings.newest.kind == NewestStateMethod::Kind::window ? "--newest window" : "--newest hypotheses");
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
    throw Error(fmt::format("{} has the trials 0 to {}, not {}", of, study.trials() - 1, quote(request.paths[1])));
  const TrialPlace place = study.place(static_cast<std::size_t>(*number));
  const TrialSettings settings = study.settings(place);
  if (settings.rendezvous)
    throw Error(fmt::format("trial {} of {} is a rendezvous without a recording; use tandem rendezvous --seed {}",
                            request.paths[1], of, settings.docking.seed));
  output_folder(request, request.out).fill([&](const std::filesystem::path& fresh) {
    if (study.simulation == Simulated::dive)
      write_dive(trial_dive(settings), settings.dive, fresh);
    else
      write_docking(trial_docking(settings), settings.docking, fresh);
  });
  const WrittenTrial trial{static_cast<std::size_t>(*number), study.cell_text(place), study.models[place.model],
                           request.out, "tandem " + command_of_trial(study, place, settings, request.out)};
  Results results;
  results.table = [&] {
    return fmt::format("{}{}{}\nWritten to {}; to estimate it: {}\n", trial.cell, trial.cell.empty() ? "" : ", ",
                       trial.model, trial.folder, trial.command);
  };
  results.json = [&] { return json_text(json_document("study-trial", trial_fields(), trial)); };
  return finish(request.output, results);
}

int list_studies(const StudyRequest& request) {
  std::vector<Study> studies;
  for (const std::string& name : builtin_studies()) studies.push_back(read_study(study_file(name)));
  Results results;
  results.table = [&] {
    std::string text;
    for (const Study& study : studies)
      text += fmt::format("{:<16} {:>6} trials  {}\n", study.name, study.trials(), study.question);
    return text;
  };
  results.json = [&] { return json_text(json_document("study-list", list_fields(), studies)); };
  return finish(request.output, results);
}

const std::vector<StudyAction>& study_actions() {
  static const std::vector<StudyAction> all = {
      {"run",
       "FILE",
       "run all trials of a study (a YAML file, or the name of a built-in study) and store them in --out",
       {"--out", "--force", "--resume", "--threads", "--shard", "--full", "--verbose"},
       run_whole_study},
      {"merge", "DIR…", "merge the shards of one study into --out", {"--out", "--force", "--full"}, merge_studies},
      {"export",
       "DIR",
       "write trials.csv, tables and plots to the folder of the study, or to --out",
       {"--out", "--force", "--plots"},
       export_study},
      {"show", "DIR", "print the results of the finished trials", {"--full"}, show_study},
      {"trial", "FILE|DIR N", "write the scenario folder of trial N to --out", {"--out", "--force"}, write_trial},
      {"list", "", "list the built-in studies", {}, list_studies},
  };
  return all;
}

int run_study_command(const StudyRequest& request, const CommandOptions& option) {
  std::vector<std::string> names;
  for (const StudyAction& action : study_actions()) {
    names.push_back(action.name);
    if (action.name != request.action) continue;
    for (const auto& [info, values] : option.given()) {
      const std::string given = "--" + info.key();
      if (!info.positional && info.group != "Common" && given != "--json" && given != "--quiet" &&
          std::find(action.options.begin(), action.options.end(), given) == action.options.end())
        throw Error(fmt::format("study {} does not take {}", action.name, given));
    }
    const std::size_t wanted = action.takes.empty() ? 0 : split(action.takes, ' ').size();
    if (action.name == "merge" ? request.paths.empty() : request.paths.size() != wanted)
      throw Error(fmt::format("usage: tandem study {} {}", action.name, action.takes));
    if (request.out.empty() && action.name != "export" &&
        std::find(action.options.begin(), action.options.end(), "--out") != action.options.end())
      throw Error(fmt::format("study {} needs --out DIR", action.name));
    return action.run(request);
  }
  throw Error(fmt::format("unknown action {}{} (available: {})", quote(request.action),
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
        footer.pop_back();
        option.footer(footer);
        option.details(
            "Parameters of a study file:" + parameter_help(trial_parameters(Simulated::docking)) +
            "\nParameters of a study file with simulation: dive:" + parameter_help(trial_parameters(Simulated::dive)));
        option.exit_status(
            "Exit status: 0 done (trials that do not converge are results), 1 invalid input or usage, 2 interrupted, "
            "incomplete, or no trial converged.");
        option.argument("action", "ACTION", "run, merge, export, show, trial or list, see below", request->action);
        option.arguments("what", "FILE|DIR", "Study, folders or trial number, as the action requires", request->paths);
        option.flag("--resume", "Continue the study in --out, or start it if there is none", request->resume);
        option("--threads", "N", "Number of trials that run in parallel (default 0: one per core)", request->threads,
               parse_count_or_zero);
        option("--shard", "I/N", "Run only the trials whose number is I modulo N (default 0/1: all)", request->shard,
               parse_shard);
        option.group("Output");
        option("-o,--out", "DIR", "Folder of the study, or output folder", request->out,
               [](const std::string&, const std::string& text) { return text; });
        option.flag("--force", "Overwrite files in DIR that tandem did not write", request->output.force);
        option("--plots", "svg|png|pdf|off", "Format of the plots of export (default svg)", request->output.plots,
               parse_plots);
        option.flag("--full", "Print all tables instead of a summary", request->full);
        add_printing(option, request->output);
        return [request, &option] {
          request->result_files = option.result_files();
          return run_study_command(*request, option);
        };
      },
      true,
      [] {
        std::vector<FileDescription> files = study_file_columns();
        files.push_back(study_json_keys());
        files.push_back(describe_json("--json trial", "study-trial", trial_fields()));
        files.push_back(describe_json("--json list", "study-list", list_fields()));
        return files;
      }};
}

TANDEM_COMMAND(study, "Studies", "Run Monte Carlo studies over parameters, models, solvers and seeds")

}  // namespace tandem

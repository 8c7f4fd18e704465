#include <cmath>
#include <filesystem>
#include <map>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/calibration/calibration_files.hpp>
#include <tandem/studies/calibration/calibration_report.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr int kProfile = 25;  // points of a picture of the evidence

struct CalibrateRequest {
  ProblemRequest problem;  ///< of every scenario
  std::vector<std::string> more;
  std::vector<std::string> free;
  double within = 2.0, time_limit = HUGE_VAL;
  int folds = 5;
  std::string noise_file;
  Output output;
};

std::vector<std::string> parse_names(const std::string&, const std::string& text) {
  std::vector<std::string> names;
  for (const std::string_view name : split(text, ',')) names.emplace_back(name);
  return names;
}

double parse_factor(const std::string& option, const std::string& text) {
  const double value = parse_positive(option, text);
  if (!(value > 1)) throw Error(fmt::format("{} takes a factor above 1, not {}", option, quote(text)));
  return value;
}

/// A file that can be written, before anything is computed.
std::string parse_noise_file(const std::string& option, const std::string& text) {
  const std::filesystem::path file(text), parent = file.parent_path();
  if (std::filesystem::is_directory(file))
    throw Error(fmt::format("{} {}: that is a folder; name a file", option, text));
  if (!parent.empty() && !std::filesystem::is_directory(parent))
    throw Error(fmt::format("{} {}: there is no folder {}", option, text, parent.string()));
  return text;
}

/// What is not known of a constant that --free names and no --error or scenario has: a share, rad, s.
constexpr std::pair<const char*, double> kConstants[] = {{".scale", 0.05}, {".misalignment", 0.1}, {".delay", 0.3}};

/// Takes the constants of errors that stay out of `free`, each as an --error of the problem.
std::vector<SetByOption<StayingError>> take_constants(std::vector<std::string>& free) {
  std::vector<SetByOption<StayingError>> errors;
  std::erase_if(free, [&](const std::string& name) {
    for (const auto& [what, sigma] : kConstants) {
      if (!name.ends_with(what)) continue;
      errors.push_back({{"--free", name}, StayingError{Vector<1>(sigma)}});
      return true;
    }
    return false;
  });
  return errors;
}

/// The same measurements twice would count for twice as many.
void refuse_repeated(const std::vector<std::string>& scenarios) {
  std::map<std::filesystem::path, std::string> known;
  for (const std::string& name : scenarios) {
    const auto folder = std::filesystem::weakly_canonical(find_scenario(name, builtin_scenarios()));
    const auto [first, is_new] = known.emplace(folder, name);
    if (is_new) continue;
    throw Error(fmt::format("{} is given twice{}, and its measurements would count twice: leave one out", name,
                            first->second == name ? "" : fmt::format(", also as {}", first->second)));
  }
}

/// An interrupt or the time limit ends it with the best noise so far.
int run_calibrate(const CalibrateRequest& request, const CommandOptions& option) {
  ScenarioCalibrationOptions options;
  options.target = tracking_options(request.problem, true);
  options.own = navigation_options(request.problem);
  if (options.own.ego.preintegrated_dvl)
    throw Error("--preintegrated-dvl sums velocities up: calibrate takes each by itself");
  options.free = request.free;
  const auto constants = take_constants(options.free);
  options.noise = constants.empty() || !options.free.empty();
  if (!options.noise && !request.noise_file.empty())
    throw Error("--out writes noise, and --free names none: add some (usbl), or leave --out out");
  options.folds = request.folds;
  options.prior = std::log(request.within);
  options.profile = request.output.folder ? kProfile : 0;
  options.stop = Stop(&interrupted(), request.time_limit);
  std::vector<Scenario> scenarios;
  std::vector<std::string> names = {request.problem.scenario};
  names.insert(names.end(), request.more.begin(), request.more.end());
  refuse_repeated(names);
  for (const std::string& name : names) {
    ProblemRequest one = request.problem;
    one.scenario = name;
    // Those that an --error names keep its standard deviation: it comes later.
    one.sensors.errors.insert(one.sensors.errors.begin(), constants.begin(), constants.end());
    scenarios.push_back(read_any_problem(one, option, options.stop));
  }
  const ScenarioCalibration found = [&] {
    ProgressLine line;
    if (request.output.shows_progress()) options.progress = [&](const std::string& what) { line.show(what); };
    const LibrariesPrintToStderr redirection;
    return calibrate_scenarios(std::move(scenarios), options);
  }();
  if (!request.noise_file.empty())
    write_file(request.noise_file, noise_file_text(found.noise, noise_file_comment(found)));

  Results results;
  results.table = [&] {
    const std::string written = request.noise_file.empty() ? "" : fmt::format("\nNoise in {}\n", request.noise_file);
    return report(found) + written;
  };
  results.json = [&] { return calibration_json(found); };
  results.plots_of = "calibrate";
  results.write = [&](const std::filesystem::path& folder) { write_results(found, folder); };
  if (found.cut_short)
    results.not_done = fmt::format("{}: {}", interrupted() ? "interrupted" : "the time limit was reached",
                                   options.noise             ? "the best noise so far"
                                   : found.constants.empty() ? "no constant is known yet"
                                                             : "constants are not tried on held-out data");
  else if (!found.summary.converged())
    results.not_done = "calibrate did not converge: " + found.summary.message;
  return finish(request.output, results);
}

}  // namespace

Command calibrate_command() {
  return {[](CommandOptions& option) {
            const auto request = std::make_shared<CalibrateRequest>();
            option.footer(
                "Noise is found by the evidence of the measurements and tried on held-out ones; truth is never read.\n"
                "Exit status: 0 converged, 1 wrong input or usage, 2 not converged or cut short (the best noise so far "
                "is written).");
            add_problem(option, request->problem, true);
            add_max_keyframes(option, request->problem);
            add_own_sensors(option, request->problem.own, true);
            option.arguments("scenarios", "SCENARIO...", "More of them, with the same sensors", request->more);
            option.group("Calibration");
            option("--free", "LIST",
                   "What is calibrated, by commas: sensors and other noise (usbl), or their components (usbl.x), and "
                   "constants of "
                   "errors that stay (usbl.scale, camera.misalignment, dvl.delay), time constants (twist_time, "
                   "velocity_time, lidar.time) and degrees of freedom (usbl.dof); default all noise that has residuals",
                   request->free, parse_names);
            option("--within", "FACTOR",
                   "What the given values are held to be right to: a factor, one standard deviation of their prior",
                   request->within, parse_factor);
            option("--folds", "N", "Parts that are held out in turn, to try what was found (default 5, 0: none)",
                   request->folds, parse_count_or_none);
            option("--time-limit", "SECONDS", "Stop after so long, with the best noise by then", request->time_limit,
                   parse_magnitude);
            add_threads(option);
            add_output(option, request->output,
                       {.writes = "Write residuals, evidence and plots to DIR", .folder = "--pictures"});
            option("--out", "FILE", "Write the noise for --noise-from: found where recommended, else as given",
                   request->noise_file, parse_noise_file);
            return [request, &option] { return run_calibrate(*request, option); };
          },
          true};
}

}  // namespace tandem

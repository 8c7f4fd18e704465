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

constexpr int kProfilePoints = 25;  // points of the evidence along each parameter, for plots

struct CalibrateRequest {
  ProblemRequest problem;         ///< for every scenario
  std::vector<std::string> more;  ///< further scenarios
  std::vector<std::string> free;
  double within = 2.0, time_limit = HUGE_VAL;
  int folds = 5;
  std::string noise_file;
  bool profiles = false;
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

/// Checks that the file can be created, before anything is computed.
std::string parse_noise_file(const std::string& option, const std::string& text) {
  const std::filesystem::path file(text), parent = file.parent_path();
  if (std::filesystem::is_directory(file))
    throw Error(fmt::format("{} {} is a folder; give a file name", option, text));
  if (!parent.empty() && !std::filesystem::is_directory(parent))
    throw Error(fmt::format("{} {}: folder {} does not exist", option, text, parent.string()));
  return text;
}

/// Prior standard deviations of constants that --free names, unless --error or the scenario gives them: relative scale
/// factor, misalignment [rad] and delay [s].
constexpr std::pair<const char*, double> kConstants[] = {{".scale", 0.05}, {".misalignment", 0.1}, {".delay", 0.3}};

/// Moves the constant systematic errors from `free` to a list of --error settings.
std::vector<SetByOption<SystematicError>> extract_constants(std::vector<std::string>& free) {
  std::vector<SetByOption<SystematicError>> errors;
  std::erase_if(free, [&](const std::string& name) {
    for (const auto& [what, sigma] : kConstants) {
      if (!name.ends_with(what)) continue;
      errors.push_back({{"--free", name}, SystematicError{Vector<1>(sigma)}});
      return true;
    }
    return false;
  });
  return errors;
}

/// Throws Error if a scenario is given twice, since its measurements would count twice.
void reject_repeated(const std::vector<std::string>& scenarios) {
  std::map<std::filesystem::path, std::string> known;
  for (const std::string& name : scenarios) {
    const auto folder = std::filesystem::weakly_canonical(find_scenario(name, builtin_scenarios()));
    const auto [first, is_new] = known.emplace(folder, name);
    if (is_new) continue;
    throw Error(fmt::format("{} is given twice{}; remove one, since its measurements would count twice", name,
                            first->second == name ? "" : fmt::format(", also as {}", first->second)));
  }
}

/// Runs the command. An interrupt or the time limit ends it with the best estimates so far; the noise that is written
/// is the given one, unless cross-validation was complete.
int run_calibrate(const CalibrateRequest& request, const CommandOptions& option) {
  ScenarioCalibrationOptions options;
  options.target = tracking_options(request.problem, true);
  options.own = navigation_options(request.problem);
  if (options.own.ego.preintegrated_dvl)
    throw Error("calibrate does not support --preintegrated-dvl, since it needs each velocity as a residual");
  options.free = request.free;
  const auto constants = extract_constants(options.free);
  options.noise = constants.empty() || !options.free.empty();
  if (!options.noise && !request.noise_file.empty())
    throw Error(
        "--write-noise writes calibrated noise, but --free names none; add noise to --free (e.g. usbl) or remove "
        "--write-noise");
  options.folds = request.folds;
  options.prior = std::log(request.within);
  options.profile_points = request.profiles ? kProfilePoints : 0;
  options.stop = Stop(&interrupted(), request.time_limit);
  std::vector<Scenario> scenarios;
  std::vector<std::string> names = {request.problem.scenario};
  names.insert(names.end(), request.more.begin(), request.more.end());
  reject_repeated(names);
  for (const std::string& name : names) {
    ProblemRequest one = request.problem;
    one.scenario = name;
    // Inserted first, so that the standard deviation of an explicit --error overrides the default.
    one.sensors.errors.insert(one.sensors.errors.begin(), constants.begin(), constants.end());
    scenarios.push_back(read_any_problem(one, option, options.stop));
  }
  const ScenarioCalibration found = [&] {
    ProgressLine line;
    if (request.output.shows_progress()) options.progress = [&](const std::string& what) { line.show(what); };
    const StdoutToStderr redirection;
    return calibrate_scenarios(std::move(scenarios), options);
  }();
  if (!request.noise_file.empty())
    replace_file(request.noise_file, noise_file_text(found.noise, noise_file_comment(found)));

  Results results;
  results.table = [&] {
    const std::string written =
        request.noise_file.empty() ? "" : fmt::format("\nNoise written to {}\n", request.noise_file);
    return report(found) + written;
  };
  results.json = [&] { return calibration_json(found); };
  results.plots_command = "calibrate";
  results.write = [&](const std::filesystem::path& folder) {
    write_results(found, folder);
    if (options.noise) write_file(folder / "noise.yaml", noise_file_text(found.noise, noise_file_comment(found)));
  };
  if (found.cut_short)
    results.incomplete_reason =
        fmt::format("{}; {}", interrupted() ? "interrupted" : "the time limit was reached",
                    options.noise             ? found.recommended() ? "the cross-validated noise is the result"
                                                                    : "the noise is not validated, so the given one is kept"
                    : found.constants.empty() ? "no constant was estimated"
                                              : "the constants were not cross-validated");
  else if (!found.summary.converged())
    results.incomplete_reason = "calibrate did not converge: " + found.summary.message;
  return finish(request.output, results);
}

}  // namespace

Command calibrate_command() {
  return {
      [](CommandOptions& option) {
        const auto request = std::make_shared<CalibrateRequest>();
        option.footer(
            "Finds the noise that maximises the marginal likelihood of the measurements, and validates it on held-out "
            "measurements. Truth is not used.");
        add_problem(option, request->problem, true);
        add_max_keyframes(option, request->problem);
        add_own_sensors(option, request->problem.own, true);
        option.arguments("scenarios", "SCENARIO", "Further scenarios with the same sensors", request->more);
        option.group("Calibration");
        option("--free", "LIST",
               "Parameters to calibrate, comma-separated (default: all noise with residuals). Noise (usbl) or its "
               "components (usbl.x), constant systematic errors (usbl.scale, camera.misalignment, dvl.delay), time "
               "constants (twist_time, velocity_time, lidar.time), degrees of freedom (usbl.dof)",
               request->free, parse_names);
        option("--within", "FACTOR", "Prior: one standard deviation is this factor on the given values (default 2)",
               request->within, parse_factor);
        option("--folds", "N", "Number of folds of the cross-validation, 0 for none (default 5)", request->folds,
               parse_count_or_zero);
        option("--time-limit", "SECONDS",
               "Wall-clock time limit; shows the best estimates so far, but keeps the given noise if the "
               "cross-validation is incomplete",
               request->time_limit, parse_non_negative);
        add_threads(option);
        add_output(option, request->output,
                   {.writes = "Write noise.yaml (for --noise-from), residuals and plots to DIR",
                    .force = &request->problem.force});
        option("--write-noise", "FILE",
               "Write the noise to FILE, for --noise-from: calibrated values where recommended, else the given ones",
               request->noise_file, parse_noise_file);
        option.flag("--profiles",
                    "Also write the evidence along each parameter to DIR. Takes several solves per parameter",
                    request->profiles);
        return [request, &option] { return run_calibrate(*request, option); };
      },
      true,
      [] {
        std::vector<FileDescription> files = calibration_file_columns();
        files.push_back(calibration_json_keys());
        return files;
      }};
}

TANDEM_COMMAND(calibrate, "Models and noise",
               "Calibrate the noise of sensors and motion models from recordings, without truth")

}  // namespace tandem

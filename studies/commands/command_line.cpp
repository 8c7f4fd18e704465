#include <cstdio>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <tandem/studies/commands/command_line.hpp>
#include <tandem/studies/commands/compare_command.hpp>
#include <tandem/studies/commands/demo_command.hpp>
#include <tandem/studies/commands/estimate_command.hpp>
#include <tandem/studies/commands/models_command.hpp>
#include <tandem/studies/commands/navigate_command.hpp>
#include <tandem/studies/commands/simulate_command.hpp>
#include <tandem/studies/commands/track_command.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr int kBadInput = 1;

/// Adds options to a command, their values kept as they are typed.
struct Options {
  CLI::App* command;

  void operator()(const std::string& name, std::optional<std::string>& value, const std::string& takes,
                  const std::string& help) const {
    command->add_option(name, value, help)->type_name(takes);
  }
  void repeatable(const std::string& name, std::vector<std::string>& values, const std::string& takes,
                  const std::string& help) const {
    command->add_option(name, values, help + "; repeatable")->type_name(takes)->allow_extra_args(false);
  }
};

/// What says which problem is meant, common to the commands that pose one.
void add_target_motion(const Options& option, TrackingArguments& tracking, const std::string& limits) {
  option.command->add_option("scenario", tracking.scenario, "A scenario folder, or the name of a built-in scenario")
      ->type_name("SCENARIO")
      ->required();
  option("--mode", tracking.mode, "A|B",
         "Target as poses (A, default) or poses where one was measured, else points (B)");
  option("--model", tracking.model, "NAME",
         "Motion: constant-twist (default), constant-velocity, white-noise-acceleration or steady-course");
  option("--junction", tracking.junction, "boundary|direct", "How mode B ties points to poses (default boundary)");
  option("--roll-pitch", tracking.roll_pitch, "soft|hard|off", "The target is level (default soft)");
  option("--non-holonomic", tracking.non_holonomic, "soft|hard|off", "The target has no sway, no heave (default off)");
  option("--surge", tracking.surge, "MIN,MAX", "Limits of the target's surge [m/s]; inf is none");
  option("--yaw-rate", tracking.yaw_rate, "MAX", "Limit of the target's yaw rate [rad/s]");
  option("--limits", tracking.limits, "hard|soft", "How surge and yaw rate are held (default " + limits + ")");
  option.command->add_flag("--robust", tracking.robust,
                           "For real detections: Cauchy losses at 2 sigmas, and a start without turned ones");
  option.repeatable(
      "--loss", tracking.loss, "[WHICH=]NAME[:SCALE]",
      "Robust loss of the measurements: huber, cauchy, geman-mcclure or tukey, scale in sigmas (default 1); of "
      "WHICH = a sensor, its orientation apart (SENSOR.orientation) or that of all (orientation)");
  option.repeatable("--noise", tracking.noise, "NAME=v,v,...", "Standard deviations in place of the scenario's");
}

/// The same of a whole recording.
void add_tracking(const Options& option, TrackingArguments& tracking) {
  add_target_motion(option, tracking, "hard");
  option("--horizons", tracking.horizons, "LIST",
         "Triples (k-m, k, k+n) of constant twist or velocity: m:n or one number for both (default 1)");
  option.repeatable("--hold-out", tracking.hold_out, "[SENSOR=]N",
                    "Leave every N-th measurement out, to validate with");
  option("--max-keyframes", tracking.max_keyframes, "N", "Take the first N keyframes only");
}

void add_estimate(CLI::App& app, EstimateArguments& arguments) {
  CLI::App* command = app.add_subcommand("estimate", "Estimate the trajectories of chaser and target of a scenario");
  command->footer("Exit status: 0 converged, 1 wrong input or usage, 2 not converged (the best estimate is written).");
  const Options option{command};
  add_tracking(option, arguments.tracking);
  option("--solver", arguments.solver, "NAME",
         "gauss-newton (default), augmented-lagrangian, ipopt or nlopt:ALGORITHM");
  command->add_flag("--graduated", arguments.graduated,
                    "Graduated non-convexity: robust losses narrow from least squares to their own scale");
  option.repeatable("--ipopt", arguments.ipopt, "KEY=VALUE", "An option of Ipopt's own");
  option("--hessian", arguments.hessian, "NAME",
         "For ipopt: automatic (default), gauss-newton, exact or limited-memory");
  option("--max-iterations", arguments.max_iterations, "N", "Stop after N iterations");
  option("--time-limit", arguments.time_limit, "SECONDS", "Stop after so long");
  option("--out", arguments.out, "DIR", "Write trajectories, errors, summary.json and plots to DIR");
  option("--plots", arguments.plots, "svg|png|off", "Format of the plots in DIR (default svg)");
  command->add_flag("--json", arguments.json, "Print summary.json, and nothing else");
  command->add_flag("--quiet", arguments.quiet, "Print no table, progress or notes");
}

void add_navigate(CLI::App& app, NavigateArguments& arguments) {
  CLI::App* command = app.add_subcommand("navigate", "Estimate the chaser's own trajectory from its own raw sensors");
  command->footer("Exit status: 0 converged, 1 wrong input or usage, 2 not converged (the best estimate is written).");
  NavigationArguments& navigation = arguments.navigation;
  command->add_option("scenario", navigation.scenario, "A scenario folder with an imu, dvl, depth, gps, heading")
      ->type_name("SCENARIO")
      ->required();
  const Options option{command};
  option.repeatable("--without", navigation.without, "SENSOR", "Leave a sensor out");
  option("--keyframe-interval", navigation.keyframe_interval, "SECONDS", "In place of the scenario's");
  option.repeatable("--noise", navigation.noise, "SENSOR=v,v,...",
                    "Standard deviations in place of the scenario's; of the imu its accelerometer, gyroscope and their "
                    "bias walks");
  option.repeatable("--loss", navigation.loss, "[SENSOR=]NAME[:SCALE]",
                    "Robust loss of the measurements: huber, cauchy, geman-mcclure or tukey, scale in sigmas (default "
                    "1)");
  option.repeatable("--delay", navigation.delay, "SENSOR=SECONDS", "A line stamped t was valid so long before");
  option.repeatable("--fit-delay", navigation.fit_delay, "SENSOR",
                    "Find the delay, up to 1 s, that makes the data likeliest, first");
  command->add_flag("--dvl-scale", navigation.dvl_scale, "Estimate the DVL's scale factor");
  command->add_flag("--preintegrated-dvl", navigation.preintegrated_dvl,
                    "To compare: DVL velocities summed up between keyframes");
  command->add_flag("--no-earth-rotation", navigation.no_earth_rotation, "Take the world as inertial");
  option("--alignment", navigation.alignment, "SECONDS", "Data that decide an unknown heading (default 30)");
  option("--after", arguments.after, "SECONDS", "Summarise the errors after the first so many seconds, too");
  option("--max-iterations", arguments.max_iterations, "N", "Stop a solve after N iterations");
  option("--time-limit", arguments.time_limit, "SECONDS", "Stop a solve after so long");
  option("--out", arguments.out, "DIR", "Write trajectory, errors, summary.json and plots to DIR");
  option("--plots", arguments.plots, "svg|png|off", "Format of the plots in DIR (default svg)");
  command->add_flag("--json", arguments.json, "Print summary.json, and nothing else");
  command->add_flag("--quiet", arguments.quiet, "Print no table, progress or notes");
}

void add_track(CLI::App& app, TrackArguments& arguments) {
  CLI::App* command =
      app.add_subcommand("track", "Track chaser and target line by line, as data come, over a sliding window");
  command->footer(
      "Prints a line a second of data: of the target range, bearing (starboard positive), elevation, speed, heading "
      "(clockwise from north: the world's y, of NED-FRD x) and sigma of its position relative to the chaser; then how "
      "long updates took, what was refused and, where there is truth, errors of the newest state and of predictions.\n"
      "Lines of --stdin are NAME,t,...: the name of a sensor and a row of its csv, or odometry,t,x,y,z,qx,qy,qz,qw.\n"
      "Exit status: 0 tracked, also until an interrupt, 1 wrong input or usage, 2 there was nothing to track.");
  const Options option{command};
  add_target_motion(option, arguments.tracking, "soft; online they can only be soft");
  option("--window", arguments.window, "SECONDS", "What is older is marginalised (default 60)");
  option("--keyframes", arguments.keyframes, "N", "And what is more than N keyframes back (alone: no other window)");
  option("--iterations", arguments.iterations, "N", "At most, an update (default 12)");
  option("--alignment", arguments.alignment, "SECONDS",
         "By the chaser's own sensors: what decides a heading that none measures (default 30)");
  command->add_flag("--dvl-scale", arguments.dvl_scale, "Estimate the DVL's scale factor");
  option("--predict", arguments.predict, "LIST", "Seconds ahead to predict the target (default 5,10)");
  option("--until", arguments.until, "SECONDS", "Stop after so many seconds of data");
  command->add_flag("--realtime", arguments.realtime, "Each line at its time, not as fast as possible");
  command->add_flag("--stdin", arguments.standard_input,
                    "Settings from the folder's scenario.yaml, data from standard input");
  option("--out", arguments.out, "DIR", "Write trajectories as filtered, track.csv, errors.csv, summary.json to DIR");
  command->add_flag("--json", arguments.json, "Print summary.json, and nothing else");
  command->add_flag("--quiet", arguments.quiet, "Print nothing but errors");
}

void add_compare(CLI::App& app, CompareArguments& arguments) {
  CLI::App* command = app.add_subcommand("compare", "Run every solver on a scenario: no, soft and hard constraints");
  command->footer(
      "The constraints are those that the options above name, whichever way; without any, no sway or heave and surge "
      "of zero or more. Exit status: 0 all were run, however they did, 1 wrong input or usage, 2 interrupted.");
  const Options option{command};
  add_tracking(option, arguments.tracking);
  option("--solvers", arguments.solvers, "LIST",
         "Of gauss-newton, augmented-lagrangian, ipopt, ipopt:HESSIAN, nlopt:ALGORITHM, nlopt (default all)");
  option("--constraints", arguments.constraints, "LIST", "Of none, soft and hard (default all three)");
  option("--time-limit", arguments.time_limit, "SECONDS", "Stop each solve after so long (default 60)");
  option("--dense-keyframes", arguments.dense_keyframes, "N",
         "Run all on the first N keyframes too, for solvers that keep dense matrices (default 24, or none with "
         "--max-keyframes)");
  option("--out", arguments.out, "DIR", "Write compare.csv, compare_progress.csv and a plot of cost by time to DIR");
  option("--plots", arguments.plots, "svg|png|off", "Format of the plot in DIR (default svg)");
  command->add_flag("--json", arguments.json, "Print JSON in place of the tables");
  command->add_flag("--quiet", arguments.quiet, "Print no table, progress or notes");
}

void add_models(CLI::App& app, ModelsArguments& arguments) {
  CLI::App* command = app.add_subcommand("models", "Compare motion models of the target on a scenario, in one table");
  command->footer(
      "A model is [MODEL][+CONSTRAINT[:VALUES][:soft|hard]]…, e.g. constant-twist+non-holonomic:hard+surge:0,2.5:soft "
      "or "
      "all:hard. MODEL: constant-twist (default), mode-b, constant-velocity, multi-horizon, white-noise-acceleration, "
      "steady-course. CONSTRAINT: non-holonomic, roll-pitch, surge:MIN,MAX, yaw-rate:MAX, all; also horizons:LIST. "
      "--surge and --yaw-rate give the limits of models that name none.\nExit status: 0 converged, 1 wrong input or "
      "usage, 2 some model did not converge or interrupted.");
  const Options option{command};
  add_tracking(option, arguments.tracking);
  option.repeatable("--models", arguments.models, "LIST", "Models by commas, see below (default: all, soft and hard)");
  option("--solver", arguments.solver, "NAME",
         "As for estimate (default gauss-newton, augmented-lagrangian for hard constraints)");
  option("--time-limit", arguments.time_limit, "SECONDS", "Stop each solve after so long");
  option("--out", arguments.out, "DIR", "Write models.csv to DIR");
  command->add_flag("--json", arguments.json, "Print JSON in place of the table");
  command->add_flag("--quiet", arguments.quiet, "Print no table, progress or notes");
}

void add_demo(CLI::App& app, DemoArguments& arguments) {
  CLI::App* command = app.add_subcommand("demo", "Run a small example: " + listed(demo_names(), "or"));
  command->footer("Exit status: 0 converged, 1 wrong input or usage, 2 not converged.");
  command->add_option("name", arguments.name, "fig3: poses that the constant-twist prior alone puts on an arc")
      ->type_name("NAME")
      ->required();
  const Options option{command};
  option("--solver", arguments.solver, "NAME", "gauss-newton (default), ipopt or nlopt:ALGORITHM");
  option("--out", arguments.out, "DIR", "Write the table and a picture to DIR");
  option("--plots", arguments.plots, "svg|png|off", "Format of the picture in DIR (default svg)");
}

void add_simulate(CLI::App& app, SimulateArguments& arguments) {
  CLI::App* command =
      app.add_subcommand("simulate", "Write a made-up scenario folder: " + listed(simulation_names(), "or"));
  command->footer("The same options give the same numbers. Exit status: 0 written, 1 wrong input or usage.");
  command
      ->add_option("name", arguments.name,
                   "dive: a survey dive, by its own sensors alone; docking: a chaser and its target, as docking_a")
      ->type_name("NAME")
      ->required();
  const Options option{command};
  option("--out", arguments.out, "DIR", "The folder to write (needed)");
  option("--minutes", arguments.minutes, "N", "How long it takes (default 20)");
  option("--seed", arguments.seed, "N", "Of all noise, a whole number above zero (default 1)");
  option("--grade", arguments.grade, "NAME", "dive: its sensors, mems (default) or tactical");
  option("--latitude", arguments.latitude, "DEG", "dive: where, for the Earth's rotation and gravity (default 60)");
  option("--keyframe-interval", arguments.keyframe_interval, "S", "dive: as written to scenario.yaml (default 1)");
  option("--surfacings", arguments.surfacings, "N", "dive: how often it comes up for GPS on the way (default never)");
}

void print_scenarios() {
  for (const std::string& name : scenario_names(builtin_scenarios())) {
    const YamlSection yaml = YamlSection::load(builtin_scenarios() / name / "scenario.yaml");
    fmt::print("{:<20} {}\n", name, yaml.has("description") ? yaml.text("description") : "");
  }
}

/// What is wrong with a command line, naming the near word where one is unknown.
std::string message(const CLI::ParseError& error, const CLI::App& app) {
  const CLI::App* command = app.get_subcommands().empty() ? &app : app.get_subcommands().front();
  if (const std::vector<std::string> extras = app.remaining(true); !extras.empty()) {
    std::vector<std::string> known;
    for (const CLI::Option* option : command->get_options()) known.push_back(option->get_name());
    for (const CLI::App* subcommand : command->get_subcommands({})) known.push_back(subcommand->get_name());
    const std::string word = extras.front().substr(0, extras.front().find('='));
    const char* const kind = word.starts_with("-") ? "option" : command == &app ? "command" : "argument";
    return fmt::format("unknown {} {}{}", kind, quote(word), did_you_mean(word, known));
  }
  const std::string text = error.what();
  const std::string help = command == &app ? "tandem --help" : "tandem " + command->get_name() + " --help";
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error)) {
    const bool repeated = text.find("At Most") != std::string::npos;
    return fmt::format("{} {} (see {})", text.substr(0, text.find(':')), repeated ? "is given twice" : "needs a value",
                       help);
  }
  return fmt::format("{} (see {})", text, help);
}

}  // namespace

int run_command_line(int argc, const char* const* argv, const std::string& version) try {
  CLI::App app("Joint estimation of a vehicle and the moving target it observes", "tandem");
  app.set_version_flag("--version", "tandem " + version);
  app.require_subcommand(1);
  EstimateArguments arguments;
  add_estimate(app, arguments);
  NavigateArguments navigate_arguments;
  add_navigate(app, navigate_arguments);
  TrackArguments track_arguments;
  add_track(app, track_arguments);
  CompareArguments compare_arguments;
  add_compare(app, compare_arguments);
  ModelsArguments models_arguments;
  add_models(app, models_arguments);
  DemoArguments demo_arguments;
  add_demo(app, demo_arguments);
  SimulateArguments simulate_arguments;
  add_simulate(app, simulate_arguments);
  app.add_subcommand("scenarios", "List the built-in scenarios");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    fmt::print(stderr, "tandem: {}\n", message(error, app));
    return kBadInput;
  }
  if (app.got_subcommand("estimate")) return run_estimate(arguments);
  if (app.got_subcommand("navigate")) return run_navigate(navigate_arguments);
  if (app.got_subcommand("track")) return run_track(track_arguments);
  if (app.got_subcommand("compare")) return run_compare(compare_arguments);
  if (app.got_subcommand("models")) return run_models(models_arguments);
  if (app.got_subcommand("demo")) return run_demo(demo_arguments);
  if (app.got_subcommand("simulate")) return run_simulate(simulate_arguments);
  print_scenarios();
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "tandem: {}\n", error.what());
  return kBadInput;
}

}  // namespace tandem

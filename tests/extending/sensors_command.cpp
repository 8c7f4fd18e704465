// Example of docs/contributing.md, "A new command": the complete `tandem sensors`.
#include <memory>

#include <fmt/format.h>

#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_file.hpp>

namespace tandem {
namespace {

/// Values of all options.
struct SensorsRequest {
  ProblemRequest problem;
  int least = 1;
  Output output;
};

int run_sensors(const SensorsRequest& request, const CommandOptions& option) {
  const Scenario scenario = read_problem(request.problem, option);
  std::string table = "sensor,measurements\n";
  for (const TargetSensor& sensor : scenario.data.sensors)
    if (sensor.measurements.size() >= std::size_t(request.least))
      table += fmt::format("{},{}\n", sensor.name, sensor.measurements.size());

  Results results;
  results.table = [&] { return table; };
  results.write = [&](const std::filesystem::path& folder) { write_file(folder / "sensors.csv", table); };
  return finish(request.output, results);
}

}  // namespace

Command sensors_command() {
  return {[](CommandOptions& option) {
    const auto request = std::make_shared<SensorsRequest>();
    add_scenario(option, request->problem.scenario, "A scenario folder, or the name of a built-in scenario");
    add_sensors(option, request->problem.sensors);  // --without, --noise, --loss, --delay
    option.group("Table");
    option("--least", "N", "Sensors with N measurements or more", request->least, parse_count);
    add_output(option, request->output, {.writes = "Write sensors.csv to DIR", .plots = false, .prints = false});
    return [request, &option] { return run_sensors(*request, option); };
  }};
}

TANDEM_COMMAND(sensors, "Files", "Count the measurements of each sensor of a scenario")

}  // namespace tandem

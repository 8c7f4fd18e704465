#include <fmt/format.h>

#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/inspection/scenario_inspection.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/support/output_file.hpp>

namespace tandem {
namespace {

struct InfoRequest {
  std::string scenario, page;
  Output output;
};

int run_info(const InfoRequest& request) {
  const ScenarioInspection scenario = inspect_scenario(find_scenario(request.scenario, builtin_scenarios()));
  if (!request.page.empty()) replace_file(request.page, inspection_page(scenario));
  Results results;
  results.table = [&] {
    return inspection_text(scenario) + (request.page.empty() ? "" : fmt::format("\nWritten to {}\n", request.page));
  };
  results.json = [&] { return inspection_json(scenario); };
  return finish(request.output, results);
}

}  // namespace

Command info_command() {
  return {[](CommandOptions& option) {
            const auto request = std::make_shared<InfoRequest>();
            option.footer("Also reads folders with defects, and reports suspicious data.");
            option.exit_status("Exit status: 0 shown, 1 invalid input or usage.");
            option.argument("scenario", "SCENARIO", "Scenario folder, or name of a built-in scenario",
                            request->scenario);
            option.group("Output");
            option("--page", "FILE", "Write a self-contained page with strips and a plan view to FILE", request->page,
                   [](const std::string&, const std::string& text) { return text; });
            add_printing(option, request->output, false);
            return [request] { return run_info(*request); };
          },
          false, [] { return std::vector{inspection_json_keys()}; }};
}

TANDEM_COMMAND(info, "Files", "Show sensors, rates, gaps and ranges of a scenario folder")

}  // namespace tandem

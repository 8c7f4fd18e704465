#include <fmt/format.h>

#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/support/json_fields.hpp>

namespace tandem {
namespace {

struct BuiltinScenario {
  std::string name, description, folder;
};
using BuiltinScenarios = std::vector<BuiltinScenario>;

BuiltinScenarios read_builtin_scenarios() {
  BuiltinScenarios result;
  for (const std::string& name : scenario_names(builtin_scenarios())) {
    const std::filesystem::path folder = builtin_scenarios() / name;
    const YamlSection yaml = YamlSection::load(folder / "scenario.yaml");
    result.push_back({name, yaml.has("description") ? yaml.text("description") : "", folder.string()});
  }
  return result;
}

JsonFields<BuiltinScenarios> scenarios_fields() {
  using S = BuiltinScenario;
  return JsonFields<BuiltinScenarios>().add_list(
      "scenarios", "built-in scenarios",
      JsonFields<S>()
          .add("name", "name", [](const S& s) { return s.name; })
          .add("description", "description", [](const S& s) { return s.description; })
          .add("folder", "scenario folder", [](const S& s) { return s.folder; }),
      [](const BuiltinScenarios& all) -> const BuiltinScenarios& { return all; });
}

}  // namespace

Command scenarios_command() {
  return {[](CommandOptions& option) {
            const auto output = std::make_shared<Output>();
            option.exit_status("Exit status: 0 listed, 1 invalid input or usage.");
            add_printing(option, *output, false);
            return [output] {
              const BuiltinScenarios scenarios = read_builtin_scenarios();
              Results results;
              results.table = [&] {
                std::string text;
                for (const BuiltinScenario& s : scenarios) text += fmt::format("{:<20} {}\n", s.name, s.description);
                return text;
              };
              results.json = [&] { return json_text(json_document("scenarios", scenarios_fields(), scenarios)); };
              return finish(*output, results);
            };
          },
          false, [] { return std::vector{describe_json("--json", "scenarios", scenarios_fields())}; }};
}

TANDEM_COMMAND(scenarios, "Files", "List the built-in scenarios")

}  // namespace tandem

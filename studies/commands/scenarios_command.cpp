#include <fmt/format.h>

#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

Command scenarios_command() {
  return {[](CommandOptions&) {
    return [] {
      for (const std::string& name : scenario_names(builtin_scenarios())) {
        const YamlSection yaml = YamlSection::load(builtin_scenarios() / name / "scenario.yaml");
        fmt::print("{:<20} {}\n", name, yaml.has("description") ? yaml.text("description") : "");
      }
      return kDone;
    };
  }};
}

}  // namespace tandem

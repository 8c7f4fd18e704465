#include <algorithm>

#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/commands/tuning_options.hpp>
#include <tandem/studies/tuning/model_settings.hpp>

namespace tandem {
namespace {

TunedProblem with_settings(const Scenario& scenario, const ModelSettings& settings) {
  ProblemOfWords found = apply_words(words_of(settings), scenario);
  return {std::move(found.scenario), found.target, found.own};
}

}  // namespace

TuneOptions tune_options(const CommandOptions& option) {
  TuneOptions options;
  options.apply = with_settings;
  for (const auto& [info, values] : option.given()) {
    if (info.group != kTarget && info.group != kSensors && info.group != kOwnSensors) continue;
    if (info.key() == "force") continue;
    for (const std::string& value : values) {
      const std::size_t equals = value.find('=');
      if (info.takes.empty())
        options.start[info.key()] = "true";
      else if (info.repeatable && equals != value.npos)
        options.start[info.key() + " " + value.substr(0, equals)] = value.substr(equals + 1);
      else if (info.repeatable)  // --without SENSOR, --noise-from FILE, --loss NAME
        options.start[info.key() + "=" + value] = "true";
      else
        options.start[info.key()] = value;
    }
  }
  return options;
}

double default_tuning_time(std::span<const Scenario> scenarios) {
  const bool own_sensors = std::any_of(scenarios.begin(), scenarios.end(),
                                       [](const Scenario& scenario) { return scenario.navigation.has_value(); });
  return own_sensors ? 110 : 55;
}

TunedProblem tuned_problem(const Tuning& tuning, const Scenario& scenario) {
  return with_settings(scenario, tuning.selection.settings);
}

}  // namespace tandem

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/study/study.hpp>
#include <tandem/studies/support/fnv1a.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr double kMaxTrials = 1e7;

/// Finalizer and increment of SplitMix64 (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators").
constexpr std::uint64_t kGamma = 0x9e3779b97f4a7c15u;
constexpr std::uint64_t splitmix64(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

std::size_t positive_integer(const YamlSection& yaml, const std::string& key) {
  const auto count = parse_positive_integer(yaml.text(key));
  if (!count) yaml.fail(key, fmt::format("{} must be a positive integer, not {}", key, quote(yaml.text(key))));
  return static_cast<std::size_t>(*count);
}

/// Returns the values of a key in the form that `read` returns. Fails for an empty list and for repeated values.
template <class Read>
std::vector<std::string> values_of(const YamlSection& yaml, const std::string& key, Read read) {
  std::vector<std::string> values;
  for (const std::string& text : yaml.texts(key)) {
    std::string value;
    try {
      value = read(text);
    } catch (const Error& error) {
      yaml.fail(key, error.what());
    }
    if (std::find(values.begin(), values.end(), value) != values.end())
      yaml.fail(key, fmt::format("{} lists {} twice", key, quote(value)));
    values.push_back(std::move(value));
  }
  if (values.empty()) yaml.fail(key, fmt::format("{} is empty: the grid has no trials", key));
  return values;
}

std::vector<StudyAxis> read_axes(const YamlSection& parameters, Simulated simulation) {
  std::vector<std::string> known;
  for (const auto& parameter : trial_parameters(simulation)) known.push_back(parameter.name);
  parameters.allow_only(known);
  std::vector<StudyAxis> axes;
  for (const std::string& key : parameters.keys()) {
    const auto& parameter = parameter_named(trial_parameters(simulation), "a study", key);
    axes.push_back({key, values_of(parameters, key, [&](const std::string& text) {
                      TrialSettings settings;
                      parameter.set(settings, key, text);
                      return parameter.text(settings);
                    })});
  }
  return axes;
}

Simulated parse_simulation(const YamlSection& yaml) {
  std::vector<std::string> names;
  const std::string text = yaml.text("simulation");
  for (const Simulated simulated : {Simulated::docking, Simulated::dive}) {
    if (name(simulated) == text) return simulated;
    names.emplace_back(name(simulated));
  }
  yaml.fail("simulation", fmt::format("simulation must be {}, not {}{}", listed(names, "or"), quote(text),
                                      did_you_mean(text, names)));
}

/// Throws Error for parameters that have no effect or contradict each other.
void check_combinations(const Study& study, const std::filesystem::path& file) {
  const auto axis = [&](const char* parameter) -> const StudyAxis* {
    for (const StudyAxis& a : study.axes)
      if (a.parameter == parameter) return &a;
    return nullptr;
  };
  const auto on = [&](const char* parameter) {
    return axis(parameter) && axis(parameter)->values != std::vector<std::string>{"0"};
  };
  const auto fail = [&](const std::string& why) { throw Error(fmt::format("{}: {}", file.string(), why)); };
  if (axis("newest") && !axis("window")) fail("parameter newest needs parameter window [s]");
  for (const char* parameter : {"chance", "information"})
    if (axis(parameter) && !axis("rendezvous")) fail(fmt::format("parameter {} needs parameter rendezvous", parameter));
  if (axis("rendezvous") && (study.models.size() > 1 || study.solvers.size() > 1 || study.time_limit > 0))
    fail("parameter rendezvous replaces models and solvers: give one model, no solvers and no time_limit");
  if (study.simulation != Simulated::dive) return;
  if (axis("target") && axis("target")->values.size() > 1)
    fail("parameter target must be 0 or 1 for the whole study, because models need a target");
  if (study.has_target() && on("window"))
    fail("parameter window does not support a dive with a target: remove one of them");
  if (on("estimate_dvl_scale") && on("preintegrated_dvl"))
    fail("estimate_dvl_scale does not support preintegrated_dvl: remove one of them");
  for (const char* parameter : {"usbl_period", "usbl_sigma", "usbl_sigma_factor", "twist_sigma_factor"})
    if (axis(parameter) && !study.has_target()) fail(fmt::format("parameter {} needs target: 1", parameter));
}

std::string list_text(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, " | ")); }

}  // namespace

bool Study::has_target() const { return simulation != Simulated::dive || settings(place(0)).dive.target; }

const NamedParameter<TrialSettings>& Study::parameter(const std::string& parameter_name) const {
  return parameter_named(trial_parameters(simulation), name, parameter_name);
}

std::size_t Study::cells() const {
  std::size_t n = 1;
  for (const StudyAxis& axis : axes) n *= axis.values.size();
  return n;
}

TrialPlace Study::place(std::size_t trial) const {
  TrialPlace place{0, std::vector<std::size_t>(axes.size()), 0, 0};
  const auto take = [&](std::size_t size) {
    const std::size_t digit = trial % size;
    trial /= size;
    return digit;
  };
  place.solver = take(solvers.size());
  place.model = take(models.size());
  for (std::size_t a = axes.size(); a-- > 0;) place.values[a] = take(axes[a].values.size());
  place.replicate = trial;
  return place;
}

std::string Study::canonical() const {
  std::string text = fmt::format("tandem study 1\nsimulation: {}\n", tandem::name(simulation));
  for (const StudyAxis& axis : axes) text += fmt::format("{}: {}\n", axis.parameter, list_text(axis.values));
  text += fmt::format("models: {}\nsolvers: {}\nseeds: {}\nseed: {}\ncovariances: {}\ntime_limit: {}\n",
                      list_text(models), list_text(solvers), seeds, seed, covariances, time_limit);
  return text;
}

std::uint64_t Study::hash() const { return fnv1a(canonical()); }

std::uint64_t Study::seed_of(std::size_t replicate) const { return splitmix64(hash() + (replicate + 1) * kGamma); }

TrialSettings Study::settings(const TrialPlace& place) const {
  TrialSettings settings;
  for (std::size_t a = 0; a < axes.size(); ++a)
    parameter(axes[a].parameter).set(settings, axes[a].parameter, axes[a].values[place.values[a]]);
  settings.docking.seed = settings.dive.seed = seed_of(place.replicate);
  return settings;
}

NamedModel Study::model(const TrialPlace& place) const { return parse_model_spec("models", models[place.model], {}); }

AnySolver Study::solver(const TrialPlace& place) const {
  const std::string& named = solvers[place.solver];
  AnySolver solver = named == Study::kAutomatic ? solver_for(model(place)) : parse_solver("solvers", named);
  if (time_limit > 0) common(solver).time_limit = time_limit;
  return solver;
}

std::string Study::cell_text(const TrialPlace& place) const {
  std::string text;
  for (std::size_t a = 0; a < axes.size(); ++a)
    if (axes[a].values.size() > 1)
      text += fmt::format("{}{}={}", text.empty() ? "" : ", ", axes[a].parameter, axes[a].values[place.values[a]]);
  return text;
}

Study read_study(const std::filesystem::path& file) { return parse_study(read_text(file), file); }

Study parse_study(const std::string& text, const std::filesystem::path& file) {
  const YamlSection yaml = YamlSection::parse(text, file);
  yaml.allow_only({"name", "question", "simulation", "parameters", "models", "solvers", "seeds", "seed", "covariances",
                   "time_limit"});
  Study study;
  study.name = yaml.text("name");
  if (yaml.has("question")) study.question = yaml.text("question");
  if (yaml.has("simulation")) study.simulation = parse_simulation(yaml);
  if (yaml.has("parameters")) study.axes = read_axes(yaml.section("parameters"), study.simulation);
  study.models = {Study::kOwnSensors};
  study.solvers = {Study::kAutomatic};
  if (!study.has_target()) {
    for (const char* key : {"models", "solvers"})
      if (yaml.has(key)) yaml.fail(key, fmt::format("{0} need a target: set target: 1 or remove {0}", key));
  } else {
    study.models = values_of(yaml, "models", [](const std::string& spec) {
      parse_model_spec("models", spec, {});
      return spec;
    });
  }
  if (yaml.has("solvers"))
    study.solvers = values_of(yaml, "solvers", [](const std::string& solver) {
      if (solver != Study::kAutomatic) parse_solver("solvers", solver);
      return solver;
    });
  study.seeds = positive_integer(yaml, "seeds");
  if (yaml.has("seed")) study.seed = positive_integer(yaml, "seed");
  if (yaml.has("covariances")) study.covariances = yaml.boolean("covariances");
  if (yaml.has("time_limit")) {
    study.time_limit = yaml.number("time_limit");
    if (study.time_limit <= 0) yaml.fail("time_limit", "time_limit must be above zero");
  }
  check_combinations(study, file);
  double trials = double(study.seeds) * double(study.models.size()) * double(study.solvers.size());
  for (const StudyAxis& axis : study.axes) trials *= double(axis.values.size());
  if (trials > kMaxTrials)
    throw Error(fmt::format("{}: the grid has {:g} trials; the maximum is {:g}", file.string(), trials, kMaxTrials));
  return study;
}

}  // namespace tandem

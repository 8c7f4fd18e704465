#include <memory>

#include <fmt/format.h>

#include <tandem/solvers/calibration/default_solve.hpp>
#include <tandem/solvers/calibration/held_out.hpp>
#include <tandem/solvers/calibration/saved_values.hpp>
#include <tandem/solvers/calibration/scale_noise.hpp>
#include <tandem/studies/calibration/scenario_problems.hpp>

namespace tandem {
namespace {

std::vector<Problem*> raw_pointers(const CalibrationProblems& problems) {
  std::vector<Problem*> plain;
  for (const auto& problem : problems) plain.push_back(&problem->problem());
  return plain;
}

std::vector<MeasuredBlock> measured_of(const CalibrationProblems& problems) {
  std::vector<MeasuredBlock> measured;
  for (std::size_t p = 0; p < problems.size(); ++p)
    for (const EntryBlock& b : problems[p]->blocks)
      if (b.measured_at) measured.push_back({b.block, static_cast<int>(p)});
  return measured;
}

/// Moves the names of model parameters from `free` to `parameters` and returns the other options.
ScenarioCalibrationOptions extract_model_parameters(ScenarioCalibrationOptions options, const Scenario& scenario,
                                                    std::vector<ModelParameter>& parameters,
                                                    std::vector<ModelParameterEntry>& entries) {
  if (options.free.empty()) return options;
  entries = model_parameter_entries(scenario, options.target, options.own);
  parameters = take_model_parameters(scenario, options.target, options.own, options.free);
  if (options.free.empty()) options.noise = false;
  return options;
}

}  // namespace

ScenarioProblems::ScenarioProblems(std::vector<Scenario> scenarios, const ScenarioCalibrationOptions& options)
    : options_(options),
      noise_options_(extract_model_parameters(options, scenarios.front(), model_parameters_, model_parameter_entries_)),
      scenarios_(model_parameters_.empty() ? std::vector<Scenario>() : scenarios),
      problems_(build_by(std::move(scenarios), given_values())),
      raw_problems_(raw_pointers(problems_)),
      noise_(problems_, noise_options_, model_parameter_entries_),
      given_(raw_problems_, noise_.groups) {}

std::vector<MeasuredBlock> ScenarioProblems::measured() const { return measured_of(problems_); }

int ScenarioProblems::measured_rows() const {
  int rows = 0;
  for (const MeasuredBlock& m : measured())
    rows += static_cast<int>(raw_problems_[std::size_t(m.problem)]->noise(m.block).dim());
  return rows;
}

CalibrationProblems ScenarioProblems::build_by(std::vector<Scenario> scenarios, const Eigen::VectorXd& values) const {
  CalibrationProblems built;
  for (Scenario& scenario : scenarios) {
    for (std::size_t i = 0; i < model_parameters_.size(); ++i)
      model_parameters_[i].set(scenario, values[Eigen::Index(i)]);
    NavigationOptions own = options_.own;
    options_.stop.limit(own.solver);
    built.push_back(
        std::make_unique<CalibrationProblem>(std::move(scenario), options_.target, own, options_.stop.with_grace()));
  }
  return built;
}

BuiltProblems ScenarioProblems::build(const Eigen::VectorXd& values) const {
  const auto all = std::make_shared<CalibrationProblems>(build_by(scenarios_, values));
  BuiltProblems built;
  for (const auto& problem : *all) built.problems.emplace_back(all, &problem->problem());
  for (NoiseGroup& group : NoiseParameters(*all, noise_options_, model_parameter_entries_).groups)
    if (noise_.has(group.name)) built.groups.push_back(std::move(group));
  built.measured = measured_of(*all);
  return built;
}

/// Rebuilds the problems from other model parameters. Starts from the solution with the given values, since folds may
/// have led to another minimum. Does nothing after a stop.
void ScenarioProblems::rebuild_at(const Eigen::VectorXd& values) try {
  CalibrationProblems moved = build_by(scenarios_, values);
  if (given_problems_.empty()) given_problems_.swap(problems_);
  for (std::size_t p = 0; p < raw_problems_.size(); ++p) {
    detail::copy_values(given_problems_[p]->problem(), moved[p]->problem());
    raw_problems_[p] = &moved[p]->problem();
  }
  problems_ = std::move(moved);
  noise_.groups = detail::counterparts(raw_problems_, std::move(noise_.groups));
} catch (const Stopped&) {
}

void ScenarioProblems::solve() {
  for (Problem* problem : raw_problems_)
    if (!options_.stop.reached()) detail::solve_with_default(*problem, options_.stop);
}

Eigen::VectorXd ScenarioProblems::given_values() const {
  Eigen::VectorXd values(Eigen::Index(model_parameters_.size()));
  for (std::size_t i = 0; i < model_parameters_.size(); ++i) values[Eigen::Index(i)] = model_parameters_[i].given;
  return values;
}

std::vector<BuiltParameter> ScenarioProblems::built_parameters() const {
  std::vector<BuiltParameter> parameters;
  for (const ModelParameter& p : model_parameters_) parameters.push_back({p.name, p.given, options_.prior});
  return parameters;
}

/// Returns the options with the blocks of the current problems, which may have been rebuilt.
CalibrationOptions ScenarioProblems::with_current_blocks(CalibrationOptions options) const {
  if (!options.measured.empty()) options.measured = measured();
  return options;
}

Calibration ScenarioProblems::calibrate(const CalibrationOptions& given, std::vector<CalibratedParameter>& parameters) {
  const CalibrationOptions options = with_current_blocks(given);
  Calibration found;
  std::vector<CalibratedNoise> model_results;
  if (model_parameters_.empty()) {
    found = tandem::calibrate(raw_problems_, noise_.groups, options);
    apply(found, raw_problems_, noise_.groups);
  } else {
    BuiltCalibration built =
        calibrate_built([this](const Eigen::VectorXd& values) { return build(values); }, built_parameters(), options);
    found = std::move(built.noise);
    found.status = built.status;
    found.message = fmt::format("{}; the problems were built {} times", built.message, built.builds);
    found.gain = built.gain;
    found.iterations = built.iterations;
    found.solves = built.solves;
    found.noise.resize(noise_.groups.size());
    model_results = std::move(built.parameters);
    rebuild_at(built.values);
    detail::scale_noise(raw_problems_, noise_.groups, found);
    solve();
  }
  found.iterations = iterations_ += found.iterations;
  found.solves = solves_ += found.solves;
  parameters.clear();
  for (std::size_t g = 0; g < noise_.groups.size(); ++g)
    parameters.push_back({noise_.groups[g].name,
                          problems_.front()->entries[noise_.entry[g]].sigmas[noise_.component[g]], found.noise[g]});
  for (std::size_t i = 0; i < model_parameters_.size(); ++i)
    parameters.push_back({model_parameters_[i].name, model_parameters_[i].given, model_results[i]});
  return found;
}

CrossValidation ScenarioProblems::cross_validate(const std::vector<std::vector<HeldOutMeasurement>>& folds,
                                                 const CalibrationOptions& given) {
  const CalibrationOptions options = with_current_blocks(given);
  std::vector<std::vector<HeldOutMeasurement>> own;
  for (const auto& fold : folds) own.push_back(detail::counterparts(raw_problems_, fold));
  if (model_parameters_.empty()) return tandem::cross_validate(raw_problems_, noise_.groups, own, options);
  return tandem::cross_validate(
      raw_problems_, noise_.groups, own, [this](const Eigen::VectorXd& values) { return build(values); },
      built_parameters(), options);
}

void ScenarioProblems::keep_given(std::size_t parameter) {
  if (parameter < noise_.groups.size()) return noise_.keep_given(parameter);
  model_parameters_.erase(model_parameters_.begin() + std::ptrdiff_t(parameter - noise_.groups.size()));
}

void ScenarioProblems::restore_given() {
  scenarios_.empty() ? given_.restore() : rebuild_at(given_values());
  for (Problem* problem : raw_problems_) detail::solve_with_default(*problem, options_.stop);
}

std::vector<NoiseEntry> ScenarioProblems::given_entries() const {
  std::vector<NoiseEntry> result;
  for (const std::size_t e : noise_.entry) {
    const CalibratedEntry& entry = problems_.front()->entries[e];
    if (result.empty() || result.back().name != entry.name) result.push_back({entry.name, entry.sigmas});
  }
  if (model_parameters_.empty()) return result;
  for (NoiseEntry& entry : entries_of(model_parameters_, scenarios_.front())) result.push_back(std::move(entry));
  return result;
}

void ScenarioProblems::apply_factors(const std::vector<CalibratedParameter>& found,
                                     std::vector<NoiseEntry>& entries) const {
  for (std::size_t p = 0; p < found.size(); ++p) {
    const bool is_noise = p < noise_.groups.size();
    const std::size_t i = is_noise ? p : p - noise_.groups.size();
    const std::string& name = is_noise ? problems_.front()->entries[noise_.entry[i]].name : model_parameters_[i].entry;
    for (NoiseEntry& entry : entries)
      if (entry.name == name)
        entry.sigmas[is_noise ? noise_.component[i] : model_parameters_[i].component] *= found[p].result.factor;
  }
}

}  // namespace tandem

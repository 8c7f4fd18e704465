#include <memory>

#include <fmt/format.h>

#include <tandem/solvers/calibration/scale_noise.hpp>
#include <tandem/solvers/calibration/solve_plainly.hpp>
#include <tandem/studies/calibration/scenario_problems.hpp>

namespace tandem {
namespace {

std::vector<Problem*> plain_of(const CalibrationProblems& problems) {
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

/// Without the numbers that are taken out of its `free`.
ScenarioCalibrationOptions take(ScenarioCalibrationOptions options, const Scenario& scenario,
                                std::vector<ScenarioNumber>& numbers, std::vector<NumberEntry>& entries) {
  if (options.free.empty()) return options;
  entries = number_entries(scenario, options.target, options.own);
  numbers = take_numbers(scenario, options.target, options.own, options.free);
  if (options.free.empty()) options.noise = false;
  return options;
}

}  // namespace

ScenarioProblems::ScenarioProblems(std::vector<Scenario> scenarios, const ScenarioCalibrationOptions& options)
    : options_(options),
      of_noise_(take(options, scenarios.front(), numbers_, number_entries_)),
      kept_(numbers_.empty() ? std::vector<Scenario>() : scenarios),
      problems_(build_by(std::move(scenarios), given_values())),
      plain_(plain_of(problems_)),
      noise_(problems_, of_noise_, number_entries_),
      given_(plain_, noise_.groups) {}

std::vector<MeasuredBlock> ScenarioProblems::measured() const { return measured_of(problems_); }

int ScenarioProblems::measured_rows() const {
  int rows = 0;
  for (const MeasuredBlock& m : measured())
    rows += static_cast<int>(plain_[std::size_t(m.problem)]->noise(m.block).dim());
  return rows;
}

CalibrationProblems ScenarioProblems::build_by(std::vector<Scenario> scenarios, const Eigen::VectorXd& values) const {
  CalibrationProblems built;
  for (Scenario& scenario : scenarios) {
    for (std::size_t i = 0; i < numbers_.size(); ++i) numbers_[i].set(scenario, values[Eigen::Index(i)]);
    NavigationOptions own = options_.own;
    options_.stop.limit(own.solver);
    built.push_back(
        std::make_unique<CalibrationProblem>(std::move(scenario), options_.target, own, options_.stop.with_grace()));
  }
  return built;
}

BuiltProblems ScenarioProblems::build(const Eigen::VectorXd& values) const {
  const auto all = std::make_shared<CalibrationProblems>(build_by(kept_, values));
  BuiltProblems built;
  for (const auto& problem : *all) built.problems.emplace_back(all, &problem->problem());
  for (NoiseGroup& group : NoiseParameters(*all, of_noise_, number_entries_).groups)
    if (noise_.has(group.name)) built.groups.push_back(std::move(group));
  built.measured = measured_of(*all);
  return built;
}

/// To problems by other numbers, from the solution as given: folds may have led to another minimum. Not once it is to stop.
void ScenarioProblems::move_to(const Eigen::VectorXd& values) try {
  CalibrationProblems moved = build_by(kept_, values);
  if (as_given_.empty()) as_given_.swap(problems_);
  for (std::size_t p = 0; p < plain_.size(); ++p) {
    detail::take_values(as_given_[p]->problem(), moved[p]->problem());
    plain_[p] = &moved[p]->problem();
  }
  problems_ = std::move(moved);
} catch (const Stopped&) {
}

void ScenarioProblems::solve() {
  for (Problem* problem : plain_)
    if (!options_.stop.reached()) detail::solve_plainly(*problem, options_.stop);
}

Eigen::VectorXd ScenarioProblems::given_values() const {
  Eigen::VectorXd values(Eigen::Index(numbers_.size()));
  for (std::size_t i = 0; i < numbers_.size(); ++i) values[Eigen::Index(i)] = numbers_[i].given;
  return values;
}

std::vector<BuiltParameter> ScenarioProblems::built_parameters() const {
  std::vector<BuiltParameter> parameters;
  for (const ScenarioNumber& number : numbers_) parameters.push_back({number.name, number.given, options_.prior});
  return parameters;
}

Calibration ScenarioProblems::calibrate(const CalibrationOptions& options,
                                        std::vector<CalibratedParameter>& parameters) {
  Calibration found;
  std::vector<CalibratedNoise> of_numbers;
  if (numbers_.empty()) {
    found = tandem::calibrate(plain_, noise_.groups, options);
  } else {
    BuiltCalibration built =
        calibrate_built([this](const Eigen::VectorXd& values) { return build(values); }, built_parameters(), options);
    found = std::move(built.noise);
    found.status = built.status;
    found.message = fmt::format("{}; problems were built {} times", built.message, built.builds);
    found.gain = built.gain;
    found.iterations = built.iterations;
    found.solves = built.solves;
    found.noise.resize(noise_.groups.size());
    of_numbers = std::move(built.parameters);
    move_to(built.values);
    detail::scale_noise(plain_, noise_.groups, found);
    solve();
  }
  found.iterations = iterations_ += found.iterations;
  found.solves = solves_ += found.solves;
  parameters.clear();
  for (std::size_t g = 0; g < noise_.groups.size(); ++g)
    parameters.push_back({noise_.groups[g].name,
                          problems_.front()->entries[noise_.entry[g]].sigmas[noise_.component[g]], found.noise[g]});
  for (std::size_t i = 0; i < numbers_.size(); ++i)
    parameters.push_back({numbers_[i].name, numbers_[i].given, of_numbers[i]});
  return found;
}

CrossValidation ScenarioProblems::cross_validate(const std::vector<std::vector<LeftOut>>& folds,
                                                 const CalibrationOptions& options) {
  if (numbers_.empty()) return tandem::cross_validate(plain_, noise_.groups, folds, options);
  return tandem::cross_validate(
      plain_, noise_.groups, folds, [this](const Eigen::VectorXd& values) { return build(values); }, built_parameters(),
      options);
}

void ScenarioProblems::keep_given(std::size_t parameter) {
  if (parameter < noise_.groups.size()) return noise_.keep_given(parameter);
  numbers_.erase(numbers_.begin() + std::ptrdiff_t(parameter - noise_.groups.size()));
}

void ScenarioProblems::put_back() {
  kept_.empty() ? given_.restore() : move_to(given_values());
  for (Problem* problem : plain_) detail::solve_plainly(*problem, options_.stop);
}

std::vector<NoiseEntry> ScenarioProblems::given_entries() const {
  std::vector<NoiseEntry> result;
  for (const std::size_t e : noise_.entry) {
    const CalibratedEntry& entry = problems_.front()->entries[e];
    if (result.empty() || result.back().name != entry.name) result.push_back({entry.name, entry.sigmas});
  }
  if (numbers_.empty()) return result;
  for (NoiseEntry& entry : entries_of(numbers_, kept_.front())) result.push_back(std::move(entry));
  return result;
}

void ScenarioProblems::put(const std::vector<CalibratedParameter>& found, std::vector<NoiseEntry>& entries) const {
  for (std::size_t p = 0; p < found.size(); ++p) {
    const bool is_noise = p < noise_.groups.size();
    const std::size_t i = is_noise ? p : p - noise_.groups.size();
    const std::string& name = is_noise ? problems_.front()->entries[noise_.entry[i]].name : numbers_[i].entry;
    for (NoiseEntry& entry : entries)
      if (entry.name == name)
        entry.sigmas[is_noise ? noise_.component[i] : numbers_[i].component] *= found[p].result.factor;
  }
}

}  // namespace tandem

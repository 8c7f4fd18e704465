#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <tandem/studies/comparison/models.hpp>
#include <tandem/studies/study/trial_settings.hpp>

namespace tandem {

/// A parameter of a study with the values it takes.
struct StudyAxis {
  std::string parameter;
  std::vector<std::string> values;  ///< one or more, as the parameter's text() writes them
};

/// Which trial of a study: an entry of its grid, and a replicate.
struct TrialPlace {
  std::size_t replicate;            ///< which seed
  std::vector<std::size_t> values;  ///< of each axis
  std::size_t model, solver;
};

/// A grid of parameters × motion models × solvers × seeds, read from a yaml file:
///
///     name: gaps
///     question: How fast do errors grow while nothing is measured?
///     simulation: docking                                        # optional: or dive
///     parameters: {minutes: 20, blind: 0, gap: [5, 20, 60]}      # a value, or a list of them: an axis of the grid
///     models: [constant-twist, mode-b, non-holonomic:hard]       # as `tandem models` takes them; of a target
///     solvers: [automatic]                                       # or gauss-newton, ipopt, …
///     seeds: 50
///     seed: 1                                                    # optional: another one gives other noise
///     covariances: true                                          # optional: NEES, coverage and NIS
///     time_limit: 60                                             # optional, s: of one solve
///
/// Trial i depends on the study's hash and on i alone. Trials are numbered with the solver counting fastest, then the
/// model, then the values of the last axis … the first, then the replicate. All trials of one replicate draw from one
/// seed, so that models, solvers and values are compared on the same noise:
///
///     seed of replicate r = mix(hash + (r + 1) γ),   mix and γ of SplitMix64 (Steele, Lea & Flood 2014)
///
/// a counter-based generator: it has no state that an order of trials could change.
struct Study {
  std::string name, question;
  Simulated simulation = Simulated::docking;
  std::vector<StudyAxis> axes;               ///< parameters as the file orders them, of one value too
  std::vector<std::string> models, solvers;  ///< without a target: kOwnSensors, kAutomatic
  std::size_t seeds = 0;
  std::uint64_t seed = 1;
  bool covariances = true;
  double time_limit = 0;  ///< s; 0: none

  static constexpr const char* kOwnSensors = "own-sensors";  ///< what stands for a model without a target
  static constexpr const char* kAutomatic = "automatic";     ///< the solver that suits the model

  bool has_target() const;
  std::size_t cells() const;  ///< combinations of values
  std::size_t trials() const { return cells() * models.size() * solvers.size() * seeds; }
  TrialPlace place(std::size_t trial) const;
  /// What identifies the study: its settings in one form, whatever the layout of the file, without name and question.
  std::string canonical() const;
  std::uint64_t hash() const;  ///< FNV-1a of canonical(), 64 bits
  std::uint64_t seed_of(std::size_t replicate) const;

  TrialSettings settings(const TrialPlace& place) const;  ///< with the seed
  const NamedParameter<TrialSettings>& parameter(const std::string& parameter_name) const;
  NamedModel model(const TrialPlace& place) const;  ///< has_target() is required
  /// Of the model where it says automatic: gauss-newton, or augmented-lagrangian where a constraint is hard.
  Solver solver(const TrialPlace& place) const;
  /// "gap=20, speed=2": the values of axes that have several; empty where none has.
  std::string cell_text(const TrialPlace& place) const;
};

/// Throws Error, naming file and line, on anything unknown, with the nearest, on values out of range and on an empty
/// grid.
Study read_study(const std::filesystem::path& file);
/// The same of a text, which errors call `file`.
Study parse_study(const std::string& yaml, const std::filesystem::path& file);

}  // namespace tandem

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <tandem/studies/comparison/models.hpp>
#include <tandem/studies/study/trial_settings.hpp>

namespace tandem {

/// A parameter of a study with its values.
struct StudyAxis {
  std::string parameter;
  std::vector<std::string> values;  ///< at least one, in the form of NamedParameter::text
};

/// Indices of a trial in the grid of its study.
struct TrialPlace {
  std::size_t replicate;            ///< index of the seed
  std::vector<std::size_t> values;  ///< index of the value, per axis
  std::size_t model, solver;
};

/// A grid of parameters × motion models × solvers × seeds, read from a YAML file:
///
///     name: gaps
///     question: How fast do errors grow in gaps without measurements?
///     simulation: docking                                        # optional: or dive
///     parameters: {minutes: 20, blind: 0, gap: [5, 20, 60]}      # a value, or a list: an axis of the grid
///     models: [constant-twist, mode-b, non-holonomic:hard]       # as in `tandem models`; need a target
///     solvers: [automatic]                                       # optional: gauss-newton, ipopt, …
///     seeds: 50
///     seed: 1                                                    # optional: changes the noise
///     covariances: true                                          # optional: NEES, coverage and NIS
///     time_limit: 60                                             # optional: per solve [s]
///
/// Trial i depends only on the study's hash and on i. In the trial number the solver varies fastest, then the model,
/// the axes from last to first, and the replicate. All trials of one replicate share a seed, so models, solvers and
/// parameter values are compared on the same noise:
///
///     seed of replicate r = mix(hash + (r + 1) γ),   mix and γ of SplitMix64 (Steele, Lea & Flood 2014)
///
/// The seeds do not depend on the order in which trials run.
struct Study {
  std::string name, question;
  Simulated simulation = Simulated::docking;
  std::vector<StudyAxis> axes;  ///< all parameters in the order of the file, including those with a single value
  std::vector<std::string> models, solvers;  ///< {kOwnSensors} and {kAutomatic} without a target
  std::size_t seeds = 0;
  std::uint64_t seed = 1;
  bool covariances = true;
  double time_limit = 0;  ///< time limit of one solve [s]; 0: none

  static constexpr const char* kOwnSensors = "own-sensors";  ///< model name of a study without a target
  static constexpr const char* kAutomatic = "automatic";     ///< the default solver of the model

  bool has_target() const;
  std::size_t cells() const;  ///< number of combinations of parameter values
  std::size_t trials() const { return cells() * models.size() * solvers.size() * seeds; }
  TrialPlace place(std::size_t trial) const;
  /// Returns the settings in a canonical form that identifies the study. It does not depend on name, question and file
  /// layout.
  std::string canonical() const;
  std::uint64_t hash() const;  ///< FNV-1a of canonical(), 64 bits
  std::uint64_t seed_of(std::size_t replicate) const;

  TrialSettings settings(const TrialPlace& place) const;  ///< includes the seed
  const NamedParameter<TrialSettings>& parameter(const std::string& parameter_name) const;
  NamedModel model(const TrialPlace& place) const;  ///< requires has_target()
  /// Returns the solver. `automatic` selects gauss-newton, or augmented-lagrangian for a model with hard constraints.
  AnySolver solver(const TrialPlace& place) const;
  /// Returns the values of the axes with several values, as in "gap=20, speed=2"; empty if there is no such axis.
  std::string cell_text(const TrialPlace& place) const;
};

/// Reads a study file. Throws Error that names file and line for an unknown name (with the nearest one), a value out of
/// range, contradicting parameters and an empty grid.
Study read_study(const std::filesystem::path& file);
/// Parses a study from a text. Error messages use `file` as its name.
Study parse_study(const std::string& yaml, const std::filesystem::path& file);

}  // namespace tandem

#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <tandem/studies/rendezvous/rendezvous.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Simulated rendezvous of several methods over the same seeds.
struct RendezvousStudy {
  std::string vehicle;
  RendezvousOptions options;  ///< options of all runs; `method` and `seed` differ between runs
  std::vector<RendezvousMethod> methods;
  std::vector<std::vector<RendezvousRun>> runs;  ///< per method, in the order of the seeds
};

/// Simulates each method with `seeds` seeds, starting at options.seed. Calls `each` after every run and stops if it
/// returns false.
RendezvousStudy study_rendezvous(const Vehicle& vehicle, const RendezvousOptions& options,
                                 const std::vector<RendezvousMethod>& methods, int seeds,
                                 const std::function<bool(RendezvousMethod, const RendezvousRun&)>& each);

/// Returns the processor times of a run's plans [s], without the first plan of each phase.
std::vector<double> replan_seconds(const RendezvousRun& run);

/// Returns the table for a terminal.
std::string report(const RendezvousStudy& study);
/// Returns the content of summary.json.
std::string rendezvous_json(const RendezvousStudy& study);
/// Returns the keys of summary.json.
FileDescription rendezvous_json_keys();

/// Writes runs.csv, rendezvous.csv (the first run, a row per second) and summary.json into `folder`. Throws Error if a
/// file cannot be written.
void write_rendezvous(const RendezvousStudy& study, const std::filesystem::path& folder);
/// Returns the columns of runs.csv and rendezvous.csv.
std::vector<FileDescription> rendezvous_file_columns();

}  // namespace tandem

#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <tandem/studies/planning/rendezvous.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// Many simulated rendezvous, by each of some methods over the same seeds.
struct RendezvousStudy {
  std::string vehicle;
  RendezvousOptions options;  ///< but for method and seed
  std::vector<RendezvousMethod> methods;
  std::vector<std::vector<RendezvousRun>> runs;  ///< of each method, in the order of the seeds
};

/// `seeds` runs each, from options.seed on. `each` is told of every run, and ends the study when it says false.
RendezvousStudy study_rendezvous(const Vehicle& vehicle, const RendezvousOptions& options,
                                 const std::vector<RendezvousMethod>& methods, int seeds,
                                 const std::function<bool(RendezvousMethod, const RendezvousRun&)>& each);

/// The value below which a share q of them lies; nan of none.
double quantile_of(std::vector<double> values, double q);
/// Processor time of a run's plans [s], but for those that had none before them to begin with.
std::vector<double> solve_seconds(const RendezvousRun& run);

/// A table for a terminal; all figures as JSON.
std::string report(const RendezvousStudy& study);
std::string rendezvous_json(const RendezvousStudy& study);

/// Writes runs.csv, rendezvous.csv (the first run, second by second) and summary.json. Throws Error.
void write_rendezvous(const RendezvousStudy& study, const std::filesystem::path& folder);
/// The columns of the first two.
std::vector<CsvDescription> rendezvous_file_columns();

}  // namespace tandem

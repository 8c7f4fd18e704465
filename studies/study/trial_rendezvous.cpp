#include <algorithm>

#include <tandem/solvers/summary.hpp>
#include <tandem/studies/planning/rendezvous.hpp>
#include <tandem/studies/study/trial_rendezvous.hpp>

namespace tandem {
namespace {

std::optional<double> quantile_of_plans(const RendezvousRun& run, double q) {
  std::vector<double> seconds;
  for (const RendezvousStep& step : run.steps)
    if (!step.origin.empty()) seconds.push_back(step.solve_seconds);
  if (seconds.empty()) return {};
  std::sort(seconds.begin(), seconds.end());
  return seconds[std::min(seconds.size() - 1, std::size_t(q * double(seconds.size())))];
}

}  // namespace

void run_rendezvous_trial(const TrialSettings& settings, TrialResult& result) {
  const Vehicle vehicle = read_vehicle("remus_100");
  RendezvousOptions options;
  options.method = *settings.rendezvous;
  options.seed = settings.docking.seed;
  options.chance = settings.chance;
  options.information = settings.information;
  pursue_within(options, vehicle);
  const RendezvousRun run = run_rendezvous(vehicle, options);
  const bool docked = run.outcome == RendezvousOutcome::docked;
  result.status = name(Status::converged);
  result.set("docked", docked);
  if (docked) result.set("dock_s", run.seconds);
  result.set("dock_miss_m", run.least_miss);
  result.set("effort_s", run.effort);
  result.set("keep_out_violation_m", run.keep_out_violation);
  result.set("dock_three_sigma_m", run.three_sigma);
  if (*settings.rendezvous == RendezvousMethod::pursuit) return;
  result.set("violation", run.worst_violation);
  result.set("plans", run.plans);
  result.set("plans_shifted", run.shifted);
  result.set("plan_median_s", quantile_of_plans(run, 0.5));
  result.set("plan_99_s", quantile_of_plans(run, 0.99));
}

}  // namespace tandem

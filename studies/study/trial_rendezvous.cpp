#include <tandem/problem/quantile.hpp>
#include <tandem/solvers/summary.hpp>
#include <tandem/studies/planning/plan_scenario.hpp>
#include <tandem/studies/rendezvous/rendezvous_study.hpp>
#include <tandem/studies/study/trial_rendezvous.hpp>

namespace tandem {

void run_rendezvous_trial(const TrialSettings& settings, const std::atomic<bool>* stop, TrialResult& result) {
  const Vehicle vehicle = read_vehicle("remus_100");
  RendezvousOptions options;
  options.method = *settings.rendezvous;
  options.seed = settings.docking.seed;
  options.chance = settings.chance;
  options.information = settings.information;
  options.planner.pursuit = pursuit_limits(vehicle);
  options.stop = stop;
  const RendezvousRun run = run_rendezvous(vehicle, options);
  if (run.outcome == RendezvousOutcome::interrupted) {
    result.status = name(Status::interrupted);
    return;
  }
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
  result.set("plan_median_s", detail::quantile(replan_seconds(run), 0.5));
  result.set("plan_99_s", detail::quantile(replan_seconds(run), 0.99));
}

}  // namespace tandem

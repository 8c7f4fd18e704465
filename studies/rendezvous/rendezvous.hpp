#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <tandem/solvers/replanning/planner.hpp>
#include <tandem/studies/planning/vehicle_file.hpp>
#include <tandem/studies/rendezvous/rendezvous_names.hpp>

namespace tandem {

/// Options of a simulated rendezvous. The target moves on a swinging course and the chaser starts behind it. The chaser
/// measures USBL fixes and, at short range and in view, optical poses. It approaches a standoff point outside the
/// keep-out distance and docks from there. A current carries both vehicles.
struct RendezvousOptions {
  RendezvousMethod method = RendezvousMethod::decoupled;
  std::uint64_t seed = 1;
  double time_limit = 300.0;  ///< s
  double horizon = 20.0;      ///< planning horizon [s]; steps of 1 s
  PlannerOptions planner{};
  double keep_out = 3.0;  ///< keep-out distance before the docking phase [m]
  double margin = 0.5;    ///< additional keep-out distance of plans [m]
  /// Time constant of the target's turn rate in the chaser's damped-twist model [s]; infinite: constant twist. The
  /// default is the time at which the autocorrelation of SwingingTarget's turn rate falls to 1/e.
  double turn_time = 10.0;
  double information = 0.1;    ///< PlanOptions::information, for RendezvousMethod::information.
  double chance = 0.0;         ///< PlanOptions::chance
  double standoff = 4.5;       ///< Standoff point, distance behind the target [m].
  double dock = 1.0;           ///< Docked position, distance behind the target [m].
  double target_speed = 0.8;   ///< Speed of the target through the water [m/s].
  double current = 0.1;        ///< Standard deviation of each horizontal component of the current [m/s].
  double start_distance = 30;  ///< Initial distance behind the target [m].
  /// Ends the run as interrupted before its next simulated second if set to true; any thread may set it.
  const std::atomic<bool>* stop = nullptr;
};

/// One second of a run: truth, estimate and plan.
struct RendezvousStep {
  double t;
  RendezvousPhase phase;
  SE3 chaser, target;
  SE3 relative, estimated;  ///< Target pose in the chaser's body frame, C⁻¹ T: truth and estimate.
  Vector<3> three_sigma;    ///< 3 σ of the estimated relative position along the chaser's axes [m]; zero without one.
  double distance, miss;    ///< True distances to the target and to the goal of the phase [m].
  double solve_seconds;     ///< Wall-clock time of the plan; 0 without a plan.
  std::string origin;       ///< PlanOrigin and solver; empty without a plan.
  double violation;         ///< Largest violation of the plan's hard constraints.
  Eigen::VectorXd command;
  double processor_seconds = 0.0;  ///< processor time of the plan
  bool first = false;              ///< whether it is the first plan of its phase
};

struct RendezvousRun {
  std::uint64_t seed;
  RendezvousOutcome outcome;
  std::string why;                    ///< Reason if it did not dock; else empty.
  double seconds;                     ///< Duration.
  double miss;                        ///< Distance from the docked position at the end [m].
  double least_miss;                  ///< Minimum distance from the docked position [m].
  double effort;                      ///< Control effort ∫ Σ (command / half range)² dt [s].
  double keep_out_violation;          ///< Largest true intrusion into the keep-out distance before docking [m].
  std::optional<double> three_sigma;  ///< 3 σ of the estimated relative position at the end, largest of three axes [m].
  double worst_violation;             ///< Largest violation of an accepted plan.
  int plans, not_accepted, shifted;
  std::vector<RendezvousStep> steps;
};

/// Docking tolerances relative to the docked pose that moves with the target. All three must hold at the same time.
struct DockingTolerance {
  double position = 0.3;  ///< m
  double heading = 5.0;   ///< degrees
  double speed = 0.1;     ///< m/s
};

/// Simulates one rendezvous. Results are reproducible except for solve times; with a deadline, timing affects all
/// results. Throws Error if an option is out of range.
RendezvousRun run_rendezvous(const Vehicle& vehicle, const RendezvousOptions& options);

}  // namespace tandem

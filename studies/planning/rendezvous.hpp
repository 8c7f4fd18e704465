#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <tandem/solvers/planning/planner.hpp>
#include <tandem/studies/planning/rendezvous_names.hpp>
#include <tandem/studies/planning/vehicle_file.hpp>

namespace tandem {

/// A simulated rendezvous. The target goes on a course that swings to and fro; the chaser starts some way behind it, knows
/// of it by USBL fixes and, near by and in view, optical poses, closes up to a standoff outside the keep-out distance, and
/// docks from there. A current carries both.
struct RendezvousOptions {
  RendezvousMethod method = RendezvousMethod::decoupled;
  std::uint64_t seed = 1;
  double time_limit = 300.0;  ///< s
  double horizon = 20.0;      ///< s, in steps of 1 s
  PlannerOptions planner{};
  double keep_out = 3.0;  ///< m, until the docking phase
  double margin = 0.5;    ///< m that plans keep off besides
  /// s, after which a third of the target's turn rate is left, as the chaser takes it (damped twist; infinite: constant
  /// twist). By default where the autocorrelation of SwingingTarget's falls to that.
  double turn_time = 10.0;
  double information = 0.1;    ///< PlanOptions::information, of the method of that name
  double chance = 0.0;         ///< PlanOptions::chance
  double standoff = 4.5;       ///< m behind the target
  double dock = 1.0;           ///< m behind it
  double target_speed = 0.8;   ///< m/s
  double current = 0.1;        ///< standard deviation of each horizontal component [m/s]
  double start_distance = 30;  ///< m
  /// Set from anywhere, it ends the run, interrupted, before its next second.
  const std::atomic<bool>* stop = nullptr;
};

/// One second of it: the truth, what the chaser believes and what it does.
struct RendezvousStep {
  double t;
  RendezvousPhase phase;
  SE3 chaser, target;
  SE3 relative, estimated;  ///< C⁻¹ T: as it is, and as the estimate has it
  Vector<3> three_sigma;    ///< of the estimated relative position, along the chaser's axes [m]
  double distance, miss;    ///< m: of the two, and from the phase's goal
  double solve_seconds;     ///< by the clock; 0 where nothing was planned
  std::string origin;       ///< of the plan, and its solver
  double violation;         ///< of the plan's hard constraints
  Eigen::VectorXd command;
  double processor_seconds = 0.0;  ///< of this thread, that the plan took
  bool first = false;              ///< of its phase: no plan before it to begin with
};

struct RendezvousRun {
  std::uint64_t seed;
  RendezvousOutcome outcome;
  std::string why;    ///< a few words
  double seconds;     ///< until then
  double miss;        ///< m from the docked position at the end
  double least_miss;  ///< m, at any time
  double effort;      ///< ∫ Σ (command / half range)² dt [s]
  double
      keep_out_violation;  ///< m inside the keep-out distance while searching or approaching, in truth; 0 where never
  std::optional<double> three_sigma;  ///< of the estimated relative position at the end, the largest of three axes [m]
  double worst_violation;             ///< of the plans that were accepted
  int plans, not_accepted, shifted;
  std::vector<RendezvousStep> steps;
};

/// Docked: within these at once, against the docked pose that moves with the target.
struct DockedWithin {
  double position = 0.3;  ///< m
  double heading = 5.0;   ///< degrees
  double speed = 0.1;     ///< m/s
};

/// The same options give the same numbers, but for the solve times and, with a deadline, what follows from them. Throws
/// Error on options out of their range.
RendezvousRun run_rendezvous(const Vehicle& vehicle, const RendezvousOptions& options);

}  // namespace tandem

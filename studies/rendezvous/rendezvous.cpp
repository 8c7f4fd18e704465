#include <algorithm>
#include <cmath>
#include <optional>
#include <variant>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/parallel_tasks.hpp>
#include <tandem/studies/rendezvous/rendezvous.hpp>
#include <tandem/studies/rendezvous/rendezvous_chaser.hpp>
#include <tandem/studies/rendezvous/rendezvous_world.hpp>

namespace tandem {
namespace {

constexpr int kTicksPerPeriod = 10;         // ticks in a control period of 1 s
constexpr double kCollisionDistance = 0.6;  // distance between the origins that counts as a collision [m]

/// Closed loop of chaser and simulated world.
template <int N>
class Simulation {
 public:
  Simulation(const Vehicle& vehicle, const VehicleModel<N>& model, const RendezvousOptions& options)
      : vehicle_(vehicle),
        model_(model),
        options_(options),
        world_(model, options),
        chaser_(vehicle, model, options, world_.readings()) {}

  RendezvousRun run() {
    RendezvousRun run{options_.seed, RendezvousOutcome::timed_out, "time", 0, 0, HUGE_VAL, 0, 0, {}, 0, 0, 0, 0, {}};
    const Vector<N> half = 0.5 * (model_.upper - model_.lower);
    const ThreadLimit one(1);  // this thread's processor time then covers all work of a plan
    for (int second = 0; second < int(options_.time_limit); ++second) {
      if (options_.stop && *options_.stop) return finish(run, RendezvousOutcome::interrupted, "stopped");
      RendezvousStep step = current_step();
      const std::optional<Vector<N>> planned =
          chaser_.decide(world_.measured_twist(), world_.measured_current(), step, run);
      if (planned && step.phase == RendezvousPhase::docking) step.miss = world_.miss(options_.dock);
      Vector<N> command = planned ? *planned : chaser_.hold_course(world_.measured_twist());
      step.command = command.head(Eigen::Index(vehicle_.actuators.size()));
      run.steps.push_back(std::move(step));
      for (int i = 0; i < kTicksPerPeriod; ++i) {
        if (i > 0 && !planned) command = chaser_.hold_course(world_.measured_twist());
        world_.advance(command);
        chaser_.advance(command, world_.readings());
        run.least_miss = std::min(run.least_miss, world_.miss(options_.dock));
        if (chaser_.phase() == RendezvousPhase::searching || chaser_.phase() == RendezvousPhase::approach)
          run.keep_out_violation = std::max(run.keep_out_violation, options_.keep_out - world_.distance());
        if (world_.is_docked()) return finish(run, RendezvousOutcome::docked, "");
        if (world_.distance() < kCollisionDistance) return finish(run, RendezvousOutcome::failed, "collision");
      }
      run.effort += command.cwiseQuotient(half).squaredNorm();
    }
    return finish(run, RendezvousOutcome::timed_out, "time");
  }

 private:
  /// Returns the current truth, without estimate and plan.
  RendezvousStep current_step() const {
    return {world_.now(),
            chaser_.phase(),
            world_.chaser(),
            world_.target(),
            world_.chaser().inverse() * world_.target(),
            {},
            Vector<3>::Zero(),
            world_.distance(),
            world_.miss(options_.standoff),
            0.0,
            "",
            0.0,
            {},
            0.0,
            false};
  }

  RendezvousRun& finish(RendezvousRun& run, RendezvousOutcome outcome, const char* why) const {
    run.outcome = outcome;
    run.why = why;
    run.seconds = world_.now();
    run.miss = world_.miss(options_.dock);
    if (!run.steps.empty() && !run.steps.back().three_sigma.isZero(0))
      run.three_sigma = run.steps.back().three_sigma.maxCoeff();
    return run;
  }

  const Vehicle& vehicle_;
  const VehicleModel<N>& model_;
  const RendezvousOptions& options_;
  RendezvousWorld<N> world_;
  RendezvousChaser<N> chaser_;
};

}  // namespace

RendezvousRun run_rendezvous(const Vehicle& vehicle, const RendezvousOptions& options) {
  if (!(options.horizon >= 2.0 && options.horizon <= 500.0))
    throw Error(fmt::format("the horizon of a rendezvous must be 2 to 500 s, not {:g} s", options.horizon));
  if (!(options.turn_time > 0)) throw Error("the time constant of the target's turn rate must be above zero");
  if (!(options.time_limit >= 1.0)) throw Error("the time limit of a rendezvous must be 1 s or more");
  if (!(options.standoff > options.keep_out + options.margin))
    throw Error(fmt::format("the standoff of {:g} m must exceed the keep-out distance of {:g} m plus {:g} m margin",
                            options.standoff, options.keep_out, options.margin));
  return std::visit(
      [&](const auto& model) {
        using Model = std::decay_t<decltype(model)>;
        return Simulation<Model::actuators>(vehicle, model, options).run();
      },
      vehicle.model);
}

}  // namespace tandem

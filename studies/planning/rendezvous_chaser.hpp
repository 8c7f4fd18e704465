#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/solvers/planning/planner.hpp>
#include <tandem/studies/planning/coupled_window.hpp>
#include <tandem/studies/planning/rendezvous.hpp>
#include <tandem/studies/planning/rendezvous_world.hpp>

namespace tandem {

/// The chaser of a simulated rendezvous: what it believes, by its sensors alone, and what it therefore does.
template <int N>
class RendezvousChaser {
 public:
  /// With the first of its readings. The other arguments must live as long. Throws Error on options that no plan takes.
  RendezvousChaser(const Vehicle& vehicle, const VehicleModel<N>& model, const RendezvousOptions& options,
                   const RendezvousReadings& first);

  /// A tick later, after this command.
  void go_on(const Vector<N>& command, const RendezvousReadings& readings);

  /// The command for the next second, by measured twist and current; none while it only searches, or knows of no target.
  /// What it believes and plans goes into `step`, and how its plans come about into `run`.
  std::optional<Vector<N>> decide(const Vector<6>& twist, const Vector<3>& current, RendezvousStep& step,
                                  RendezvousRun& run);
  /// While decide() has none: its autopilot keeps its course and the way that it is launched with, by dead reckoning: at
  /// rest, a torpedo's fins turn nothing.
  Vector<N> hold_way(const Vector<6>& twist) const;

  RendezvousPhase phase() const { return phase_; }

 private:
  void take(const RendezvousReadings& readings);
  void tell(std::size_t sensor, const Measurement& m);
  PlanOptions plan_options(RendezvousPhase phase) const;
  std::optional<Vector<6>> motion_time() const;
  VehicleState<N> believed(const Vector<6>& twist);
  TargetBelief belief(const Matrix<12, 12>& joint, const SE3& chaser) const;
  void choose_phase(const SE3& target, const SE3& chaser);
  Planner<N>& planner();
  Vector<N> follow(const VehicleState<N>& state, const TargetBelief& target, RendezvousStep& step, RendezvousRun& run);
  TargetPrediction predict(const VehicleState<N>& state, const TargetBelief& belief);
  PlanResult<N> plan(const VehicleState<N>& state, const TargetBelief& target);

  const Vehicle& vehicle_;
  const VehicleModel<N>& model_;
  const RendezvousOptions& options_;
  TrackingData data_;
  std::unique_ptr<OnlineEstimator> estimator_;
  std::optional<CoupledWindow> window_;
  std::unique_ptr<Planner<N>> approach_, docking_, retreat_;
  double now_ = 0.0;
  SE3 odometry_;
  std::vector<Stamped<SE3>> odometry_log_;
  SO3 course_;
  Vector<3> current_ = Vector<3>::Zero();  // as it estimates it
  Vector<N> actuators_ = Vector<N>::Zero();
  RendezvousPhase phase_ = RendezvousPhase::searching;
  double last_optical_ = -HUGE_VAL;
};

extern template class RendezvousChaser<3>;
extern template class RendezvousChaser<8>;

}  // namespace tandem

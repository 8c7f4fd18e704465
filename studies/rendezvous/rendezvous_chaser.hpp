#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/solvers/replanning/planner.hpp>
#include <tandem/studies/rendezvous/coupled_window.hpp>
#include <tandem/studies/rendezvous/rendezvous.hpp>
#include <tandem/studies/rendezvous/rendezvous_world.hpp>

namespace tandem {

/// Estimator and planner of the chaser in a simulated rendezvous. Its input are sensor readings, not the truth.
template <int N>
class RendezvousChaser {
 public:
  /// Starts with the first readings. The other arguments must outlive this object. Throws Error if the options admit no
  /// plan.
  RendezvousChaser(const Vehicle& vehicle, const VehicleModel<N>& model, const RendezvousOptions& options,
                   const RendezvousReadings& first);

  /// Advances by kTick: `command` was applied, `readings` are new.
  void advance(const Vector<N>& command, const RendezvousReadings& readings);

  /// Returns the command for the next second, or nullopt while searching or without a target estimate. `twist`,
  /// `current`: measured twist (body axes) and current (world axes). Stores estimate and plan in `step` and plan
  /// statistics in `run`.
  std::optional<Vector<N>> decide(const Vector<6>& twist, const Vector<3>& current, RendezvousStep& step,
                                  RendezvousRun& run);
  /// Returns the autopilot command while decide() has none. It holds the initial course and speed by dead reckoning;
  /// the fins of a torpedo-shaped vehicle need speed to steer.
  Vector<N> hold_course(const Vector<6>& twist) const;

  RendezvousPhase phase() const { return phase_; }

 private:
  void add_readings(const RendezvousReadings& readings);
  void add_measurement(std::size_t sensor, const Measurement& m);
  PlanOptions plan_options(RendezvousPhase phase) const;
  std::optional<Vector<6>> twist_time_constants() const;
  VehicleState<N> own_state(const Vector<6>& twist);
  TargetBelief target_belief(const Matrix<12, 12>& joint, const SE3& chaser) const;
  void update_phase(const SE3& target, const SE3& chaser);
  Planner<N>& planner();
  Vector<N> plan_command(const VehicleState<N>& state, const TargetBelief& target, RendezvousStep& step,
                         RendezvousRun& run);
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
  Vector<3> current_ = Vector<3>::Zero();  // filtered measurement
  Vector<N> actuators_ = Vector<N>::Zero();
  RendezvousPhase phase_ = RendezvousPhase::searching;
  double last_optical_ = -HUGE_VAL;
};

extern template class RendezvousChaser<3>;
extern template class RendezvousChaser<8>;

}  // namespace tandem

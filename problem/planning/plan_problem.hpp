#pragma once

#include <vector>

#include <tandem/problem/planning/plan_options.hpp>
#include <tandem/problem/planning/target_prediction.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/vehicle/vehicle_step.hpp>

namespace tandem {

/// What a vehicle is told, and where that takes it.
template <int N>
struct Plan {
  std::vector<VehicleState<N>> states;  ///< now, and after each step
  std::vector<Vector<N>> commands;      ///< of each step, held over it

  /// One step later: the first one is gone, the last command is held one step more.
  Plan shifted(const VehicleStep<N>& step, const Vector<3>& current) const;
  /// The same commands from another start.
  Plan from(const VehicleState<N>& start, const VehicleStep<N>& step, const Vector<3>& current) const;
};

/// The nonlinear program of a chaser's motion relative to a target whose motion is given: over H steps the poses,
/// twists, actuators and commands of the chaser, tied by TwistKinematics, VehicleDynamics and ActuatorLag as hard
/// equalities, under the bounds and the costs of PlanOptions. It is built once; what changes from one plan to the next,
/// the start, the current and the target, are fixed variables, whose values are set. A step's variables stay together,
/// so that the program is banded in time. The vehicle must live as long.
template <int N>
class PlanProblem {
 public:
  /// Throws Error, a sentence, when vehicle or options are impossible (why_impossible).
  PlanProblem(const VehicleModel<N>& vehicle, const PlanOptions& options);

  /// Where the chaser is, and the current there [m/s], along the world's axes.
  void set_start(const VehicleState<N>& start, const Vector<3>& current);
  /// The target now and after each step. Throws Error when it has not H + 1 poses, or, with PlanOptions::chance,
  /// covariances.
  void set_target(const TargetPrediction& target);
  /// Where solvers start from; after set_target(). With PlanOptions::chance the hard constraints c ≥ 0 on the target become
  /// c ≥ k √(J Σ Jᵀ), J = ∂c/∂target here: the margins are constants until the next guess. Throws Error when it has not H
  /// steps.
  void set_guess(const Plan<N>& plan);
  /// At the variables' values.
  Plan<N> plan() const;

  Problem& problem() { return problem_; }
  const PlanOptions& options() const { return options_; }
  const VehicleModel<N>& vehicle() const { return vehicle_; }

 private:
  using Twist = Variable<Rn<6>>;
  using Actuators = Variable<Rn<N>>;
  using Margins = std::vector<Variable<Rn<1>>>;  ///< of a constraint, after each step: less the margin [m]; fixed

  void add_variables();
  void add_motion(int k);
  void add_costs(int k);
  void add_bounds(int k);
  /// constraint ≥ margin. Its states: of the one that it is measured from, and the other.
  template <Residual R>
  void keep_inside(const R& constraint, Margins& margins, const Variable<SE3>& from, const Variable<SE3>& other);
  void set_margins();

  const VehicleModel<N>& vehicle_;
  PlanOptions options_;
  Problem problem_;
  Variable<R3> current_;
  std::vector<Variable<SE3>> chaser_, target_;
  std::vector<Twist> twist_, target_twist_;  // the target's as seen from the goal, which goes with it
  std::vector<Actuators> actuators_, command_;
  Margins keep_out_margin_, approach_margin_, view_margin_;
  std::vector<Matrix<6, 6>> target_covariance_;
};

extern template struct Plan<3>;
extern template struct Plan<8>;
extern template class PlanProblem<3>;
extern template class PlanProblem<8>;

}  // namespace tandem

#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <tandem/problem/planning/plan_blocks.hpp>
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

  /// One step later: the first one is gone, the last command is held one step more. Where no motion obeys the dynamics over a
  /// step, it goes on as it moves, here and below (VehicleStep::or_drift).
  Plan shifted(const VehicleStep<N>& step, const Vector<3>& current) const;
  /// The same commands from another start.
  Plan from(const VehicleState<N>& start, const VehicleStep<N>& step, const Vector<3>& current) const;
};

/// An estimate that a plan joins: a problem with what was measured of chaser and target, and its newest variables.
struct CoupledEstimate {
  Problem& problem;
  Variable<SE3> chaser, before, now;          ///< the chaser, and the target, now; the target some time before
  double dt;                                  ///< s between the target's two
  Vector<6> noise;                            ///< of the target's motion, as predict_target
  std::optional<Vector<6>> time_constants{};  ///< likewise
  /// What the plan's costs count for against the measurements: what is wished for is no evidence of where the target will
  /// be. As it goes to 0, the plan is that against the target's prediction by the measurements alone.
  double share = 1e-4;
};

/// The nonlinear program of a chaser's motion relative to a target whose motion is given: over H steps the poses,
/// twists, actuators and commands of the chaser, tied by TwistKinematics, VehicleDynamics and ActuatorLag as hard
/// equalities, under the bounds and the costs of PlanOptions. It is built once; what changes from one plan to the next,
/// the start, the current and the target, are fixed variables, whose values are set. A step's variables stay together,
/// so that the program is banded in time. The vehicle must live as long.
///
/// Coupled, it is part of a CoupledEstimate's problem: the target's future poses are free, tied by the motion prior to what
/// was measured, the chaser's pose now is the estimate's, and the plan's costs count for a share. The estimate's problem
/// must live as long, and keeps what the plan has added to it.
template <int N>
class PlanProblem {
 public:
  /// Throws Error, a sentence, when vehicle or options are impossible (why_impossible).
  PlanProblem(const VehicleModel<N>& vehicle, const PlanOptions& options);
  PlanProblem(const VehicleModel<N>& vehicle, const PlanOptions& options, const CoupledEstimate& estimate);

  /// Where the chaser is, and the current there [m/s], along the world's axes. Coupled, its pose is the estimate's.
  void set_start(const VehicleState<N>& start, const Vector<3>& current);
  /// The target now and after each step; coupled, where its poses start from. Throws Error when it has not H + 1 poses,
  /// or, with PlanOptions::chance or
  /// information, covariances.
  void set_target(const TargetPrediction& target);
  /// Where solvers start from; after set_target(). With PlanOptions::chance the hard constraints c ≥ 0 on the target become
  /// c ≥ k √(J Σ Jᵀ), J = ∂c/∂target here: the margins are constants until the next guess. Throws Error when it has not H
  /// steps.
  void set_guess(const Plan<N>& plan);
  /// At the variables' values.
  Plan<N> plan() const;

  /// Lagrange's multipliers of each step's hard constraints, over share(): as a solver left them, and for the next one to
  /// start from (Problem::multipliers). Throws Error where they are not as many as the constraints.
  std::vector<Eigen::VectorXd> multipliers() const;
  void set_multipliers(const std::vector<Eigen::VectorXd>& multipliers);

  Problem& problem() { return problem_; }
  const PlanOptions& options() const { return options_; }
  /// What the plan's costs are multiplied by: CoupledEstimate::share, else 1.
  double share() const { return estimate_ ? estimate_->share : 1.0; }
  const VehicleModel<N>& vehicle() const { return vehicle_; }

 private:
  using Twist = Variable<Rn<6>>;
  using Actuators = Variable<Rn<N>>;

  PlanProblem(const VehicleModel<N>& vehicle, const PlanOptions& options, std::optional<CoupledEstimate> estimate,
              std::unique_ptr<Problem> own);
  detail::PlanStep at(int k) const;  ///< after k steps
  Gaussian cost(const Eigen::VectorXd& sigma) const;
  void add_variables();
  void add_motion(int k);
  void add_costs(int k);
  void add_bounds(int k);
  template <Residual R, class B>
  void constrain(const R& residual, const B& bounds, const VariablesOf<R>& x);
  void set_margins();
  void set_gains();

  const VehicleModel<N>& vehicle_;
  PlanOptions options_;
  std::optional<CoupledEstimate> estimate_;
  std::unique_ptr<Problem> own_;
  Problem& problem_;
  Variable<R3> current_;
  std::vector<Variable<SE3>> chaser_, target_;
  std::vector<Twist> twist_, target_twist_;  // the target's as seen from the goal, which goes with it
  std::vector<Actuators> actuators_, command_;
  std::vector<std::vector<Block>> hard_;  // of each step
  detail::PlanMargins margins_;
  std::vector<Variable<Rn<1>>> gain_;  // of Unseen, after each step; fixed
  std::vector<Matrix<6, 6>> target_covariance_;
};

extern template struct Plan<3>;
extern template struct Plan<8>;
extern template class PlanProblem<3>;
extern template class PlanProblem<8>;

}  // namespace tandem

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

/// Commands of a vehicle and the states that they lead to.
template <int N>
struct Plan {
  std::vector<VehicleState<N>> states;  ///< initial state and the state after each step
  std::vector<Vector<N>> commands;      ///< command of each step, held constant during it

  /// Returns the plan shifted by one step: the first step is dropped and the last command is held for one more step. If
  /// the dynamics have no solution over a step, the twist is kept (VehicleStep::or_constant_twist), also in from().
  Plan shifted(const VehicleStep<N>& step, const Vector<3>& current) const;
  /// Returns the same commands with the states that follow from another initial state.
  Plan from(const VehicleState<N>& start, const VehicleStep<N>& step, const Vector<3>& current) const;
};

/// Estimation problem that a plan is coupled with, and its newest variables.
struct CoupledEstimate {
  Problem& problem;
  Variable<SE3> chaser, before, now;          ///< Current chaser pose; previous and current target pose.
  double dt;                                  ///< Time between the two target poses [s].
  Vector<6> noise;                            ///< Noise of the target's motion, as for predict_target().
  std::optional<Vector<6>> time_constants{};  ///< As for predict_target().
  /// Weight of the plan's costs relative to the measurements. It is small because a goal is not evidence of where the
  /// target will be. In the limit 0, the plan equals the plan against the prediction from measurements alone.
  double cost_weight = 1e-4;
};

/// Nonlinear program of the motion of a chaser relative to a moving target. Its variables are the poses, twists,
/// actuator states and commands of the chaser over H steps. TwistKinematics, VehicleDynamics and ActuatorLag connect
/// them as hard equalities; PlanOptions defines bounds and costs.
///
/// The program is built once. The initial state, the water current and the target are fixed variables, whose values
/// change from plan to plan. Variables of one step are adjacent, so the Hessian is banded.
///
/// Coupled to a CoupledEstimate, the plan is added to the estimation problem. The future target poses are then free and
/// tied to the estimate by the motion prior. The current chaser pose is that of the estimate, and the costs are
/// multiplied by cost_weight(). The estimation problem must outlive the program and keeps its variables and blocks.
template <int N>
class PlanProblem {
 public:
  /// Copies the vehicle. Throws BadInputError if vehicle or options are impossible (why_invalid).
  PlanProblem(const VehicleModel<N>& vehicle, const PlanOptions& options);
  PlanProblem(const VehicleModel<N>& vehicle, const PlanOptions& options, const CoupledEstimate& estimate);

  /// Sets the current state of the chaser, and the water current [m/s] in world axes. If coupled, the pose comes from
  /// the estimate.
  void set_start(const VehicleState<N>& start, const Vector<3>& current);
  /// Sets the poses of the target, now and after each step; if coupled, the initial guess of the future poses. Throws
  /// Error if there are not H + 1 poses and twists, or if covariances are missing that PlanOptions::information needs.
  void set_target(const TargetPrediction& target);
  /// Sets the initial guess; call it after set_target(). With PlanOptions::chance, also replaces the hard constraints c
  /// ≥ 0 on the target by c ≥ chance √(J Σ Jᵀ), where J = ∂c/∂target at the guess. These margins are constant until the
  /// next call. Throws Error if the plan does not have H steps or covariances of the target are missing.
  void set_guess(const Plan<N>& plan);
  /// Returns the plan at the current values of the variables.
  Plan<N> plan() const;

  /// Return and set the Lagrange multipliers of the hard constraints of each step, divided by cost_weight(), for a warm
  /// start (Problem::multipliers). set_multipliers() throws Error if their number is wrong.
  std::vector<Eigen::VectorXd> multipliers() const;
  void set_multipliers(const std::vector<Eigen::VectorXd>& multipliers);

  Problem& problem() { return problem_; }
  const PlanOptions& options() const { return options_; }
  /// Returns the factor of the costs: CoupledEstimate::cost_weight, or 1 if not coupled.
  double cost_weight() const { return estimate_ ? estimate_->cost_weight : 1.0; }
  const VehicleModel<N>& vehicle() const { return vehicle_; }

 private:
  using Twist = Variable<Rn<6>>;
  using Actuators = Variable<Rn<N>>;

  PlanProblem(const VehicleModel<N>& vehicle, const PlanOptions& options, std::optional<CoupledEstimate> estimate,
              std::unique_ptr<Problem> own);
  detail::PlanStep at(int k) const;  ///< variables after k steps
  Gaussian cost(const Eigen::VectorXd& sigma) const;
  void add_variables();
  void add_motion(int k);
  void add_costs(int k);
  void add_bounds(int k);
  template <Residual R, class B>
  void constrain(const R& residual, const B& bounds, const VariablesOf<R>& x);
  void set_margins();
  void set_gains();

  VehicleModel<N> vehicle_;
  PlanOptions options_;
  std::optional<CoupledEstimate> estimate_;
  std::unique_ptr<Problem> own_;
  Problem& problem_;
  Variable<R3> current_;
  std::vector<Variable<SE3>> chaser_, target_;
  std::vector<Twist> twist_, target_twist_;  // target_twist_: velocity of the goal, which moves with the target
  std::vector<Actuators> actuators_, command_;
  std::vector<std::vector<Block>> hard_;  // hard blocks of each step
  detail::PlanMargins margins_;
  std::vector<Variable<Rn<1>>> gain_;  // information gain of Visibility after each step; fixed
  std::vector<Matrix<6, 6>> target_covariance_;
};

extern template struct Plan<3>;
extern template struct Plan<8>;
extern template class PlanProblem<3>;
extern template class PlanProblem<8>;

}  // namespace tandem

#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/problem/planning/plan_problem.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>

// Member definitions of the templates in plan_problem.hpp, for the sources that instantiate them.
namespace tandem {
template <int N>
Plan<N> Plan<N>::shifted(const VehicleStep<N>& step, const Vector<3>& current) const {
  Plan later = *this;
  later.states.erase(later.states.begin());
  later.commands.erase(later.commands.begin());
  later.commands.push_back(commands.back());
  later.states.push_back(step.or_constant_twist(later.states.back(), commands.back(), current));
  return later;
}

template <int N>
Plan<N> Plan<N>::from(const VehicleState<N>& start, const VehicleStep<N>& step, const Vector<3>& current) const {
  Plan moved{{start}, commands};
  for (const Vector<N>& command : commands)
    moved.states.push_back(step.or_constant_twist(moved.states.back(), command, current));
  return moved;
}

template <int N>
PlanProblem<N>::PlanProblem(const VehicleModel<N>& vehicle, const PlanOptions& options)
    : PlanProblem(vehicle, options, std::nullopt, std::make_unique<Problem>()) {}

template <int N>
PlanProblem<N>::PlanProblem(const VehicleModel<N>& vehicle, const PlanOptions& options, const CoupledEstimate& estimate)
    : PlanProblem(vehicle, options, estimate, nullptr) {}

template <int N>
PlanProblem<N>::PlanProblem(const VehicleModel<N>& vehicle, const PlanOptions& options,
                            std::optional<CoupledEstimate> estimate, std::unique_ptr<Problem> own)
    : vehicle_(vehicle),
      options_(options),
      estimate_(std::move(estimate)),
      own_(std::move(own)),
      problem_(own_ ? *own_ : estimate_->problem) {
  if (const std::string why = why_invalid(vehicle); !why.empty()) throw BadInputError(why);
  if (const std::string why = why_invalid(options); !why.empty()) throw BadInputError(why);
  if (estimate_ && !(estimate_->cost_weight > 0 && estimate_->dt > 0))
    throw BadInputError("CoupledEstimate: cost_weight and dt must be positive");
  add_variables();
  for (int k = 0; k < options.steps; ++k) {
    hard_.emplace_back();
    add_motion(k);
    add_costs(k);
    add_bounds(k);
  }
}

template <int N>
void PlanProblem<N>::add_variables() {
  current_ = problem_.add(R3(), "current");
  problem_.fix(current_);
  for (int k = 0; k <= options_.steps; ++k) {
    const std::string step = " at step " + std::to_string(k);
    if (k > 0) command_.push_back(problem_.add(Rn<N>(), "command" + step));
    actuators_.push_back(problem_.add(Rn<N>(), "actuators" + step));
    twist_.push_back(problem_.add(Rn<6>(), "twist" + step));
    chaser_.push_back(estimate_ && k == 0 ? estimate_->chaser : problem_.add(SE3(), "chaser" + step));
    target_.push_back(estimate_ && k == 0 ? estimate_->now : problem_.add(SE3(), "target" + step));
    target_twist_.push_back(problem_.add(Rn<6>(), "twist of the target" + step));
    problem_.fix(target_twist_.back());
    if (!estimate_) problem_.fix(target_.back());
  }
  problem_.fix(actuators_.front());
  problem_.fix(twist_.front());
  if (!estimate_) problem_.fix(chaser_.front());
}

/// Returns the noise of a cost with standard deviations `sigma`, weighted by cost_weight().
template <int N>
Gaussian PlanProblem<N>::cost(const Eigen::VectorXd& sigma) const {
  return Gaussian(Eigen::VectorXd(sigma / std::sqrt(cost_weight())));
}

/// Adds a hard constraint to the current step.
template <int N>
template <Residual R, class B>
void PlanProblem<N>::constrain(const R& residual, const B& bounds, const VariablesOf<R>& x) {
  hard_.back().push_back(problem_.subject_to(residual, bounds, x));
}

template <int N>
detail::PlanStep PlanProblem<N>::at(int k) const {
  const std::size_t i = std::size_t(k);
  return {chaser_[i], target_[i], twist_[i], target_twist_[i]};
}

template <int N>
void PlanProblem<N>::add_motion(int k) {
  const std::size_t now = std::size_t(k), next = now + 1;
  const double dt = options_.dt;
  hard_.back().push_back(detail::add_kinematics(problem_, dt, at(k), at(k + 1)));
  constrain(VehicleDynamics<N>(vehicle_, dt), equal_to(0),
            {chaser_[now], twist_[now], twist_[next], actuators_[now], command_[now], current_});
  constrain(ActuatorLag<N>(vehicle_.lag, dt), equal_to(0), {actuators_[now], command_[now], actuators_[next]});
  if (estimate_)
    detail::add_target_motion(problem_, *estimate_, k == 0 ? estimate_->dt : dt, dt,
                              k == 0 ? estimate_->before : target_[now - 1], target_[now], target_[next]);
}

template <int N>
void PlanProblem<N>::add_costs(int k) {
  const std::size_t now = std::size_t(k), next = now + 1;
  const PlanOptions& o = options_;
  if (const auto gain = detail::add_goal(problem_, o, k + 1, cost_weight(), at(k + 1))) gain_.push_back(*gain);
  const Vector<N> half = 0.5 * (vehicle_.upper - vehicle_.lower);
  const Rn<N> neutral(Vector<N>(Vector<N>::Zero().cwiseMax(vehicle_.lower).cwiseMin(vehicle_.upper)));
  problem_.minimize(Prior<Rn<N>>{neutral}, cost(o.effort * half), {actuators_[next]});
  const auto& before = k == 0 ? actuators_[0] : command_[now - 1];  // the actuators hold the previous command
  problem_.minimize(RelativePose<Rn<N>>{}, cost(o.rate * half), {before, command_[now]});
}

template <int N>
void PlanProblem<N>::add_bounds(int k) {
  constrain(Prior<Rn<N>>{}, Bounds<N>{vehicle_.lower, vehicle_.upper}, {command_[std::size_t(k)]});
  detail::add_limits(problem_, options_, at(k + 1), margins_, hard_.back());
}

/// Sets the information gain of a fix at each step as if it were the only one.
template <int N>
void PlanProblem<N>::set_gains() {
  if (gain_.empty()) return;
  if (target_covariance_.size() != target_.size())
    throw BadInputError("PlanOptions::information needs the covariances of the predicted target");
  for (std::size_t k = 0; k < gain_.size(); ++k) {
    const double nats = information_of_fix(options_, target_covariance_[k + 1]);
    problem_.set_value(gain_[k], Rn<1>(Vector<1>(std::sqrt(2.0 * nats))));
  }
}

template <int N>
void PlanProblem<N>::set_margins() {
  if (!(options_.chance > 0)) return;
  if (target_covariance_.size() != target_.size())
    throw BadInputError("PlanOptions::chance needs the covariances of the predicted target");
  detail::set_margins(problem_, options_, chaser_, target_, target_covariance_, margins_);
}

template <int N>
void PlanProblem<N>::set_start(const VehicleState<N>& start, const Vector<3>& current) {
  if (!estimate_) problem_.set_value(chaser_.front(), start.pose);
  problem_.set_value(twist_.front(), Rn<6>(start.twist));
  problem_.set_value(actuators_.front(), Rn<N>(start.actuators));
  problem_.set_value(current_, R3(current));
}

template <int N>
void PlanProblem<N>::set_target(const TargetPrediction& target) {
  if (target.pose.size() != target_.size() || target.twist.size() != target_.size())
    throw BadInputError("the plan needs " + std::to_string(target_.size()) + " poses and twists of the target, not " +
                        std::to_string(target.pose.size()) + " and " + std::to_string(target.twist.size()));
  const Matrix<6, 6> to_goal = options_.goal.inverse().Ad();
  for (std::size_t k = 0; k < target_.size(); ++k) {
    if (!estimate_ || k > 0) problem_.set_value(target_[k], target.pose[k]);
    problem_.set_value(target_twist_[k], Rn<6>(Vector<6>(to_goal * target.twist[k])));
  }
  target_covariance_ = target.covariance;
  set_gains();
}

template <int N>
void PlanProblem<N>::set_guess(const Plan<N>& plan) {
  if (plan.commands.size() != command_.size() || plan.states.size() != chaser_.size())
    throw BadInputError("the initial guess of the plan has " + std::to_string(plan.commands.size()) + " steps, not " +
                        std::to_string(command_.size()));
  for (std::size_t k = 0; k < command_.size(); ++k) {
    const VehicleState<N>& s = plan.states[k + 1];
    problem_.set_value(command_[k], Rn<N>(plan.commands[k]));
    problem_.set_value(actuators_[k + 1], Rn<N>(s.actuators));
    problem_.set_value(twist_[k + 1], Rn<6>(s.twist));
    problem_.set_value(chaser_[k + 1], s.pose);
  }
  set_margins();
}

template <int N>
Plan<N> PlanProblem<N>::plan() const {
  Plan<N> plan;
  for (std::size_t k = 0; k < chaser_.size(); ++k)
    plan.states.push_back(
        {problem_.value(chaser_[k]), problem_.value(twist_[k]).vector(), problem_.value(actuators_[k]).vector()});
  for (const auto& u : command_) plan.commands.push_back(problem_.value(u).vector());
  return plan;
}

template <int N>
std::vector<Eigen::VectorXd> PlanProblem<N>::multipliers() const {
  std::vector<Eigen::VectorXd> steps;
  for (const std::vector<Block>& blocks : hard_) {
    std::vector<double> rows;
    for (const Block& block : blocks) {
      const Eigen::VectorXd y = problem_.multipliers(block);
      rows.insert(rows.end(), y.begin(), y.end());
    }
    steps.push_back(Eigen::Map<const Eigen::VectorXd>(rows.data(), Eigen::Index(rows.size())) / cost_weight());
  }
  return steps;
}

template <int N>
void PlanProblem<N>::set_multipliers(const std::vector<Eigen::VectorXd>& multipliers) {
  if (multipliers.size() != hard_.size())
    throw BadInputError("set_multipliers: a plan needs one vector of multipliers per step");
  for (std::size_t k = 0; k < hard_.size(); ++k) {
    Eigen::Index row = 0;
    for (const Block& block : hard_[k]) {
      const Eigen::Index rows = problem_.multipliers(block).size();
      if (row + rows > multipliers[k].size())
        throw BadInputError("set_multipliers: there are fewer multipliers than constraints at step " +
                            std::to_string(k + 1));
      problem_.set_multipliers(block, cost_weight() * multipliers[k].segment(row, rows));
      row += rows;
    }
    if (row != multipliers[k].size())
      throw BadInputError("set_multipliers: there are more multipliers than constraints at step " +
                          std::to_string(k + 1));
  }
}

}  // namespace tandem

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>

#include <tandem/problem/all_blocks.hpp>
#include <tandem/solvers/observability.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {

Eigen::VectorXd row_tolerances(const NlpEvaluator& nlp, const Eigen::VectorXd& jacobian, double tolerance) {
  // Some thousand times the resolution of doubles, for terms that nearly cancel within a row or in the linear solver.
  constexpr double kRowRounding = 1e-12, kLeast = std::numeric_limits<double>::epsilon();
  Eigen::VectorXd magnitudes(nlp.num_rows());
  nlp.row_magnitudes(jacobian, magnitudes);
  for (double& m : magnitudes) m = std::max({tolerance, kRowRounding * (std::isfinite(m) ? m : 0.0), kLeast});
  return magnitudes;
}

NlpEvaluator::Violation relative_violation(const NlpEvaluator& nlp, const Eigen::VectorXd& c,
                                           const Eigen::VectorXd& tolerances) {
  NlpEvaluator::Violation worst{0.0, -1};
  for (int i = 0; i < nlp.num_rows(); ++i) {
    if (nlp.soft_weights()[i] > 0 && std::isfinite(c[i])) continue;
    const double v = std::isfinite(c[i]) ? std::max(nlp.lower()[i] - c[i], c[i] - nlp.upper()[i]) / tolerances[i]
                                         : std::numeric_limits<double>::infinity();
    if (v > worst.size) worst = {v, i};
  }
  return worst;
}

int violated_row(NlpEvaluator& nlp, const Eigen::VectorXd& c, double tolerance) try {
  if (nlp.violation(c).size <= tolerance) return -1;
  Eigen::VectorXd jacobian(Eigen::Index(nlp.jacobian_pattern().row.size()));
  nlp.constraint_jacobian(jacobian);
  const auto worst = relative_violation(nlp, c, row_tolerances(nlp, jacobian, tolerance));
  return worst.size > 1.0 ? worst.row : -1;
} catch (const UndefinedResidualError&) {  // undefined derivatives
  return nlp.violation(c).row;
}

Session::Session(std::string solver, const SolverOptions& options) : options_(options) {
  summary.solver = std::move(solver);
}

void Session::restart() {
  Summary fresh;
  fresh.solver = std::move(summary.solver);
  summary = std::move(fresh);
  start_ = std::chrono::steady_clock::now();
  ended_ = false;
}

double Session::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

bool Session::should_stop() {
  if (options_.stop && options_.stop->load(std::memory_order_relaxed)) {
    end(Status::interrupted);
    return true;
  }
  if (seconds() > options_.time_limit) {
    end(Status::time_limit);
    return true;
  }
  return false;
}

bool Session::start(NlpEvaluator& nlp, const std::function<double()>& cost) {
  std::string culprit;
  try {
    summary.initial_cost = summary.cost = cost();
    if (!std::isfinite(summary.cost)) culprit = nlp.describe_nonfinite_block();
    Eigen::VectorXd c(nlp.num_rows());
    nlp.constraints(c);
    if (const auto fixed = nlp.fixed_violation(c); fixed.row >= 0 && fixed.size > kConstraintTolerance) {
      summary.max_violation = fixed.size;
      summary.worst_constraint = nlp.describe_row(fixed.row);
      end(Status::infeasible, "a hard constraint on fixed variables is violated: " + summary.worst_constraint);
      return false;
    }
    for (int row = 0; culprit.empty() && row < nlp.num_rows(); ++row)
      if (!std::isfinite(c[row])) culprit = nlp.describe_row(row);
    if (std::isfinite(summary.cost) && culprit.empty()) return true;
    culprit = "not finite at the initial guess: " + culprit;
  } catch (const UndefinedResidualError& e) {
    culprit = std::string("a residual is undefined at the initial guess: ") + e.what();
  }
  summary.cost = summary.max_violation = std::numeric_limits<double>::quiet_NaN();
  end(Status::failed, culprit);
  return false;
}

void Session::report(int iteration, double cost, double step, double violation) const {
  if (options_.progress) options_.progress({iteration, cost, step, violation, seconds()});
}

void Session::report_at(NlpEvaluator& nlp, const Eigen::VectorXd& delta, int iteration, double cost, double step,
                        double violation) const {
  if (!options_.progress) return;
  nlp.save();
  nlp.move_to(delta);
  nlp.recenter();  // moves the values of the variables for the callback
  std::exception_ptr failure;
  try {
    report(iteration, cost, step, violation);
  } catch (...) {
    failure = std::current_exception();
  }
  if (nlp.is_current() || !failure) {  // throws Error if the callback changed the problem, as after report()
    nlp.restore();
    nlp.move_to(delta);
  }
  if (failure) std::rethrow_exception(failure);
}

void Session::end(Status status, std::string message) {
  if (ended_) return;
  ended_ = true;
  summary.status = status;
  summary.message = message.empty() ? std::string(sentence(status)) : std::move(message);
  summary.seconds = seconds();
}

void Session::conclude(NlpEvaluator& nlp, double feasible, const Workspace* work) {
  nlp.reset();
  try {
    Eigen::VectorXd c(nlp.num_rows());
    nlp.constraints(c);
    summary.cost = nlp.cost() + nlp.cost_of_rows(c);
    summary.max_violation = nlp.violation(c).size;
    if (const int row = violated_row(nlp, c, feasible); row >= 0) summary.worst_constraint = nlp.describe_row(row);
  } catch (const UndefinedResidualError& e) {
    summary.cost = summary.max_violation = std::numeric_limits<double>::quiet_NaN();
    end(Status::failed, e.what());
  }
  if (summary.status == Status::converged && !summary.worst_constraint.empty()) {
    summary.status = Status::failed;
    summary.message = "hard constraints are violated; the worst is " + summary.worst_constraint;
  }
  if (summary.status == Status::converged && options_.observability) {
    constexpr int kMostDirections = 6;
    int skipped = 0;
    const std::vector<FlatDirection> flat = work ? flat_directions(nlp, *work, true, kMostDirections, {}, &skipped)
                                                 : flat_directions(nlp, true, kMostDirections, {}, &skipped);
    summary.unobservable = unobservable_states(nlp, flat, skipped);
  }
  summary.seconds = seconds();
}

std::string derivative_hint(const NlpEvaluator::DerivativeCheck& check) {
  switch (check.kind) {
    case NlpEvaluator::DerivativeCheck::Kind::jump:
      return ": the " + check.block + " is discontinuous here, like a rotation by 180 deg";
    case NlpEvaluator::DerivativeCheck::Kind::jacobian:
      return ": the Jacobian of the " + check.block + " disagrees with finite differences";
    case NlpEvaluator::DerivativeCheck::Kind::none:
      break;
  }
  return {};
}

Summary rejection(std::string solver, const SolverOptions& options, std::string why) {
  Session session(std::move(solver), options);
  Summary& summary = session.summary;
  summary.initial_cost = summary.cost = summary.max_violation = std::numeric_limits<double>::quiet_NaN();
  session.end(Status::unsupported, std::move(why));
  return std::move(session.summary);
}

std::string why_unsolvable(const Problem& problem) try {
  if (problem.size().unknowns > 0) return {};
  for (const Block& block : hard_blocks(problem)) {
    const auto bounds = problem.bounds(block);
    const Eigen::VectorXd c = problem.linearization(block).residual;
    if (!(((c - bounds.upper).cwiseMax(bounds.lower - c)).maxCoeff() <= kConstraintTolerance))
      return "the problem has no free variable, and a hard constraint is violated: " + problem.describe(block);
  }
  return "the problem has no free variable";
} catch (const UndefinedResidualError& e) {
  return std::string("the problem has no free variable, and a residual is undefined: ") + e.what();
}

}  // namespace tandem::detail

#include <cmath>
#include <limits>

#include <tandem/solvers/observability.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {

Session::Session(std::string solver, const SolverOptions& options) : options_(options) {
  summary.solver = std::move(solver);
}

void Session::restart() {
  summary = {.solver = summary.solver};
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

bool Session::start(Program& program, const std::function<double()>& cost) {
  std::string culprit;
  try {
    summary.initial_cost = summary.cost = cost();
    if (!std::isfinite(summary.cost)) culprit = program.describe_bad_block();
    Eigen::VectorXd c(program.num_rows());
    program.constraints(c);
    if (const auto fixed = program.fixed_violation(c); fixed.row >= 0 && fixed.size > kConstraintTolerance) {
      summary.max_violation = fixed.size;
      summary.worst_constraint = program.describe_row(fixed.row);
      end(Status::infeasible, "fixed variables alone violate a hard constraint, " + summary.worst_constraint);
      return false;
    }
    for (int row = 0; culprit.empty() && row < program.num_rows(); ++row)
      if (!std::isfinite(c[row])) culprit = program.describe_row(row);
    if (std::isfinite(summary.cost) && culprit.empty()) return true;
    culprit = "not finite at the start: " + culprit;
  } catch (const Error& e) {
    culprit = std::string("a residual is undefined at the start: ") + e.what();
  }
  summary.cost = summary.max_violation = std::numeric_limits<double>::quiet_NaN();
  end(Status::failed, culprit);
  return false;
}

void Session::report(int iteration, double cost, double step, double violation) const {
  if (options_.progress) options_.progress({iteration, cost, step, violation, seconds()});
}

void Session::report_at(Program& program, const Eigen::VectorXd& delta, int iteration, double cost, double step,
                        double violation) const {
  if (!options_.progress) return;
  struct Shown {  // in the variables' values, until the callback returns or throws
    Program& program;
    const Eigen::VectorXd& delta;
    ~Shown() {
      program.restore();
      program.move_to(delta);
    }
  };
  program.keep();
  program.move_to(delta);
  program.recenter();
  const Shown shown{program, delta};
  report(iteration, cost, step, violation);
}

void Session::end(Status status, std::string message) {
  if (ended_) return;
  ended_ = true;
  summary.status = status;
  summary.message = message.empty() ? std::string(sentence(status)) : std::move(message);
  summary.seconds = seconds();
}

void Session::conclude(Program& program, double feasible, const Workspace* work) {
  program.reset();
  try {
    Eigen::VectorXd c(program.num_rows());
    program.constraints(c);
    summary.cost = program.cost() + program.cost_of_rows(c);
    const Program::Violation worst = program.violation(c);
    summary.max_violation = worst.size;
    if (worst.row >= 0 && worst.size > feasible) summary.worst_constraint = program.describe_row(worst.row);
  } catch (const Error& e) {
    summary.cost = summary.max_violation = std::numeric_limits<double>::quiet_NaN();
    end(Status::failed, e.what());
  }
  if (summary.status == Status::converged && !summary.worst_constraint.empty()) {
    summary.status = Status::infeasible;
    summary.message = "the hard constraints are not met, worst " + summary.worst_constraint;
  }
  if (summary.status == Status::converged) {
    if (const std::string free = work ? free_directions(program, *work) : free_directions(program); !free.empty()) {
      summary.status = Status::unconstrained;
      summary.message = free;
    }
  }
  summary.seconds = seconds();
}

std::string because(const Program::Doubt& doubt) {
  switch (doubt.kind) {
    case Program::Doubt::Kind::jump:
      return ": the " + doubt.block + " jumps here, as a rotation by 180 deg does";
    case Program::Doubt::Kind::jacobian:
      return ": the Jacobian of the " + doubt.block + " is not what differences say";
    case Program::Doubt::Kind::none:
      break;
  }
  return {};
}

Summary refusal(std::string solver, const SolverOptions& options, std::string why) {
  Session session(std::move(solver), options);
  session.end(Status::unsupported, std::move(why));
  return std::move(session.summary);
}

std::string why_unsolvable(const Problem& problem) {
  const auto size = problem.size();
  if (size.unknowns == 0) return "the problem has no free variable";
  if (size.equalities > size.unknowns)
    return "the problem has more hard equalities (" + std::to_string(size.equalities) + ") than unknowns (" +
           std::to_string(size.unknowns) + "): take out those that others imply";
  return {};
}

}  // namespace tandem::detail

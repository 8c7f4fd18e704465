#pragma once

#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>

namespace tandem {

/// A value of an option, by the name that users write.
template <class T>
struct NamedValue {
  const char* name;
  T value;
};

inline constexpr NamedValue<Hessian> kHessians[] = {{"automatic", Hessian::automatic},
                                                    {"gauss-newton", Hessian::gauss_newton},
                                                    {"exact", Hessian::exact},
                                                    {"limited-memory", Hessian::limited_memory}};

inline constexpr NamedValue<IpoptLinearSolver> kIpoptLinearSolvers[] = {
    {"automatic", IpoptLinearSolver::automatic},
    {"block-cholesky", IpoptLinearSolver::block_cholesky},
    {"mumps", IpoptLinearSolver::mumps}};

/// Options of the solvers by name, for the command line and for Python. visit_options(options, visit) calls
/// visit(name, member) for each option that has a value of a plain type, and visit(name, member, values) for each with
/// an array of NamedValue.

template <class Visit>
void visit_options(SolverOptions& o, Visit& visit) {
  visit("max_iterations", o.max_iterations);
  visit("time_limit", o.time_limit);
  visit("threads", o.threads);
  visit("observability", o.observability);
  visit("from_multipliers", o.from_multipliers);
}

template <class Visit>
void visit_options(LevenbergMarquardtOptions& o, Visit& visit) {
  visit_options(static_cast<SolverOptions&>(o), visit);
  visit("cost_tolerance", o.cost_tolerance);
  visit("gradient_tolerance", o.gradient_tolerance);
  visit("step_tolerance", o.step_tolerance);
  visit("initial_damping", o.initial_damping);
  visit("secant_pairs", o.secant_pairs);
}

template <class Visit>
void visit_options(AugmentedLagrangianOptions& o, Visit& visit) {
  visit_options(static_cast<LevenbergMarquardtOptions&>(o), visit);
  visit("initial_penalty", o.initial_penalty);
}

template <class Visit>
void visit_options(IpoptOptions& o, Visit& visit) {
  visit_options(static_cast<SolverOptions&>(o), visit);
  visit("tolerance", o.tolerance);
  visit("hessian", o.hessian, kHessians);
  visit("linear_solver", o.linear_solver, kIpoptLinearSolvers);
  visit("options", o.options);
}

/// NloptOptions::algorithm is part of the solver's name.
template <class Visit>
void visit_options(NloptOptions& o, Visit& visit) {
  visit_options(static_cast<SolverOptions&>(o), visit);
  visit("cost_tolerance", o.cost_tolerance);
  visit("constraint_tolerance", o.constraint_tolerance);
  visit("precondition", o.precondition);
}

}  // namespace tandem

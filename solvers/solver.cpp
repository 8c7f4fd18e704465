#include <tandem/solvers/session.hpp>
#include <tandem/solvers/solver.hpp>

namespace tandem {

Solver::Solver(Problem& problem, AugmentedLagrangianOptions options)
    : problem_(problem), options_(std::move(options)) {}
Solver::~Solver() = default;

Summary Solver::solve() {
  constexpr const char* name = "augmented-lagrangian";
  if (const std::string why = why_unsupported(problem_, options_); !why.empty())
    return detail::rejection(name, options_, why);
  if (!analysed_ || !analysed_->is_current()) {
    analysed_.reset();  // frees its memory first
    analysed_ = std::make_unique<detail::LevenbergMarquardt>(problem_, name, options_);
    ++analyses_;
  }
  return analysed_->solve(options_.initial_penalty);
}

}  // namespace tandem

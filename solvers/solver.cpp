#include <utility>

#include <tandem/solvers/solver.hpp>

namespace tandem {

template <class Options>
Solver<Options>::Solver(Problem& problem, Options options) : problem_(problem), options_(std::move(options)) {}

template <class Options>
Summary Solver<Options>::solve() {
  // A solve of an unsupported problem only returns the reason.
  if (!why_unsupported(problem_, options_).empty()) return tandem::solve(problem_, options_);
  if (!analysed_ || !analysed_->is_current()) {
    analysed_.reset();  // frees the memory of the previous analysis first
    analysed_ = detail::analyse(problem_, options_);
    ++analyses_;
  }
  return analysed_->solve();
}

template class Solver<GaussNewtonOptions>;
template class Solver<AugmentedLagrangianOptions>;
template class Solver<IpoptOptions>;
template class Solver<NloptOptions>;

}  // namespace tandem

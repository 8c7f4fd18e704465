#pragma once

#include <optional>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/persistent_solve.hpp>

namespace tandem::detail {

/// A repeatable solve that keeps only the evaluator of its problem.
class EvaluatorSolve : public PersistentSolve {
 public:
  explicit EvaluatorSolve(Problem& problem) : problem_(problem) {}
  bool is_current() const override { return !nlp_ || nlp_->is_current(); }

 protected:
  const Problem& problem() const { return problem_; }
  /// Returns the evaluator at the present values. The first call constructs it, so its time counts as time of the first
  /// solve.
  NlpEvaluator& evaluator(int threads) {
    if (!nlp_) nlp_.emplace(problem_);
    nlp_->reset();
    nlp_->use_threads(threads);
    return *nlp_;
  }

 private:
  Problem& problem_;
  std::optional<NlpEvaluator> nlp_;
};

}  // namespace tandem::detail

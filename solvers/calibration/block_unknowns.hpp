#pragma once

#include <vector>

#include <Eigen/Core>

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem::detail {

/// Calls f(first unknown, first column, dof) for each variable of a block that is not fixed. `column` counts the
/// tangent coordinates of all variables of the block, one after the other.
template <class F>
void for_each_free(const NlpEvaluator& nlp, const std::vector<int>& variable_ids, const std::vector<int>& dofs, F f) {
  Eigen::Index column = 0;
  for (std::size_t v = 0; v < variable_ids.size(); column += dofs[v++])
    if (const int k = nlp.block_of(variable_ids[v]); k >= 0)
      f(nlp.hessian_pattern().first[std::size_t(k)], column, dofs[v]);
}

/// Returns the part of `step`, a vector over all unknowns, that belongs to the variables of a block: `columns` entries,
/// zero for fixed variables.
inline Eigen::VectorXd block_part(const NlpEvaluator& nlp, const std::vector<int>& variable_ids,
                                  const std::vector<int>& dofs, Eigen::Index columns, const Eigen::VectorXd& step) {
  Eigen::VectorXd part = Eigen::VectorXd::Zero(columns);
  for_each_free(nlp, variable_ids, dofs,
                [&](int first, Eigen::Index column, int dof) { part.segment(column, dof) = step.segment(first, dof); });
  return part;
}

/// Adds `part`, over the variables of a block, to the vector `all` over all unknowns. The inverse of block_part().
inline void add_block_part(const NlpEvaluator& nlp, const std::vector<int>& variable_ids, const std::vector<int>& dofs,
                           const Eigen::VectorXd& part, Eigen::Ref<Eigen::VectorXd> all) {
  for_each_free(nlp, variable_ids, dofs,
                [&](int first, Eigen::Index column, int dof) { all.segment(first, dof) += part.segment(column, dof); });
}

}  // namespace tandem::detail

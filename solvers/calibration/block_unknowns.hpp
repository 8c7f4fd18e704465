#pragma once

#include <vector>

#include <Eigen/Core>

#include <tandem/problem/program.hpp>

namespace tandem::detail {

/// Calls f(first unknown, first column, dof) for each of a block's variables that is not fixed.
template <class F>
void each_free(const Program& program, const std::vector<int>& variable_ids, const std::vector<int>& dofs, F f) {
  Eigen::Index column = 0;
  for (std::size_t v = 0; v < variable_ids.size(); column += dofs[v++])
    if (const int k = program.block_of(variable_ids[v]); k >= 0)
      f(program.hessian_pattern().first[std::size_t(k)], column, dofs[v]);
}

/// What a step of all unknowns is of a block's variables, one after the other; 0 of those that are fixed.
inline Eigen::VectorXd of_block(const Program& program, const std::vector<int>& variable_ids,
                                const std::vector<int>& dofs, Eigen::Index columns, const Eigen::VectorXd& step) {
  Eigen::VectorXd part = Eigen::VectorXd::Zero(columns);
  each_free(program, variable_ids, dofs,
            [&](int first, Eigen::Index column, int dof) { part.segment(column, dof) = step.segment(first, dof); });
  return part;
}

/// Adds what a block's variables have to that of all unknowns.
inline void add_of_block(const Program& program, const std::vector<int>& variable_ids, const std::vector<int>& dofs,
                         const Eigen::VectorXd& part, Eigen::Ref<Eigen::VectorXd> all) {
  each_free(program, variable_ids, dofs,
            [&](int first, Eigen::Index column, int dof) { all.segment(first, dof) += part.segment(column, dof); });
}

}  // namespace tandem::detail

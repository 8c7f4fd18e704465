#pragma once

#include <map>
#include <memory>
#include <string>
#include <typeindex>
#include <vector>

#include <tandem/problem/problem.hpp>

namespace tandem::detail {

/// Exact content of a problem as numbers and names: the intermediate form between a Problem and a file.
class ProblemData {
 public:
  struct Variable {
    std::string group, name;
    std::vector<double> value;
    bool fixed = false;
  };
  enum class Role { cost, constraint, marginal_prior, marginal_constraint };
  /// Returns the residual type of a block; null for a marginal prior or constraint. The block must be in the problem.
  static const ResidualType* type_of(const Problem& problem, const tandem::Block& block) {
    return problem.pools_[std::size_t(block.pool)].type;
  }
  /// Replace the residual or the bounds of a block as Problem::set_residual and set_bounds do, for a type or a number of
  /// rows that is known at run time only.
  static void set_residual(Problem& problem, const tandem::Block& block, const ResidualFunctions& functions,
                           const void* residual) {
    problem.set_residual(block, functions, residual);
  }
  static void set_bounds(Problem& problem, const tandem::Block& block, const std::vector<double>& lower,
                         const std::vector<double>& upper) {
    problem.set_bounds(block, int(lower.size()), lower.data(), upper.data());
  }
  static bool is_marginal(Role role) { return role == Role::marginal_prior || role == Role::marginal_constraint; }
  /// Content of a block. Members that its role does not use are empty.
  struct Block {
    Role role = Role::cost;
    std::string residual;
    std::vector<int> variables;  ///< indices in ProblemData::variables
    std::vector<double> data;
    std::vector<double> diagonal, full;  ///< one of the two: 1/σ of each row, or the whitening matrix W by rows
    Loss loss;
    std::vector<double> lower, upper, multipliers;
    // Marginal prior ½‖A (X ⊖ X̄) + b‖² + constant, or marginal constraint A (X ⊖ X̄) + b = 0: A by rows; anchors are
    // the values X̄, one after the other.
    std::vector<double> A, b, anchors;
    double constant = 0;
  };

  std::vector<Variable> variables;  ///< variables in the order of creation
  std::vector<Block> blocks;        ///< blocks in the order of evaluation
  double loss_scale = 1;

  ProblemData() = default;
  /// Extracts the content of a problem. Throws Error, naming the block or variable, if a member cannot be stored as
  /// numbers.
  explicit ProblemData(const Problem& problem);
  /// Builds the problem. Throws Error, naming the variable or block, if the data are inconsistent or a type is not
  /// compiled into this program.
  Problem problem() const;

  /// Names and values of all variables by Lie group, in the order of creation.
  using Values = std::map<std::type_index, std::shared_ptr<const StateStoreBase>>;
  static Values values(const Problem& problem);
  /// Sets the values of a problem with the same or similar variables. Variables of a group correspond by name, and in
  /// their order among those of one name. Names of which the numbers differ are skipped.
  static void set_values(Problem& problem, const Values& values);
  /// Moves the values of such a problem as the values of another one moved from `before` to `after`: x becomes
  /// x before⁻¹ after.
  static void move_values(Problem& problem, const Values& before, const Values& after);

 private:
  struct Builder;

  /// Calls f(group, store, from_slot, slot) for each variable of a problem that has a counterpart among `values`.
  template <class F>
  static void for_corresponding(Problem& problem, const Values& values, F f);
};

}  // namespace tandem::detail

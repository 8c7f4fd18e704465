#pragma once

#include <string>
#include <vector>

#include <tandem/problem/problem.hpp>

namespace tandem::detail {

/// All of a problem as plain numbers and names, exact to the last bit: between a Problem and a file.
class ProblemData {
 public:
  struct Variable {
    std::string group, name;
    std::vector<double> value;
    bool fixed = false;
  };
  enum class Role { cost, constraint, marginal_prior };
  /// What a block of its role has; the rest is empty.
  struct Block {
    Role role = Role::cost;
    std::string residual;
    std::vector<int> variables;  ///< places in the list of variables
    std::vector<double> data;
    std::vector<double> diagonal, full;  ///< one of the two: 1/σ of each row, or W by rows
    Loss loss;
    std::vector<double> lower, upper, multipliers;
    // Of the marginal prior: ½‖A (X ⊖ X̄) + b‖² + constant, A by rows, X̄ one after the other.
    std::vector<double> A, b, anchors;
    double constant = 0;
  };

  std::vector<Variable> variables;  ///< in order of creation
  std::vector<Block> blocks;        ///< in order of evaluation
  double widening = 1;

  ProblemData() = default;
  /// Throws Error naming what numbers do not tell.
  explicit ProblemData(const Problem& problem);
  /// A problem of this. Throws Error when it makes none, or one that this program cannot make.
  Problem problem() const;

 private:
  struct Maker;
};

}  // namespace tandem::detail

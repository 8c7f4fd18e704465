#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <tandem/problem/problem.hpp>

namespace tandem::detail {

/// Extends a covariance to variables that have been added since, using the blocks that read them. A block either
/// predicts new variables from known ones or is a measurement of known ones. These are the steps of a Kalman filter, in
/// the tangent space at the values of the variables. Hard equalities are measurements without noise. Robust losses and
/// inequalities are ignored.
class CovarianceExtension {
 public:
  /// Returns the joint covariance of variables that have not been added.
  using Known = std::function<Eigen::MatrixXd(const std::vector<int>& ids, const std::vector<int>& dofs)>;

  /// Adds variables of the problem, none of them fixed, and the blocks that read them. Other new blocks are ignored.
  /// Returns false and changes nothing if the blocks do not determine each variable, if one is undefined, or if an
  /// unobservable direction would dominate the covariance.
  bool extend(const Problem& problem, const std::vector<int>& added, const Known& known);
  void clear();

  /// Returns the joint covariance of variables, added or not. Throws Error if an unobservable direction dominates it.
  Eigen::MatrixXd joint(const std::vector<int>& ids, const std::vector<int>& dofs, const Known& known) const;

 private:
  /// Linear model of a block: added = transition · others + noise or, if no variable is added, 0 = transition · others
  /// + noise.
  struct Step {
    std::vector<int> added, added_dofs, others, other_dofs;
    Eigen::MatrixXd transition, noise;
    bool exact = false;  // the rows of a hard equality
  };
  /// Variables in order, their first rows, and their covariance.
  struct Joint {
    std::vector<int> ids, dofs, at;
    int size = 0;
    Eigen::MatrixXd covariance;

    void append(int id, int dof);
    int of(int id) const;
  };
  bool has(int id) const;
  std::optional<std::vector<Step>> steps_to(const Problem& problem, const std::vector<int>& added) const;
  Joint propagate(Joint joint, const Known& known) const;

  std::vector<int> added_;
  std::vector<Step> steps_;
  Joint extended_;  // of the added variables and those that their blocks read
};

}  // namespace tandem::detail

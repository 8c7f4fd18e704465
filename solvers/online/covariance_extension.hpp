#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <tandem/problem/problem.hpp>

namespace tandem::detail {

/// A covariance carried on to variables that have been added since it was found, by the blocks that read these: those
/// that tie them to others, and those that say more of either. A Kalman filter's prediction and its updates, in the
/// tangent space at the variables' values; robust losses count as though they were none.
class CovarianceExtension {
 public:
  /// Joint covariance of variables that are not added ones.
  using Known = std::function<Eigen::MatrixXd(const std::vector<int>& ids, const std::vector<int>& dofs)>;

  /// By more variables of the problem, none of them fixed, and the blocks that read one of these; what else has been said
  /// of those before does not count. False, and nothing changes, where the blocks do not determine each, where one is
  /// undefined, and where what nothing observes would hide all else.
  bool extend(const Problem& problem, const std::vector<int>& added, const Known& known);
  void clear();

  /// Joint covariance of variables, added ones and others. Throws Error where what nothing observes hides it.
  Eigen::MatrixXd joint(const std::vector<int>& ids, const std::vector<int>& dofs, const Known& known) const;

 private:
  /// added = by others + noise, or, where none is added, 0 = by others + noise.
  struct Step {
    std::vector<int> added, added_dofs, others, other_dofs;
    Eigen::MatrixXd by, noise;
  };
  /// Variables one after the other, and their covariance.
  struct Joint {
    std::vector<int> ids, dofs, at;
    int size = 0;
    Eigen::MatrixXd covariance;

    void append(int id, int dof);
    int of(int id) const;
  };
  bool has(int id) const;
  std::optional<std::vector<Step>> steps_to(const Problem& problem, const std::vector<int>& added) const;
  Joint carry_on(Joint joint, const Known& known) const;

  std::vector<int> added_;
  std::vector<Step> steps_;
  Joint near_;  // of the added ones and those that they are tied to
};

}  // namespace tandem::detail

#pragma once

#include <exception>

#include <IpIpoptApplication.hpp>

#include <tandem/solvers/linear/condensed_kkt.hpp>

namespace tandem::detail {

/// Ipopt's linear systems by CondensedKkt, in the place of MA57: Ipopt's loader of HSL takes functions of that library's
/// calling convention. They have no pointer of the caller's; while an object of this class lives, those that Ipopt
/// calls on its thread are the object's. One made before it takes over again when it goes. Other threads have theirs.
class OwnLinearSolver {
 public:
  /// Whether this version of Ipopt has the loader (3.11 and 3.12; later ones do not export it).
  static bool available();
  /// Makes an application use it; one at a time.
  static void choose(Ipopt::IpoptApplication& app);

  explicit OwnLinearSolver(const Program& program);
  ~OwnLinearSolver();
  OwnLinearSolver(const OwnLinearSolver&) = delete;
  OwnLinearSolver& operator=(const OwnLinearSolver&) = delete;

  /// What a call ended with, which Ipopt sees as a failure of the linear solver.
  std::exception_ptr error() const { return error_; }

 private:
  friend struct Ma57;  // the functions

  CondensedKkt kkt_;
  OwnLinearSolver* outer_;
  std::exception_ptr error_;
};

}  // namespace tandem::detail

#pragma once

#include <exception>

#include <IpIpoptApplication.hpp>
#include <IpTNLP.hpp>

#include <tandem/solvers/linear/condensed_kkt.hpp>

namespace tandem::detail {

/// Solves Ipopt's linear systems by CondensedKkt. Two adapters exist: ipopt_linear_solver.cpp derives from Ipopt's own
/// interface for linear solvers, whose headers Ipopt 3.13 and newer install; ipopt_ma57.cpp replaces MA57 in Ipopt 3.11
/// and 3.12.
class BlockCholeskyInIpopt {
 public:
  /// Returns whether one of the adapters supports the installed version of Ipopt.
  static bool available();
  /// Sets the options of an application that optimize() is called for.
  static void choose(Ipopt::IpoptApplication& app);

  explicit BlockCholeskyInIpopt(const NlpEvaluator& nlp) : kkt_(nlp) {}
  BlockCholeskyInIpopt(const BlockCholeskyInIpopt&) = delete;
  BlockCholeskyInIpopt& operator=(const BlockCholeskyInIpopt&) = delete;

  /// Runs app.OptimizeTNLP() with this linear solver. Several threads may call this for different objects.
  Ipopt::ApplicationReturnStatus optimize(Ipopt::IpoptApplication& app, const Ipopt::SmartPtr<Ipopt::TNLP>& problem);

  /// For the adapters. Analyses the triplets of the lower triangle, whose indices start at 1. Returns false after an
  /// error.
  bool analyze(int size, int entries, const int* row, const int* column);
  /// Returns false after an error. Sets `inertia` to whether the matrix has one negative eigenvalue per constraint.
  /// `pivoted` must be true after Ipopt has asked for more accurate solutions than its refinement can achieve.
  bool factorize(const double* values, bool pivoted, bool& inertia);
  /// Overwrites a right-hand side by the solution. Returns false after an error.
  bool solve(double* rhs);
  int num_constraints() const { return kkt_.num_constraints(); }

  /// The first exception of a call. Ipopt then receives the result of a failed linear solver.
  std::exception_ptr error() const { return error_; }

 private:
  template <class F>
  bool guard(F f);

  CondensedKkt kkt_;
  std::exception_ptr error_;
};

}  // namespace tandem::detail

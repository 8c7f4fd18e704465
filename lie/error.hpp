#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace tandem {

/// Base of all exceptions of Tandem. The message is one sentence that names the thing, the problem and the remedy. The
/// derived types are:
///
///   BadInputError: An argument, an option or data are invalid.
///   StaleHandleError: A handle, an ID or an evaluator does not belong, or no longer belongs, to the problem.
///   NumericalError: There is no result at the values of the variables.
///     UndefinedResidualError: A residual or its derivative has no value.
///     NotObservableError: The information is singular.
///   Stopped: The caller ended a computation (problem/stop.hpp).
///
/// Solvers report a NumericalError and a stop by Status and message instead.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Thrown if an argument, an option or data are invalid. Nothing has been changed.
class BadInputError : public Error {
 public:
  using Error::Error;
};

/// Thrown if a handle of a variable or block is not valid in this problem: its variable or block was removed, it
/// belongs to another problem, or it was never set. Also thrown by an NlpEvaluator or a Subproblem whose problem has
/// changed.
class StaleHandleError : public Error {
 public:
  using Error::Error;
};

/// Thrown if a computation has no result at the present values: a solve that is needed fails, or a covariance does not
/// exist.
class NumericalError : public Error {
 public:
  using Error::Error;
};

/// Thrown if a residual or its derivative is undefined or not finite. A residual gives only the reason. Problem and
/// NlpEvaluator add the names of the residual and of its variables. They also convert every other Error that a residual
/// throws to this type.
class UndefinedResidualError : public NumericalError {
 public:
  using NumericalError::NumericalError;
  UndefinedResidualError(std::string residual, std::vector<std::string> variables, const std::string& why)
      : NumericalError(sentence(residual, variables, why)),
        residual_(std::move(residual)),
        variables_(std::move(variables)) {}

  /// Returns the name of the residual; empty before Problem or NlpEvaluator has added it.
  const std::string& residual() const { return residual_; }
  /// Returns the names of the variables that the residual reads.
  const std::vector<std::string>& variables() const { return variables_; }

 private:
  static std::string sentence(const std::string& residual, const std::vector<std::string>& variables,
                              const std::string& why) {
    std::string text = residual;
    for (std::size_t i = 0; i < variables.size(); ++i) text += (i == 0 ? " of " : ", ") + variables[i];
    const bool named = why.starts_with(residual + ": ");  // many reasons begin with the name of the residual
    return text + ": " + why.substr(named ? residual.size() + 2 : 0);
  }
  std::string residual_;
  std::vector<std::string> variables_;
};

/// Thrown if a covariance does not exist, because no residual observes a direction of a variable, or because rounding
/// errors exceed the information about it.
class NotObservableError : public NumericalError {
 public:
  /// `states` names the directions, for example "x0 in heading; x1 in x, y".
  NotObservableError(const std::string& message, std::string states)
      : NumericalError(message), states_(std::move(states)) {}

  const std::string& states() const { return states_; }

 private:
  std::string states_;
};

/// Throws NotObservableError if `states` names unobservable directions, else NumericalError.
[[noreturn]] inline void throw_without_result(const std::string& message, const std::string& states) {
  if (!states.empty()) throw NotObservableError(message, states);
  throw NumericalError(message);
}

}  // namespace tandem

#pragma once

#include <string>
#include <utility>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/studies/support/plots.hpp>
#include <tandem/studies/support/solver_choice.hpp>

namespace tandem {

/// Parsers of option values. `option` is the option name for error messages. Each parser throws Error if the value is
/// not valid; the message lists the valid values and suggests a similar one.

Role parse_role(const std::string& option, const std::string& text);          ///< soft, hard or off
Role parse_limits(const std::string& option, const std::string& text);        ///< hard or soft
Mode parse_mode(const std::string& option, const std::string& text);          ///< A or B
MotionModel parse_model(const std::string& option, const std::string& text);  ///< one of model_names()
std::vector<std::string> model_names();                                       ///< the default first
Junction parse_junction(const std::string& option, const std::string& text);  ///< boundary or direct
/// Comma-separated horizons in keyframes, each BACK:AHEAD or one number for both, e.g. "1,2,5:3".
std::vector<Horizon> parse_horizons(const std::string& option, const std::string& text);
/// automatic, gauss-newton, exact or limited-memory
Hessian parse_hessian(const std::string& option, const std::string& text);
IpoptLinearSolver parse_linear_solver(const std::string& option, const std::string& text);  ///< block-cholesky or mumps
std::optional<PlotFormat> parse_plots(const std::string& option, const std::string& text);  ///< svg, png, pdf or off
/// MIN,MAX or MIN; ±inf is allowed for one of them.
Bounds<1> parse_interval(const std::string& option, const std::string& text);
Loss parse_loss(const std::string& option, const std::string& text);  ///< NAME or NAME:SCALE with one of loss_names()
std::vector<std::string> loss_names();
std::string loss_text(const Loss& loss);  ///< text that parse_loss() accepts
/// gauss-newton, augmented-lagrangian, ipopt or nlopt:ALGORITHM, with default options
AnySolver parse_solver(const std::string& option, const std::string& text);

int parse_count(const std::string& option, const std::string& text);            ///< a positive integer
int parse_count_or_zero(const std::string& option, const std::string& text);    ///< a non-negative integer
double parse_non_negative(const std::string& option, const std::string& text);  ///< a finite number ≥ 0
double parse_positive(const std::string& option, const std::string& text);      ///< a finite number > 0
double parse_finite(const std::string& option, const std::string& text);        ///< a finite number
/// Comma-separated numbers, including inf and nan.
std::vector<double> parse_numbers(const std::string& option, const std::string& text);
/// KEY=VALUE with a non-empty key and value.
std::pair<std::string, std::string> parse_assignment(const std::string& option, const std::string& text);

}  // namespace tandem

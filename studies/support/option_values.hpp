#pragma once

#include <string>
#include <utility>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/studies/support/plots.hpp>
#include <tandem/studies/support/solver_choice.hpp>

namespace tandem {

/// What the words after command-line options mean. `option` is the option's own name, for the error messages;
/// each throws Error that says what is taken and, where one is near, what may have been meant.

Role parse_role(const std::string& option, const std::string& text);          ///< soft, hard or off
Role parse_limits(const std::string& option, const std::string& text);        ///< hard or soft
Mode parse_mode(const std::string& option, const std::string& text);          ///< A or B
MotionModel parse_model(const std::string& option, const std::string& text);  ///< constant-twist, …
std::vector<std::string> model_names();                                       ///< that it takes, the default first
Junction parse_junction(const std::string& option, const std::string& text);  ///< boundary or direct
std::vector<Horizon> parse_horizons(const std::string& option,
                                    const std::string& text);  ///< e.g. 1,2,5:3: each BACK:AHEAD or both
Hessian parse_hessian(const std::string& option,
                      const std::string& text);  ///< gauss-newton, exact, limited-memory
IpoptLinearSolver parse_linear_solver(const std::string& option, const std::string& text);  ///< block-cholesky, mumps
std::optional<PlotFormat> parse_plots(const std::string& option,
                                      const std::string& text);  ///< svg, png or off
Bounds<1> parse_interval(const std::string& option,
                         const std::string& text);                    ///< MIN,MAX or MIN; inf is a bound
Loss parse_loss(const std::string& option, const std::string& text);  ///< NAME or NAME:SCALE
std::vector<std::string> loss_names();                                ///< that it takes
std::string loss_text(const Loss& loss);                              ///< as parse_loss() takes it
Solver parse_solver(const std::string& option,
                    const std::string& text);  ///< gauss-newton, augmented-lagrangian, ipopt or nlopt:ALGORITHM

int parse_count(const std::string& option, const std::string& text);          ///< a whole number above zero
int parse_count_or_none(const std::string& option, const std::string& text);  ///< the same, or 0
double parse_magnitude(const std::string& option,
                       const std::string& text);                            ///< a finite number, zero or above
double parse_positive(const std::string& option, const std::string& text);  ///< a finite number above zero
double parse_finite(const std::string& option, const std::string& text);    ///< a finite number
std::vector<double> parse_numbers(const std::string& option,
                                  const std::string& text);  ///< numbers by commas, inf and nan among them
/// KEY=VALUE, neither of them empty.
std::pair<std::string, std::string> parse_assignment(const std::string& option, const std::string& text);

}  // namespace tandem

#pragma once

#include <string>

#include <tandem/problem/program.hpp>

namespace tandem::detail {

/// Empty when the point determines every unknown to second order, else a sentence that names the free variables and
/// directions, e.g. "the problem leaves free: target 4 in rotation about x (…)". Hard
/// constraints that hold count as information; inequalities at their bounds only with `inequalities`.
std::string free_directions(Program& program, bool inequalities = true);

}  // namespace tandem::detail

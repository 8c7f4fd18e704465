#pragma once

#include <string>

#include <tandem/problem/program.hpp>

namespace tandem::detail {

/// Empty when the point determines every unknown to second order, else a sentence that names the free variables and
/// directions, e.g. "target 4 is free in rotation about x". Hard constraints count as information.
std::string free_directions(Program& program);

}  // namespace tandem::detail

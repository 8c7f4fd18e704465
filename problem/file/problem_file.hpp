#pragma once

#include <filesystem>
#include <string>

#include <tandem/problem/problem.hpp>

namespace tandem {

/// Writes a problem as it is, with its variables' values, as JSON (docs/file_formats.md): read again, it is solved in the
/// same iterations to the same cost, to the last bit. Throws Error, and leaves what was there, when the file cannot be
/// written or numbers do not tell what is in a residual, a pointer for example (see Fields).
void write_problem(const Problem& problem, const std::filesystem::path& file);
/// Throws Error that says where and what is wrong; also where this program is not compiled with a residual in the role, or a
/// group, that the file has. Handles are those of Problem::variables() and Problem::blocks().
Problem read_problem(const std::filesystem::path& file);

/// The same as text. `name` is what messages call it.
std::string problem_text(const Problem& problem);
Problem parse_problem(const std::string& text, const std::string& name);

}  // namespace tandem

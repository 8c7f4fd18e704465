#pragma once

#include <filesystem>
#include <string>

#include <tandem/problem/problem.hpp>

namespace tandem {

/// Writes a problem with its current values as JSON (docs/file_formats.md). A solve of the problem that is read back
/// gives bitwise the same result. Throws BadInputError if a residual, or a member of it, has no function fields() (see
/// Fields), or if the file cannot be written. An existing file then stays unchanged.
void write_problem(const Problem& problem, const std::filesystem::path& file);
/// Reads a problem file. Throws BadInputError with the location of the mistake. A group, or a role of a residual, that
/// this program does not use is also an error. Problem::variables() and Problem::blocks() return the handles.
Problem read_problem(const std::filesystem::path& file);

/// Convert a problem to and from the text of a problem file. `name` is the file name in messages.
std::string problem_text(const Problem& problem);
Problem parse_problem(const std::string& text, const std::string& name);

}  // namespace tandem

#include <fstream>
#include <iterator>
#include <system_error>

#include <tandem/problem/file/problem_file.hpp>
#include <tandem/problem/file/problem_json.hpp>
#include <tandem/problem/regular_file.hpp>
#include <tandem/problem/replace_file.hpp>

namespace tandem {
namespace {

/// Replaces control characters in a UTF-8 message, so that it is one line and safe for a terminal even if it quotes the
/// file. Control characters are one byte, or two bytes that begin with 0xc2.
std::string printable(std::string text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const bool pair = c == 0xc2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xa0;
    if (c < 0x20 || c == 0x7f || pair) text.replace(i, pair ? 2 : 1, "?");
  }
  return text;
}

}  // namespace

std::string problem_text(const Problem& problem) { return detail::json_text(detail::ProblemData(problem)); }

Problem parse_problem(const std::string& text, const std::string& name) try {
  return detail::parse_json(text).problem();
} catch (const BadInputError& error) {
  throw BadInputError(name + ": " + printable(error.what()));
}

void write_problem(const Problem& problem, const std::filesystem::path& file) {
  const auto fail = [&](const std::string& why) {
    throw BadInputError("cannot write the problem to " + file.string() + ": " + why);
  };
  std::string text;
  try {
    text = problem_text(problem);
  } catch (const BadInputError& error) {
    fail(error.what());
  }
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored) && !std::filesystem::is_regular_file(file, ignored))
    fail("it is a folder, a pipe or a device; name a regular file");
  if (const std::error_code reason = detail::replace_file(file, text)) fail(reason.message());
}

Problem read_problem(const std::filesystem::path& file) {
  return parse_problem(detail::read_regular_file(file), file.string());
}

}  // namespace tandem

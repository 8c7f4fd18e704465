#include <fstream>
#include <iterator>
#include <system_error>

#include <tandem/problem/file/problem_file.hpp>
#include <tandem/problem/file/problem_json.hpp>

namespace tandem {
namespace {

/// A message on one line that is safe on a terminal, whatever the file's own words are: its text is UTF-8, of which the
/// control characters are one byte, or two that begin with 0xc2.
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
} catch (const Error& error) {
  throw Error(name + ": " + printable(error.what()));
}

void write_problem(const Problem& problem, const std::filesystem::path& file) {
  const auto refuse = [&](const std::string& why) {
    throw Error("the problem is not written to " + file.string() + ": " + why);
  };
  std::string text;
  try {
    text = problem_text(problem);
  } catch (const Error& error) {
    refuse(error.what());
  }
  std::error_code error, ignored;
  if (std::filesystem::exists(file, ignored) && !std::filesystem::is_regular_file(file, ignored))
    refuse("that is a folder, a pipe or a device; name a file");
  // Beside it, and then in its place: who reads it meanwhile, or finds it after a crash, has a whole one.
  std::filesystem::path part = file;
  part += ".part";
  std::ofstream out(part, std::ios::binary);
  out << text << std::flush;
  const bool written = out.good();
  out.close();
  if (written) std::filesystem::rename(part, file, error);
  if (written && !error) return;
  std::filesystem::remove(part, ignored);
  refuse(error ? error.message() : "the folder is not there, cannot be written to, or is full");
}

Problem read_problem(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) throw Error(file.string() + ": there is no such file");
  if (!std::filesystem::is_regular_file(file, error))
    throw Error(file.string() + ": is a folder, a pipe or a device; name the file of a problem");
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in.good() && !in.eof()) throw Error(file.string() + ": cannot be read");
  return parse_problem(text, file.string());
}

}  // namespace tandem

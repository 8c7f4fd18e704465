#include <iterator>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/input_file.hpp>

namespace tandem {

std::ifstream open_input(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (std::filesystem::is_directory(status)) throw Error(fmt::format("{} is a folder, not a file", file.string()));
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    throw Error(fmt::format("{} is a pipe or a device, not a file", file.string()));
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    const bool there = std::filesystem::exists(file, error);
    throw Error(fmt::format("{} {}", file.string(), there ? "cannot be read" : "is missing"));
  }
  return stream;
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream = open_input(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace tandem

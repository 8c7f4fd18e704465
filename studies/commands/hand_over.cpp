#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/hand_over.hpp>
#include <tandem/studies/support/share_folder.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {

void hand_over(const std::string& command, const std::string& program, const char* const* argv) {
  const std::filesystem::path prefix = installation_folder(), file = prefix / program;
  execv(file.c_str(), const_cast<char* const*>(argv));
  const int reason = errno;
  if (reason != ENOENT) throw Error(fmt::format("{} cannot be run: {}", quote(file.string()), std::strerror(reason)));
  if (!std::filesystem::exists(prefix / "CMakeCache.txt"))
    throw Error(
        fmt::format("{}, which has tandem {}, is missing: install tandem again", quote(file.string()), command));
  throw Error(fmt::format("tandem {} is not built yet: cmake --build {} --target {}", command,
                          std::filesystem::proximate(prefix).string(), file.filename().string()));
}

}  // namespace tandem

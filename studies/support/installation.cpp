#include <cstdint>
#include <string>

#if defined(__APPLE__)
#include <mach-o/dyld.h>
#endif

#include <tandem/studies/support/installation.hpp>

namespace tandem {

std::filesystem::path executable_path() {
  std::error_code error;
#if defined(__APPLE__)
  std::uint32_t size = 0;
  _NSGetExecutablePath(nullptr, &size);
  std::string path(size, '\0');
  _NSGetExecutablePath(path.data(), &size);
  return std::filesystem::canonical(path.c_str(), error);
#else
  return std::filesystem::read_symlink("/proc/self/exe", error);
#endif
}

std::filesystem::path installation_folder() {
  std::error_code error;
  const std::filesystem::path executable = executable_path();
  std::filesystem::path folder = executable.parent_path();
  while (folder.has_relative_path() && !std::filesystem::exists(folder / TANDEM_DATADIR, error))
    folder = folder.parent_path();
  return folder.has_relative_path() ? folder : executable.parent_path().parent_path();
}

std::filesystem::path share_folder() { return installation_folder() / TANDEM_DATADIR; }

std::filesystem::path libexec_folder() { return installation_folder() / TANDEM_LIBEXECDIR; }

}  // namespace tandem

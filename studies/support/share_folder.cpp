#include <tandem/studies/support/share_folder.hpp>

namespace tandem {

std::filesystem::path installation_folder() {
  std::error_code error;
  const std::filesystem::path executable = std::filesystem::read_symlink("/proc/self/exe", error);
  return executable.parent_path().parent_path();
}

std::filesystem::path share_folder() { return installation_folder() / "share" / "tandem"; }

}  // namespace tandem

#include <tandem/studies/support/share_folder.hpp>

namespace tandem {

std::filesystem::path share_folder() {
  std::error_code error;
  const std::filesystem::path executable = std::filesystem::read_symlink("/proc/self/exe", error);
  return executable.parent_path().parent_path() / "share" / "tandem";
}

}  // namespace tandem

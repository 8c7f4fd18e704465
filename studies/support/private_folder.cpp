#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <stdlib.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/private_folder.hpp>

namespace tandem {

PrivateFolder::PrivateFolder(std::string_view name) {
  std::string path = (std::filesystem::temp_directory_path() / fmt::format("tandem-{}-XXXXXX", name)).string();
  if (!mkdtemp(path.data()))
    throw Error(fmt::format("cannot create the temporary folder {}: {}", path, std::strerror(errno)));
  path_ = path;
}

PrivateFolder::~PrivateFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace tandem

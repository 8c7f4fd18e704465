#pragma once

#include <filesystem>
#include <string_view>

namespace tandem {

/// A new folder for temporary files that only this user can read. The destructor removes it with its content.
class PrivateFolder {
 public:
  /// `name` is a part of the folder's name. Throws Error if it cannot be created.
  explicit PrivateFolder(std::string_view name);
  ~PrivateFolder();
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace tandem

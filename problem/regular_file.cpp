#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/regular_file.hpp>

namespace tandem::detail {
namespace {

/// Closes a descriptor in the destructor.
struct Closing {
  int descriptor;
  ~Closing() { close(descriptor); }
};

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& what) {
  throw Error(file.string() + " " + what);
}

[[noreturn]] void fail_to_read(const std::filesystem::path& file, int reason) {
  fail(file, std::string("cannot be read: ") + std::strerror(reason));
}

}  // namespace

int open_regular_file(const std::filesystem::path& file) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (descriptor < 0) {
    const int reason = errno;
    if (reason == ENOENT) fail(file, "is missing");
    if (reason == ENXIO) fail(file, "is a pipe or a device, not a file");  // a socket
    fail_to_read(file, reason);
  }
  struct stat status {};
  const int reason = fstat(descriptor, &status) == 0 ? 0 : errno;
  if (reason == 0 && S_ISREG(status.st_mode)) return descriptor;
  close(descriptor);
  if (reason != 0) fail_to_read(file, reason);
  fail(file, S_ISDIR(status.st_mode) ? "is a folder, not a file" : "is a pipe or a device, not a file");
}

std::size_t read_some(int descriptor, char* bytes, std::size_t size, const std::filesystem::path& file) {
  while (true) {
    const ssize_t n = read(descriptor, bytes, size);
    if (n >= 0) return std::size_t(n);
    if (errno != EINTR) fail_to_read(file, errno);
  }
}

std::string read_regular_file(const std::filesystem::path& file) {
  constexpr std::size_t kChunk = 1 << 16;
  const Closing opened{open_regular_file(file)};
  std::string text;
  for (std::size_t n = 1; n > 0;) {
    const std::size_t size = text.size();
    text.resize(size + kChunk);
    n = read_some(opened.descriptor, text.data() + size, kChunk, file);
    text.resize(size + n);
  }
  return text;
}

}  // namespace tandem::detail

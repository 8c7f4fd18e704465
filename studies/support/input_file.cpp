#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/regular_file.hpp>
#include <tandem/studies/support/input_file.hpp>

namespace tandem {
namespace {

namespace fs = std::filesystem;

std::atomic<bool> outside_allowed{false};

fs::path& output_folder() {
  static fs::path folder;
  return folder;
}

void check_not_in_output_folder(const fs::path& file) {
  const fs::path& folder = output_folder();
  if (folder.empty()) return;
  std::error_code error;
  const fs::path target = fs::weakly_canonical(file, error);
  if (!fs::equivalent(fs::absolute(file).parent_path(), folder, error) &&
      !fs::equivalent(target.parent_path(), folder, error))
    return;
  throw Error(fmt::format("{} is an input of this run, but in the output folder {}; name another output folder",
                          file.string(), folder.string()));
}

}  // namespace

InputFile::Buffer::Buffer(fs::path file)
    : file_(std::move(file)), descriptor_(detail::open_regular_file(file_)), bytes_(1 << 16) {}

InputFile::Buffer::~Buffer() { close(descriptor_); }

InputFile::Buffer::int_type InputFile::Buffer::underflow() {
  if (gptr() == egptr()) {
    const std::size_t n = detail::read_some(descriptor_, bytes_.data(), bytes_.size(), file_);
    setg(bytes_.data(), bytes_.data(), bytes_.data() + n);
    if (n == 0) return traits_type::eof();
  }
  return traits_type::to_int_type(*gptr());
}

InputFile::Buffer::pos_type InputFile::Buffer::seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode) {
  if (from == std::ios::cur) offset -= egptr() - gptr();  // the descriptor is at the end of the buffer
  const int whence = from == std::ios::beg ? SEEK_SET : from == std::ios::cur ? SEEK_CUR : SEEK_END;
  const off_t position = lseek(descriptor_, offset, whence);
  setg(nullptr, nullptr, nullptr);
  return position < 0 ? pos_type(off_type(-1)) : pos_type(position);
}

InputFile::Buffer::pos_type InputFile::Buffer::seekpos(pos_type position, std::ios::openmode mode) {
  return seekoff(off_type(position), std::ios::beg, mode);
}

InputFile::InputFile(fs::path file) : std::istream(nullptr), buffer_((check_not_in_output_folder(file), file)) {
  rdbuf(&buffer_);
  exceptions(std::ios::badbit);  // rethrows the Error of a failed read
}

std::string read_text(const fs::path& file) {
  check_not_in_output_folder(file);
  return read_state(file);
}

std::string read_state(const fs::path& file) { return detail::read_regular_file(file); }

void refuse_inputs_in(const fs::path& folder) { output_folder() = folder; }

void allow_outside_files(bool allowed) { outside_allowed = allowed; }

bool leads_outside(const fs::path& folder, const fs::path& name) {
  if (outside_allowed) return false;
  const fs::path normal = name.lexically_normal();
  if (name.is_absolute() || (!normal.empty() && *normal.begin() == "..")) return true;
  std::error_code error;
  const fs::path root = fs::canonical(folder, error);
  if (error) return false;  // opening the file reports it
  const fs::path file = fs::weakly_canonical(folder / name, error);
  return !error && std::mismatch(root.begin(), root.end(), file.begin(), file.end()).first != root.end();
}

fs::path file_in(const fs::path& folder, const fs::path& name) {
  if (leads_outside(folder, name))
    throw Error(
        fmt::format("{} leads outside {}; use --allow-outside to read it", (folder / name).string(), folder.string()));
  return folder / name;
}

}  // namespace tandem

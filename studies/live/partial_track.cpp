#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/live/partial_track.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// A folder that no other process has locked so, by its descriptor. Throws Error.
int locked(const std::filesystem::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) throw Error(fmt::format("{} cannot be opened: {}", folder.string(), std::strerror(errno)));
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
  close(descriptor);
  throw Error(fmt::format("another track is writing to {}: give this one a folder of its own", folder.string()));
}

/// Moves what a run has left there out of the way, its half lines cut. Returns where it is.
std::filesystem::path keep_aside(const std::filesystem::path& folder) {
  for (const char* file : TrackRows::files)
    if (std::filesystem::exists(folder / file)) cut_half_line(folder / file);
  std::filesystem::path aside;
  for (int n = 1; aside.empty() || std::filesystem::exists(aside); ++n)
    aside = fmt::format("{}-{}", folder.string(), n);
  std::filesystem::rename(folder, aside);
  return aside;
}

}  // namespace

PartialTrack::PartialTrack(std::filesystem::path folder, const TrackRows& rows, DurableFiles& disk,
                           const std::function<void(const std::string&)>& tell) try
    : folder_(std::move(folder)), rows_(rows), disk_(disk) {
  if (!std::filesystem::exists(folder_)) return;
  const int lock = locked(folder_);
  const std::filesystem::path aside = keep_aside(folder_);
  close(lock);
  tell("a track that was cut short has left what it had found: it is kept in " + aside.string());
} catch (const std::filesystem::filesystem_error& error) {
  throw Error(fmt::format("what a track has left cannot be kept: {}", error.what()));
}

PartialTrack::~PartialTrack() {
  if (lock_ >= 0) close(lock_);
}

void PartialTrack::begin() try {
  std::filesystem::create_directories(folder_);
  lock_ = locked(folder_);
  const TrackRows::Texts headers = rows_.headers();
  for (std::size_t i = 0; i < files_.size(); ++i) {
    files_[i] = disk_.open(folder_ / TrackRows::files[i]);
    disk_.append(files_[i], headers[i]);
  }
} catch (const std::filesystem::filesystem_error& error) {
  throw Error(fmt::format("{} cannot be made: {}", folder_.string(), error.code().message()));
}

void PartialTrack::add(const TrackRecord& record) {
  if (lock_ < 0) begin();
  const TrackRows::Texts texts = rows_.of(record);
  for (std::size_t i = 0; i < files_.size(); ++i) disk_.append(files_[i], texts[i]);
}

void PartialTrack::remove() {
  if (lock_ < 0) return;
  std::error_code ignored;  // it is in nobody's way
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace tandem

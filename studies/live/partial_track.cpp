#include <algorithm>
#include <cerrno>
#include <cstring>
#include <random>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/live/partial_track.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

const std::string kRecords = "records-";  // and the name of the run

/// No other run's.
std::string name_of_run() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

/// A folder that no other process has locked so, by its descriptor. Throws Error.
int locked(const std::filesystem::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) throw Error(fmt::format("{} cannot be opened: {}", folder.string(), std::strerror(errno)));
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
  close(descriptor);
  throw Error(fmt::format("another track is writing to {}: give this one a folder of its own", folder.string()));
}

/// What is in a folder that no track has left so, or nothing. One that was killed early has left some files, empty ones.
std::optional<std::filesystem::path> foreign(const std::filesystem::path& folder) {
  std::size_t own = 0;
  std::uintmax_t bytes = 0;
  std::optional<std::filesystem::path> last;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    last = entry.path();
    const std::string name = last->filename().string();
    const bool rows = std::find(TrackRows::files.begin(), TrackRows::files.end(), name) != TrackRows::files.end();
    if (!std::filesystem::is_regular_file(entry.symlink_status()) || (!rows && !name.starts_with(kRecords)))
      return last;
    own += rows;
    bytes += entry.file_size();
  }
  return own == TrackRows::files.size() || bytes == 0 ? std::nullopt : last;
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
                           const std::optional<Continues>& continues,
                           const std::function<void(const std::string&)>& tell) try
    : folder_(std::move(folder)), rows_(rows), disk_(disk) {
  if (std::filesystem::exists(folder_)) {
    lock_ = locked(folder_);
    if (const auto file = foreign(folder_)) {
      close(std::exchange(lock_, -1));
      throw Error(fmt::format("{} is for what a track has found so far, and {} is not of one: move it or change --out",
                              printable(folder_.string()), quote(file->filename().string())));
    }
    if (continues && go_on(*continues)) return;
    const bool is_empty = std::filesystem::is_empty(folder_);
    const std::filesystem::path aside = is_empty ? std::filesystem::path() : keep_aside(folder_);
    close(std::exchange(lock_, -1));
    if (!is_empty) tell("a track that was cut short has left what it had found: it is kept in " + aside.string());
  }
  if (continues) run_ = name_of_run();
} catch (const std::filesystem::filesystem_error& error) {
  throw Error(fmt::format("what a track has left cannot be kept: {}", error.what()));
}

PartialTrack::~PartialTrack() {
  if (lock_ < 0) return;
  disk_.flush();  // before another process may go on from what is there
  close(lock_);
}

std::filesystem::path PartialTrack::records_file() const { return folder_ / (kRecords + run_); }

std::filesystem::path PartialTrack::file(std::size_t i) const {
  return i < TrackRows::files.size() ? folder_ / TrackRows::files[i] : records_file();
}

/// Opens what is there, cut to where the snapshot was; false where it is not of that run.
bool PartialTrack::go_on(const Continues& continues) {
  if (!continues.from || continues.from->run.empty()) return false;
  run_ = continues.from->run;
  std::size_t records = continues.from->records;
  std::vector<std::uintmax_t> sizes(continues.from->sizes.begin(), continues.from->sizes.end());
  sizes.push_back(records * continues.record_bytes);
  for (std::size_t i = 0; i < sizes.size(); ++i)
    if (!std::filesystem::exists(file(i)) || std::filesystem::file_size(file(i)) < sizes[i]) return false;
  std::string header;
  std::getline(open_input(file(TrackRows::files.size() - 1)), header);
  if (header + "\n" != rows_.headers().back()) return false;  // other predictions were asked for
  if (continues.keeps_all) {
    for (std::size_t i = 0; i < TrackRows::files.size(); ++i) {
      cut_half_line(file(i));
      sizes[i] = std::filesystem::file_size(file(i));
    }
    records = std::filesystem::file_size(records_file()) / continues.record_bytes;
    sizes.back() = records * continues.record_bytes;
  }
  for (std::size_t i = 0; i < sizes.size(); ++i) files_.push_back(disk_.open(file(i), sizes[i]));
  earlier_ = records_ = records;
  return true;
}

void PartialTrack::begin() try {
  std::filesystem::create_directories(folder_);
  lock_ = locked(folder_);
  const TrackRows::Texts headers = rows_.headers();
  for (std::size_t i = 0; i < headers.size(); ++i) {
    files_.push_back(disk_.open(file(i)));
    disk_.append(files_[i], headers[i]);
  }
  if (!run_.empty()) files_.push_back(disk_.open(records_file()));
} catch (const std::filesystem::filesystem_error& error) {
  throw Error(fmt::format("{} cannot be made: {}", folder_.string(), error.code().message()));
}

void PartialTrack::add(const TrackRecord& record) {
  if (lock_ < 0) begin();
  const TrackRows::Texts texts = rows_.of(record);
  for (std::size_t i = 0; i < texts.size(); ++i) disk_.append(files_[i], texts[i]);
  if (!run_.empty()) disk_.append(files_.back(), bytes_of(record));
  ++records_;
}

PartialPlace PartialTrack::place() const {
  if (run_.empty() || files_.empty()) return {};
  PartialPlace place{run_, {}, records_};
  for (std::size_t i = 0; i < place.sizes.size(); ++i) place.sizes[i] = disk_.size(files_[i]);
  return place;
}

void PartialTrack::remove() {
  if (lock_ < 0) return;
  std::error_code ignored;  // it is in nobody's way
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace tandem

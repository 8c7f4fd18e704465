#include <algorithm>
#include <cerrno>
#include <cstring>
#include <random>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/online/partial_track.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

const std::string kRecords = "records-";  // prefix of the records file; the name of the run follows

/// Returns a random name.
std::string name_of_run() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

/// Locks a folder. Throws Error if another process has locked it.
std::unique_ptr<FileLock> locked(const std::filesystem::path& folder) {
  auto lock = std::make_unique<FileLock>(folder, FileLock::Busy::give_up);
  if (lock->failure() == 0) return lock;
  if (lock->failure() == EWOULDBLOCK)
    throw Error(fmt::format("another track is writing to {}; use another --out folder", folder.string()));
  throw Error(fmt::format("cannot open {}: {}", folder.string(), std::strerror(lock->failure())));
}

/// Returns an entry of the folder that PartialTrack did not write, or nothing. A track that was killed at its start
/// leaves only some of the files, all empty.
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

/// Renames the folder of an earlier run, after removing incomplete last lines. Returns its new name.
std::filesystem::path set_aside(const std::filesystem::path& folder) {
  for (const char* file : TrackRows::files)
    if (std::filesystem::exists(folder / file)) remove_partial_line(folder / file);
  std::filesystem::path aside;
  for (int n = 1; aside.empty() || std::filesystem::exists(aside); ++n)
    aside = fmt::format("{}-{}", folder.string(), n);
  std::filesystem::rename(folder, aside);
  return aside;
}

}  // namespace

PartialTrack::PartialTrack(std::filesystem::path folder, const TrackRows& rows, DurableFiles& disk,
                           const std::optional<ResumeOptions>& resume_options,
                           const std::function<void(const std::string&)>& notify) try
    : folder_(std::move(folder)), rows_(rows), disk_(disk) {
  if (std::filesystem::is_symlink(folder_))
    throw Error(
        fmt::format("{} is reserved for intermediate results of a track, but is a link; remove it or change --out",
                    printable(folder_.string())));
  if (std::filesystem::exists(folder_)) {
    lock_ = locked(folder_);
    if (const auto file = foreign(folder_)) {
      lock_.reset();
      throw Error(fmt::format(
          "{} is reserved for intermediate results of a track, but contains {}; move that file or change --out",
          printable(folder_.string()), quote(file->filename().string())));
    }
    if (resume_options && resume(*resume_options)) return;
    const bool is_empty = std::filesystem::is_empty(folder_);
    const std::filesystem::path aside = is_empty ? std::filesystem::path() : set_aside(folder_);
    lock_.reset();
    if (!is_empty) notify("intermediate results of an interrupted track were moved to " + aside.string());
  }
  if (resume_options) run_ = name_of_run();
} catch (const std::filesystem::filesystem_error& error) {
  throw Error(fmt::format("cannot move the intermediate results of an earlier track: {}", error.what()));
}

PartialTrack::~PartialTrack() {
  if (lock_) disk_.flush();  // before the lock is released, so that another process finds complete files
}

std::filesystem::path PartialTrack::records_file() const { return folder_ / (kRecords + run_); }

std::filesystem::path PartialTrack::file(std::size_t i) const {
  return i < TrackRows::files.size() ? folder_ / TrackRows::files[i] : records_file();
}

/// Opens the files of the snapshot's run, truncated to their sizes at the snapshot. Returns false if the folder belongs
/// to another run or has other predictions.
bool PartialTrack::resume(const ResumeOptions& options) {
  if (!options.from || options.from->run.empty()) return false;
  run_ = options.from->run;
  std::size_t records = options.from->records;
  std::vector<std::uintmax_t> sizes(options.from->sizes.begin(), options.from->sizes.end());
  sizes.push_back(records * options.record_bytes);
  for (std::size_t i = 0; i < sizes.size(); ++i)
    if (!std::filesystem::exists(file(i)) || std::filesystem::file_size(file(i)) < sizes[i]) return false;
  std::string header;
  InputFile rows(file(TrackRows::files.size() - 1));
  std::getline(rows, header);
  if (header + "\n" != rows_.headers().back()) return false;
  if (options.keep_all) {
    for (std::size_t i = 0; i < TrackRows::files.size(); ++i) {
      remove_partial_line(file(i));
      sizes[i] = std::filesystem::file_size(file(i));
    }
    records = std::filesystem::file_size(records_file()) / options.record_bytes;
    sizes.back() = records * options.record_bytes;
  }
  for (std::size_t i = 0; i < sizes.size(); ++i) files_.push_back(disk_.open(file(i), sizes[i]));
  num_earlier_ = num_records_ = records;
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
  throw Error(fmt::format("cannot create {}: {}", folder_.string(), error.code().message()));
}

void PartialTrack::add(const TrackRecord& record) {
  if (!lock_) begin();
  const TrackRows::Texts texts = rows_.of(record);
  for (std::size_t i = 0; i < texts.size(); ++i) disk_.append(files_[i], texts[i]);
  if (!run_.empty()) disk_.append(files_.back(), bytes_of(record));
  ++num_records_;
}

PartialTrackCheckpoint PartialTrack::checkpoint() const {
  if (run_.empty() || files_.empty()) return {};
  PartialTrackCheckpoint checkpoint{run_, {}, num_records_};
  for (std::size_t i = 0; i < checkpoint.sizes.size(); ++i) checkpoint.sizes[i] = disk_.size(files_[i]);
  return checkpoint;
}

void PartialTrack::remove() {
  if (!lock_) return;
  std::error_code ignored;  // a folder that remains is harmless
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace tandem

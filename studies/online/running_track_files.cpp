#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/online/running_track_files.hpp>
#include <tandem/studies/online/watched_sensors.hpp>

namespace tandem {

RunningTrackFiles::RunningTrackFiles(Options options, const Scenario& scenario, const std::vector<double>& ahead)
    : options_(std::move(options)),
      rows_(scenario.frame, ahead, names_of_watched_sensors(scenario)),
      warn_("failed writes", options_.warn) {
  std::optional<PartialTrack::ResumeOptions> resume;
  if (options_.snapshot) {
    if (auto before = read_snapshot(*options_.snapshot, scenario))
      before_.emplace(TrackResumePoint{std::move(*before)});
    resume.emplace(PartialTrack::ResumeOptions{
        .keep_all = options_.keep_all, .record_bytes = record_bytes(ahead.size(), watched_sensors(scenario).size())});
    if (before_) resume->from = before_->snapshot.partial;
  }
  if (options_.snapshot || options_.partial_results) disk_.emplace(PartialTrack::period);
  if (options_.partial_results) {
    partial_.emplace(*options_.partial_results, rows_, *disk_, resume, options_.warn);
    if (before_) {
      before_->n = partial_->num_earlier_records();
      before_->records = partial_->records_file();
    }
  }
  if (before_ && options_.announce)
    options_.warn(
        fmt::format("resuming from {}, written at t = {:.1f} s", options_.snapshot->string(), before_->snapshot.t));
}

void RunningTrackFiles::add(const TrackRecord& record) {
  try {
    if (partial_) partial_->add(record);
  } catch (const Error& error) {  // the partial results could not be started
    partial_.reset();
    warn_(std::string(error.what()) + "; tracking continues, and results are written only at the end");
  }
  if (!disk_) return;
  if (const std::string why = disk_->failure(); !why.empty()) warn_(why + "; tracking continues");
}

void RunningTrackFiles::add(TrackSnapshot snapshot) {
  if (partial_) snapshot.partial = partial_->checkpoint();
  disk_->replace(*options_.snapshot, bytes_of(snapshot));
}

void RunningTrackFiles::remove(bool ended) {
  if (partial_ && (ended || !options_.snapshot)) partial_->remove();
  if (!ended || !options_.snapshot) return;
  disk_->flush();
  std::filesystem::remove(*options_.snapshot);
}

}  // namespace tandem

#include <cctype>

#include <fmt/format.h>

#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/studies/estimation/error_columns.hpp>
#include <tandem/studies/live/track_files.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/tum.hpp>

namespace tandem {
namespace {

using OptionalVector = std::optional<Vector<3>>;

struct TrackRow {
  const TrackRecord& record;
  const Frame& frame;

  OptionalVector in_body(OptionalVector v) const {
    if (v) v = frame.body(*v);
    return v;
  }
};

OptionalVector body_sigma(const Frame& frame, const TrackRecord& record, double times) {
  if (!record.covariance) return {};
  return Vector<3>(times * frame.body(sigmas(*record.covariance)).cwiseAbs());
}

/// A sensor's name as part of a column's.
std::string column_name(std::string text) {
  for (char& c : text)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return text;
}

CsvTable<TrackRow> track_columns(const std::vector<double>& ahead, const std::vector<std::string>& sensors) {
  CsvTable<TrackRow> table;
  table.add("t", "of the newest keyframe [s]", [](const TrackRow& r) { return r.record.t; })
      .add("type", "of that keyframe: optical, usbl or gated", [](const TrackRow& r) { return name(r.record.type); })
      .add("new_keyframe", "1, or 0 after a late measurement", [](const TrackRow& r) { return r.record.new_keyframe; })
      .add("keyframes", "in the window", [](const TrackRow& r) { return r.record.keyframes; })
      .add("update_ms", "that the update took, by the wall clock [ms]",
           [](const TrackRow& r) { return 1e3 * r.record.seconds; })
      .add("update_processor_ms", "and of processor time [ms]",
           [](const TrackRow& r) { return 1e3 * r.record.processor_seconds; })
      .add_xyz("{}_m", "the target's position in the chaser's body [m]",
               [](const TrackRow& r) {
                 return r.in_body(r.record.target ? OptionalVector(r.record.relative()) : OptionalVector());
               })
      .add_xyz("sigma_{}_m", "its standard deviation along the chaser's axes [m]",
               [](const TrackRow& r) { return body_sigma(r.frame, r.record, 1); })
      .add("chaser_sigma_m", "root of the summed variances of the chaser's position [m]",
           [](const TrackRow& r) { return r.record.chaser_sigma; });
  for (std::size_t i = 0; i < ahead.size(); ++i)
    table
        .add_xyz(fmt::format("ahead_{:g}_{{}}_m", ahead[i]),
                 "where the target will be so many seconds ahead, in the chaser's body of now [m]",
                 [i](const TrackRow& r) {
                   const auto& there = r.record.ahead[i];
                   return r.in_body(there ? OptionalVector(there->position) : OptionalVector());
                 })
        .add_xyz(fmt::format("sigma_ahead_{:g}_{{}}_m", ahead[i]),
                 "its standard deviation along the chaser's axes, where there is one [m]", [i](const TrackRow& r) {
                   const auto& there = r.record.ahead[i];
                   if (!there || !there->covariance) return OptionalVector();
                   return OptionalVector(r.frame.body(sigmas(*there->covariance)).cwiseAbs());
                 });
  table.add("converged", "whether the update did", [](const TrackRow& r) { return r.record.health.converged; })
      .add("rejected", "measurements by the gate, so far", [](const TrackRow& r) { return r.record.health.rejected(); })
      .add("resets", "times that the track has begun anew", [](const TrackRow& r) { return r.record.health.resets; })
      .add("suspensions", "times that it was suspended for want of measurements",
           [](const TrackRow& r) { return r.record.health.suspensions; });
  for (std::size_t i = 0; i < sensors.size(); ++i)
    table
        .add(column_name(sensors[i]) + "_sigmas",
             "innovation of the sensor's newest measurement, in standard deviations",
             [i](const TrackRow& r) { return r.record.health.sensors[i].sigmas; })
        .add(column_name(sensors[i]) + "_age_s", "since the sensor's last measurement that was used [s]",
             [i](const TrackRow& r) { return r.record.health.sensors[i].age; });
  return table;
}

/// The newest state against the truth, when a keyframe had just joined.
struct ErrorRow {
  const TrackError& all;
  const KeyframeError& error;
  const Frame& frame;
  OptionalVector three_sigma;
};

CsvTable<ErrorRow> error_columns(const std::vector<double>& ahead) {
  CsvTable<ErrorRow> table;
  add_relative_error_columns(table);
  table
      .add("raw_position_error_m", "size of the error of the measurement itself [m]",
           [](const ErrorRow& r) { return r.error.raw_position; })
      .add("chaser_position_error_m", "of the chaser in the world [m]",
           [](const ErrorRow& r) { return r.all.chaser_position; })
      .add("chaser_orientation_error_deg", "of the chaser in the world [deg]",
           [](const ErrorRow& r) { return r.all.chaser_orientation; });
  for (std::size_t i = 0; i < ahead.size(); ++i)
    table.add(fmt::format("ahead_{:g}_error_m", ahead[i]),
              "error of the position that was predicted so many seconds ahead [m]",
              [i](const ErrorRow& r) { return r.all.ahead[i]; });
  return table;
}

/// A trajectory, written as it grows.
class TumFile : public OutputFile {
 public:
  TumFile(const std::filesystem::path& file, const Frame& frame) : OutputFile(file), frame_(frame) {
    write(tum_header);
  }
  void add(double t, const SE3& pose, bool orientation = true) {
    const SE3 there = frame_.world(pose);
    write(tum_row(t, there.translation(), orientation ? std::optional(there.rotation()) : std::nullopt));
  }
  /// The truth at time t, where there is one.
  void add(double t, const std::vector<Stamped<SE3>>& truth, bool orientation) {
    if (const auto pose = pose_at(truth, t)) add(t, *pose, orientation);
  }

 private:
  const Frame& frame_;
};

}  // namespace

void write_track(const Track& track, const TrackSummary& summary, const Scenario& scenario, const LiveOptions& options,
                 const std::filesystem::path& folder) {
  const Frame& frame = scenario.frame;
  const CsvTable<TrackRow> track_table = track_columns(options.ahead, sensor_names(track.health));
  const CsvTable<ErrorRow> error_table = error_columns(options.ahead);
  TumFile chaser(folder / "chaser.tum", frame), target(folder / "target.tum", frame);
  OutputFile rows(folder / "track.csv"), errors(folder / "errors.csv");
  std::optional<TumFile> chaser_truth, target_truth;
  if (!scenario.truth_chaser.empty()) chaser_truth.emplace(folder / "chaser_truth.tum", frame);
  if (!scenario.truth_target.empty()) target_truth.emplace(folder / "target_truth.tum", frame);
  rows.write(track_table.header());
  errors.write(error_table.header());
  track.records.each([&](const TrackRecord& r) {
    chaser.add(r.t, r.chaser);
    if (r.target)
      target.add(r.t, SE3(r.target->rotation.value_or(SO3()), r.target->position), r.target->rotation.has_value());
    rows.write(track_table.row({r, frame}));
    if (!r.new_keyframe) return;
    const TrackError error = track_error(scenario, r, options);
    errors.write(error_table.row({error, error.relative, frame, body_sigma(frame, r, 3)}));
    if (chaser_truth) chaser_truth->add(r.t, scenario.truth_chaser, scenario.truth_orientation);
    if (target_truth) target_truth->add(r.t, scenario.truth_target, scenario.truth_orientation);
  });
  for (OutputFile* file : {static_cast<OutputFile*>(&chaser), static_cast<OutputFile*>(&target), &rows, &errors})
    file->close();
  if (chaser_truth) chaser_truth->close();
  if (target_truth) target_truth->close();
  write_file(folder / "summary.json", track_json(track, summary));
}

std::vector<CsvDescription> track_file_columns(const LiveOptions& options) {
  return {track_columns(options.ahead, {"SENSOR"}).describe("track.csv"),
          error_columns(options.ahead).describe("errors.csv")};
}

}  // namespace tandem

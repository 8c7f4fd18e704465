#include <deque>

#include <fmt/format.h>

#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/studies/estimation/error_columns.hpp>
#include <tandem/studies/online/track_files.hpp>
#include <tandem/studies/online/track_rows.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/tum.hpp>

namespace tandem {
namespace {

using OptionalVector = std::optional<Vector<3>>;

/// Errors of the newest state at a new keyframe.
struct ErrorRow {
  const TrackError& all;
  const KeyframeError& error;
  const Frame& frame;
  OptionalVector three_sigma;
  std::optional<double> nees;
};

CsvTable<ErrorRow> error_columns(const std::vector<double>& ahead) {
  CsvTable<ErrorRow> table;
  add_relative_error_columns(table);
  table
      .add("raw_position_error_m", "position error of the measurement itself, magnitude [m]",
           [](const ErrorRow& r) { return r.error.raw_position; })
      .add("chaser_position_error_m", "position error of the chaser in the world, magnitude [m]",
           [](const ErrorRow& r) { return r.all.chaser_position; })
      .add("chaser_orientation_error_deg", "orientation error of the chaser in the world, rotation angle [deg]",
           [](const ErrorRow& r) { return r.all.chaser_orientation; });
  for (std::size_t i = 0; i < ahead.size(); ++i)
    table.add(fmt::format("ahead_{:g}_error_m", ahead[i]),
              "error of the relative position predicted H seconds ahead, magnitude [m]",
              [i](const ErrorRow& r) { return r.all.ahead[i]; });
  return table;
}

/// A file of true poses, interpolated at the times passed to add().
class TruthFile : public OutputFile {
 public:
  TruthFile(const std::filesystem::path& file, const Frame& frame, const std::vector<Stamped<SE3>>& truth,
            bool orientation)
      : OutputFile(file), frame_(frame), truth_(truth), orientation_(orientation) {
    write(tum_header);
  }
  void add(double t) {
    const auto pose = pose_at(truth_, t);
    if (!pose) return;
    const SE3 there = frame_.world(*pose);
    write(tum_row(t, there.translation(), orientation_ ? std::optional(there.rotation()) : std::nullopt));
  }

 private:
  const Frame& frame_;
  const std::vector<Stamped<SE3>>& truth_;
  bool orientation_;
};

}  // namespace

void write_track(const Track& track, const TrackSummary& summary, const Scenario& scenario, const TrackOptions& options,
                 const std::filesystem::path& folder) {
  const Frame& frame = scenario.frame;
  const TrackRows rows(frame, options.ahead, sensor_names(track.health));
  const CsvTable<ErrorRow> error_table = error_columns(options.ahead);
  std::deque<OutputFile> found;
  for (std::size_t i = 0; i < TrackRows::files.size(); ++i)
    found.emplace_back(folder / TrackRows::files[i]).write(rows.headers()[i]);
  OutputFile errors(folder / "errors.csv");
  errors.write(error_table.header());
  std::deque<TruthFile> truths;
  for (const auto& [name, truth] :
       {std::pair{"chaser_truth.tum", &scenario.truth_chaser}, {"target_truth.tum", &scenario.truth_target}})
    if (!truth->empty()) truths.emplace_back(folder / name, frame, *truth, scenario.truth_orientation);
  track.records.each([&](const TrackRecord& r) {
    const TrackRows::Texts texts = rows.of(r);
    for (std::size_t i = 0; i < texts.size(); ++i) found[i].write(texts[i]);
    if (!r.new_keyframe) return;
    const TrackError error = track_error(scenario, r, options);
    errors.write(error_table.row({error, error.relative, frame, body_sigma(frame, r, 3),
                                  relative_nees(error.relative.position_vector, r.covariance)}));
    for (TruthFile& truth : truths) truth.add(r.t);
  });
  for (OutputFile& file : found) file.close();
  errors.close();
  for (TruthFile& file : truths) file.close();
  if (!track.at.empty()) write_states_at(track.at, frame, track.has_target, folder);
  write_file(folder / "summary.json", track_json(track, summary));
}

std::vector<FileDescription> track_file_columns(const TrackOptions& options) {
  return {TrackRows(Frame(), options.ahead, {"SENSOR"}).describe(), error_columns(options.ahead).describe("errors.csv"),
          states_at_columns(true)};
}

}  // namespace tandem

#include <cctype>

#include <fmt/format.h>

#include <tandem/studies/live/told_sigma.hpp>
#include <tandem/studies/live/track_rows.hpp>
#include <tandem/studies/support/tum.hpp>

namespace tandem {
namespace {

using OptionalVector = std::optional<Vector<3>>;

OptionalVector in_body(const TrackRow& r, OptionalVector v) {
  if (v) v = r.frame.body(*v);
  return v;
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
                 return in_body(r, r.record.target ? OptionalVector(r.record.relative()) : OptionalVector());
               })
      .add_xyz("sigma_{}_m", "its standard deviation along the chaser's axes [m]",
               [](const TrackRow& r) { return body_sigma(r.frame, r.record, 1); })
      .add("chaser_sigma_m", "root of the summed variances of the chaser's position [m]",
           [](const TrackRow& r) { return told_sigma(r.record.chaser_sigma); });
  for (std::size_t i = 0; i < ahead.size(); ++i)
    table
        .add_xyz(fmt::format("ahead_{:g}_{{}}_m", ahead[i]),
                 "where the target will be so many seconds ahead, in the chaser's body of now [m]",
                 [i](const TrackRow& r) {
                   const auto& there = r.record.ahead[i];
                   return in_body(r, there ? OptionalVector(there->position) : OptionalVector());
                 })
        .add_xyz(fmt::format("sigma_ahead_{:g}_{{}}_m", ahead[i]),
                 "its standard deviation along the chaser's axes, where there is one [m]", [i](const TrackRow& r) {
                   const auto& there = r.record.ahead[i];
                   if (!there || !there->covariance) return OptionalVector();
                   return OptionalVector(told_sigmas(r.frame, *there->covariance, kUnobservedAhead));
                 });
  table.add("converged", "whether the update did", [](const TrackRow& r) { return r.record.health.converged; })
      .add("rejected", "measurements by the gate, so far", [](const TrackRow& r) { return r.record.health.rejected(); })
      .add("resets", "times that the track has begun anew", [](const TrackRow& r) { return r.record.health.resets; })
      .add("suspensions", "times that it was suspended for want of measurements",
           [](const TrackRow& r) { return r.record.health.suspensions; })
      .add("chaser_output", "aided; lost, its aiding for --lost-after; invalid, for --invalid-after",
           [](const TrackRow& r) { return name(r.record.health.chaser.state); })
      .add("target_output", "likewise, and none while there is no target",
           [](const TrackRow& r) { return name(r.record.health.target.state); });
  for (std::size_t i = 0; i < sensors.size(); ++i)
    table
        .add(column_name(sensors[i]) + "_sigmas",
             "innovation of the sensor's newest measurement, in standard deviations",
             [i](const TrackRow& r) { return r.record.health.sensors[i].sigmas; })
        .add(column_name(sensors[i]) + "_age_s", "since the sensor's last measurement that was used [s]",
             [i](const TrackRow& r) { return r.record.health.sensors[i].age; });
  return table;
}

}  // namespace

TrackRows::TrackRows(const Frame& frame, const std::vector<double>& ahead, const std::vector<std::string>& sensors)
    : frame_(frame), table_(track_columns(ahead, sensors)) {}

TrackRows::Texts TrackRows::headers() const { return {tum_header, tum_header, table_.header()}; }

TrackRows::Texts TrackRows::of(const TrackRecord& r) const {
  Texts texts{tum_row(r.t, frame_.world(r.chaser)), "", table_.row({r, frame_})};
  if (!r.target) return texts;
  const SE3 target = frame_.world(SE3(r.target->rotation.value_or(SO3()), r.target->position));
  texts[1] = tum_row(r.t, target.translation(), r.target->rotation ? std::optional(target.rotation()) : std::nullopt);
  return texts;
}

std::optional<Vector<3>> body_sigma(const Frame& frame, const TrackRecord& record, double times) {
  if (!record.covariance) return {};
  return Vector<3>(times * told_sigmas(frame, *record.covariance));
}

}  // namespace tandem

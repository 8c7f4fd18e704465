#include <cctype>

#include <fmt/format.h>

#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/online/reported_sigma.hpp>
#include <tandem/studies/online/track_rows.hpp>
#include <tandem/studies/support/tum.hpp>

namespace tandem {
namespace {

using OptionalVector = std::optional<Vector<3>>;

OptionalVector in_body(const TrackRow& r, OptionalVector v) {
  if (v) v = r.frame.body(*v);
  return v;
}

/// Returns the name of a sensor as part of a column name: other characters than letters and digits become underscores.
std::string column_name(std::string text) {
  for (char& c : text)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return text;
}

CsvTable<TrackRow> track_columns(const std::vector<double>& ahead, const std::vector<std::string>& sensors) {
  CsvTable<TrackRow> table;
  table.add("t", "time of the newest keyframe [s]", [](const TrackRow& r) { return r.record.t; })
      .add("type", kKeyframeTypeColumn, [](const TrackRow& r) { return name(r.record.type); })
      .add("new_keyframe", "1: the update added a keyframe; 0: a late measurement caused it",
           [](const TrackRow& r) { return r.record.new_keyframe; })
      .add("keyframes", "number of keyframes in the window", [](const TrackRow& r) { return r.record.keyframes; })
      .add("update_ms", "duration of the update by the wall clock [ms]",
           [](const TrackRow& r) { return 1e3 * r.record.seconds; })
      .add("update_processor_ms", "processor time of the update [ms]",
           [](const TrackRow& r) { return 1e3 * r.record.processor_seconds; })
      .add_xyz("{}_m", "position of the target in the chaser's body [m]",
               [](const TrackRow& r) {
                 return in_body(r, r.record.target ? OptionalVector(r.record.relative()) : OptionalVector());
               })
      .add_xyz("sigma_{}_m", "standard deviation of that position along the chaser's axes [m]",
               [](const TrackRow& r) { return body_sigma(r.frame, r.record, 1); })
      .add("chaser_sigma_m", "standard deviation of the chaser's position: root of the summed variances [m]",
           [](const TrackRow& r) { return reported_sigma(r.record.chaser_sigma); });
  for (std::size_t i = 0; i < ahead.size(); ++i)
    table
        .add_xyz(fmt::format("ahead_{:g}_{{}}_m", ahead[i]),
                 "position of the target predicted H seconds ahead, in the chaser's body at t [m]",
                 [i](const TrackRow& r) {
                   const auto& there = r.record.ahead[i];
                   return in_body(r, there ? OptionalVector(there->position) : OptionalVector());
                 })
        .add_xyz(fmt::format("sigma_ahead_{:g}_{{}}_m", ahead[i]),
                 "standard deviation of that prediction along the chaser's axes; empty if unknown [m]",
                 [i](const TrackRow& r) {
                   const auto& there = r.record.ahead[i];
                   if (!there || !there->covariance) return OptionalVector();
                   return OptionalVector(reported_sigmas(r.frame, *there->covariance, kUnobservedAhead));
                 });
  table.add("converged", "1: the update converged, else 0", [](const TrackRow& r) { return r.record.health.converged; })
      .add("rejected", "number of measurements that the gate has rejected so far",
           [](const TrackRow& r) { return r.record.health.rejected(); })
      .add("resets", "number of resets of the track so far", [](const TrackRow& r) { return r.record.health.resets; })
      .add("suspensions", "number of suspensions so far: chaser or target was not measured for --max-gap",
           [](const TrackRow& r) { return r.record.health.suspensions; })
      .add("chaser_output",
           "aided; lost: no aiding measurement for --lost-after; invalid: no aiding measurement or no converged update "
           "for --invalid-after; unconfirmed: a sensor contradicted the estimate, and no other confirms it",
           [](const TrackRow& r) { return name(r.record.health.chaser.state); })
      .add("target_output", "as chaser_output; none: there is no target yet",
           [](const TrackRow& r) { return name(r.record.health.target.state); });
  for (std::size_t i = 0; i < sensors.size(); ++i)
    table
        .add(column_name(sensors[i]) + "_sigmas",
             "innovation of the sensor's newest measurement in standard deviations",
             [i](const TrackRow& r) { return r.record.health.sensors[i].sigmas; })
        .add(column_name(sensors[i]) + "_age_s", "time since the sensor's last used measurement [s]",
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

std::optional<Vector<3>> body_sigma(const Frame& frame, const TrackRecord& record, double factor) {
  if (!record.covariance) return {};
  return Vector<3>(factor * reported_sigmas(frame, *record.covariance));
}

}  // namespace tandem

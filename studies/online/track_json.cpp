#include <tandem/studies/estimation/error_fields.hpp>
#include <tandem/studies/fit/fit_text.hpp>
#include <tandem/studies/navigation/systematic_error_estimates_json.hpp>
#include <tandem/studies/online/track_report.hpp>

namespace tandem {
namespace {

struct Document {
  const Track& track;
  const TrackSummary& summary;
};

/// Errors at keyframes of one type.
struct TypeErrors {
  const ErrorSummary& errors;
  const std::optional<MeanStd>& nees;
};

struct Memory {
  double early, end;
};

struct RejectionCount {
  std::string sensor, reason;
  long long lines;
};

struct ChaserErrors {
  const std::optional<MeanStd>&position, &orientation;
};

std::optional<double> mean(const std::optional<MeanStd>& errors) {
  return errors ? std::optional(errors->mean) : std::nullopt;
}

JsonFields<UpdateTimes> time_fields() {
  return JsonFields<UpdateTimes>()
      .add("p50", "median", [](const UpdateTimes& t) { return t.median; })
      .add("p99", "99th percentile", [](const UpdateTimes& t) { return t.p99; })
      .add("max", "maximum", [](const UpdateTimes& t) { return t.max; });
}

JsonFields<Memory> memory_fields() {
  return JsonFields<Memory>()
      .add("at_10_percent", "after 10 % of the run", [](const Memory& m) { return m.early; })
      .add("at_end", "at the end", [](const Memory& m) { return m.end; });
}

JsonFields<SensorHealth> sensor_fields() {
  using S = SensorHealth;
  return JsonFields<S>()
      .add("sensor", "name of the sensor", [](const S& s) { return s.name; })
      .add("used", "number of measurements used", [](const S& s) { return s.used; })
      .add("rejected", "number of measurements that the gate rejected", [](const S& s) { return s.rejected; })
      .add("down_weighted", "number that the robust loss gives a weight below 0.5",
           [](const S& s) { return s.down_weighted; })
      .add("nis", "mean NIS per row of the used measurements; 1 if consistent",
           [](const S& s) { return s.nis_rows > 0 ? std::optional(s.nis / double(s.nis_rows)) : std::nullopt; })
      .add("last_used", "time of the last used measurement [s]", [](const S& s) { return s.last_used; });
}

JsonFields<FaultyIntervalDetector::Interval> unreliable_fields() {
  using I = FaultyIntervalDetector::Interval;
  return JsonFields<I>()
      .add("since", "start [s]", [](const I& i) { return i.since; })
      .add("until", "end [s]", [](const I& i) { return i.until; });
}

JsonFields<RejectionCount> rejected_fields() {
  using R = RejectionCount;
  return JsonFields<R>()
      .add("sensor", "name of the sensor, or odometry", [](const R& r) { return r.sensor; })
      .add("why", "reason", [](const R& r) { return r.reason; })
      .add("lines", "number of lines", [](const R& r) { return r.lines; });
}

JsonFields<TypeErrors> type_fields() {
  return JsonFields<TypeErrors>()
      .add_all(error_fields(), [](const TypeErrors& e) -> const ErrorSummary& { return e.errors; })
      .add("position_nees_mean", "mean NEES of the relative position; 3 if consistent, 2 in the plane",
           [](const TypeErrors& e) { return mean(e.nees); });
}

JsonFields<AheadErrors> prediction_fields() {
  using A = AheadErrors;
  JsonFields<A> fields;
  fields.add("seconds_ahead", "prediction time [s]", [](const A& a) { return a.seconds; })
      .add("n", "number of predictions", [](const A& a) { return a.position ? a.position->n : 0; });
  add_mean_std(fields, "position", "m", "error of the predicted relative position [m]",
               [](const A& a) { return a.position; });
  return fields.add("position_nees_mean", "mean NEES of the predicted relative position; 3 if consistent",
                    [](const A& a) { return mean(a.nees); });
}

JsonFields<ChaserErrors> chaser_fields() {
  using C = ChaserErrors;
  JsonFields<C> fields;
  fields.add("n", "number of keyframes", [](const C& c) { return c.position->n; });
  add_mean_std(fields, "position", "m", "position error [m]", [](const C& c) { return c.position; });
  add_mean_std(fields, "orientation", "deg", "orientation error [deg]", [](const C& c) { return c.orientation; });
  return fields;
}

std::vector<RejectionCount> rejected_lines(const Track& track) {
  std::vector<RejectionCount> result;
  for (const auto& [what, n] : track.rejected_lines.counts())
    result.push_back({what.first, what.second, static_cast<long long>(n)});
  return result;
}

/// Returns the errors by type of keyframe; empty without a target or truth.
std::vector<std::pair<std::string, TypeErrors>> errors_by_type(const Document& d) {
  std::vector<std::pair<std::string, TypeErrors>> errors;
  if (!d.track.has_target || !d.summary.truth) return errors;
  for (std::size_t i = 0; i < d.summary.errors.size(); ++i)
    errors.emplace_back(i == TrackSummary::all ? "all" : std::string(name(keyframe_types[i])),
                        TypeErrors{d.summary.errors[i], d.summary.nees[i]});
  return errors;
}

JsonFields<Document> track_fields() {
  using D = Document;
  return JsonFields<D>()
      .add("scenario", "name of the scenario", [](const D& d) { return d.summary.scenario; })
      .add("frame", "frame of the scenario: ENU-FLU or NED-FRD", [](const D& d) { return d.summary.frame; })
      .add("model", "motion model, mode and window", [](const D& d) { return d.summary.model; })
      .add("interrupted", "whether an interrupt ended the run", [](const D& d) { return d.track.interrupted; })
      .add("lines", "number of lines read", [](const D& d) { return d.track.lines; })
      .add("data_seconds", "duration of the data [s]", [](const D& d) { return d.track.last - d.track.first; })
      .add("seconds", "duration of the run [s]", [](const D& d) { return d.track.seconds; })
      .add("updates", "number of updates", [](const D& d) { return d.summary.updates; })
      .add("keyframes", "number of keyframes", [](const D& d) { return d.summary.keyframes; })
      .add("not_converged", "number of updates that did not converge", [](const D& d) { return d.track.not_converged; })
      .add_object("update_wall_ms", "durations of the updates by the wall clock [ms]", time_fields(),
                  [](const D& d) -> const UpdateTimes& { return d.summary.wall; })
      .add_object("update_processor_ms", "processor times of the updates [ms]", time_fields(),
                  [](const D& d) -> const UpdateTimes& { return d.summary.processor; })
      .add_object("memory_mb", "resident memory [MB]", memory_fields(),
                  [](const D& d) -> std::optional<Memory> {
                    if (!d.summary.memory_early) return {};
                    return Memory{*d.summary.memory_early, *d.summary.memory_end};
                  })
      .add("resets", "number of resets", [](const D& d) { return d.track.health.resets; })
      .add("suspensions", "number of suspensions", [](const D& d) { return d.track.health.suspensions; })
      .add_list("sensors", "use of each sensor", sensor_fields(),
                [](const D& d) -> const std::vector<SensorHealth>& { return d.track.health.sensors; })
      .add_object("fit", "agreement of the innovations with the stated noise; the cost is half the sum of the NIS",
                  fit_fields(), [](const D& d) { return track_fit(d.track.health, d.track.components); })
      .add_object("unreliable",
                  "the longest interval in which the track was unreliable, if it is --bad-after or longer",
                  unreliable_fields(), [](const D& d) { return d.track.faulty_interval; })
      .add_map("systematic_errors", "NAME", "estimated systematic errors", systematic_error_fields(),
               [](const D& d) { return by_name(d.track.errors); })
      .add_list("rejected_lines", "lines that were rejected, by sensor and reason", rejected_fields(),
                [](const D& d) { return rejected_lines(d.track); })
      .add_map("errors", "TYPE",
               "errors of the newest state by the measurement at the keyframe: position, pose, partial, none; and at "
               "all keyframes",
               type_fields(), errors_by_type)
      .add_list("predictions", "errors of the predictions", prediction_fields(),
                [](const D& d) { return d.summary.truth ? d.summary.ahead : std::vector<AheadErrors>(); })
      .add_object("chaser", "errors of the newest state of a chaser that moves by its own sensors", chaser_fields(),
                  [](const D& d) -> std::optional<ChaserErrors> {
                    if (!d.summary.truth || !d.summary.chaser_position) return {};
                    return ChaserErrors{d.summary.chaser_position, d.summary.chaser_orientation};
                  });
}

}  // namespace

std::string track_json(const Track& track, const TrackSummary& summary) {
  return json_text(json_document("track", track_fields(), Document{track, summary}));
}

std::string track_json_summary_line(const Track& track, const TrackSummary& summary) {
  return json_line(json_document("track", track_fields(), Document{track, summary}));
}

FileDescription track_json_keys() { return describe_json("summary.json", "track", track_fields()); }

}  // namespace tandem

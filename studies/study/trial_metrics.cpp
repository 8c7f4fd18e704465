#include <algorithm>
#include <map>
#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/study/trial_metrics.hpp>
#include <tandem/studies/study/trial_sensors.hpp>

namespace tandem {
namespace {

const char* const kDocked = "docked";

/// Keyframes whose errors are averaged: one type, or all.
struct Keyframes {
  std::string metric;  ///< first part of the metrics' names: "at_TYPE" or "at_all"
  std::string doc;
  std::optional<KeyframeType> type;
  bool position = false, pose = false;  ///< whether they have a measured position, a measured pose
};

std::vector<Keyframes> make_keyframe_groups() {
  std::vector<Keyframes> all;
  for (const KeyframeType type : keyframe_types) {
    const bool pose = type == KeyframeType::pose;
    all.push_back({fmt::format("at_{}", name(type)), fmt::format("{} keyframes", name(type)), type,
                   pose || type == KeyframeType::position, pose});
  }
  all.push_back({"at_all", "all keyframes", {}});
  return all;
}

const std::vector<Keyframes>& keyframe_groups() {
  static const std::vector<Keyframes> all = make_keyframe_groups();
  return all;
}

std::vector<TrialMetric> make_trial_metrics() {
  std::vector<TrialMetric> all;
  for (const Keyframes& of : keyframe_groups()) {
    all.push_back({of.metric + "_keyframes", "number of " + of.doc});
    all.push_back({of.metric + "_error_m", "mean relative position error at " + of.doc + " [m]"});
    all.push_back({of.metric + "_error_std_m", "standard deviation of this error [m]"});
    all.push_back({of.metric + "_orientation_deg", "mean relative orientation error at " + of.doc + " [deg]"});
    all.push_back({of.metric + "_orientation_std_deg", "standard deviation of this error [deg]"});
    if (!of.position) continue;
    all.push_back({"raw_" + of.metric + "_error_m", "mean position error of the measurements at " + of.doc + " [m]"});
    all.push_back({"raw_" + of.metric + "_error_std_m", "standard deviation of this error [m]"});
    if (!of.pose) continue;
    all.push_back({"raw_" + of.metric + "_orientation_deg",
                   "mean orientation error of the measurements at " + of.doc + " [deg]"});
    all.push_back({"raw_" + of.metric + "_orientation_std_deg", "standard deviation of this error [deg]"});
  }
  for (const double h : kAhead)
    all.push_back({ahead_metric(h),
                   fmt::format("with `window`: mean error of the relative position predicted {:g} s ahead [m]", h)});
  for (const auto& [name, doc] : std::vector<std::pair<std::string, std::string>>{
           {"gap_position_m", "mean relative position error within gaps [m]"},
           {"gap_worst_m", "largest relative position error within a gap, mean over gaps [m]"},
           {"after_gap_position_m", "mean relative position error in the 10 s after each gap [m]"},
           {"nees_chaser", "mean NEES of the chaser's pose; expected 6, in the plane 3"},
           {"nees_target",
            "mean NEES of the target's pose; expected 6, in the plane 3; empty if the target is a point"},
           {"nees_relative_pose",
            "mean NEES of the relative pose; expected 6, in the plane 3; empty if the target is a point"},
           {"nees_relative_position", "mean NEES of the relative position; expected 3, in the plane 2"},
           {"inside_three_sigma", "share of the relative position's components within 3 σ; expected 0.9973"},
           {"correlation_time_s", "lag at which the autocorrelation of the position error falls below 1/e [s]"},
           {"upside_down", "share of the target's poses whose z axis points down"},
           {"keyframes", "number of keyframes"},
           {"cost", "final cost"},
           {"violation", "largest violation of a hard constraint, in its own unit"},
           {"iterations", "number of solver iterations"},
           {kDocked, "rendezvous: 1 if it docked, else 0"},
           {"dock_s", "rendezvous: time until docked [s]"},
           {"dock_miss_m", "rendezvous: minimum distance from the docked position at any time [m]"},
           {"effort_s", "rendezvous: integral of the sum of squared commands, each divided by half its range [s]"},
           {"keep_out_violation_m", "rendezvous: largest true intrusion into the keep-out distance before docking [m]"},
           {"dock_three_sigma_m", "rendezvous: 3 σ of the estimated relative position at the end [m]"},
           {"plans", "rendezvous: number of plans"},
           {"plans_shifted", "rendezvous: number of fallback plans (the previous plan, shifted by a step)"},
           {"chaser_position_m", "dive: mean position error of the chaser [m]"},
           {"chaser_worst_m", "dive: largest position error of the chaser [m]"},
           {"chaser_outage_position_m", "dive: mean position error of the chaser during DVL outages [m]"},
           {"chaser_orientation_deg", "dive: mean orientation error of the chaser [deg]"},
           {"chaser_velocity_mps", "dive: mean velocity error of the chaser [m/s]"},
           {"chaser_inside_three_sigma", "dive: share of the chaser's position components within 3 σ; expected 0.9973"},
           {"nees_velocity", "dive: mean NEES of the chaser's velocity; expected 3"},
           {"nees_bias", "dive: mean NEES of the IMU biases; expected 6"},
           {"dvl_scale_error", "dive: error of the estimated DVL scale factor; empty if not estimated"}})
    all.push_back({name, doc, false, name == kDocked});
  for (const std::string& sensor : all_trial_sensors())
    all.push_back(
        {nis_metric(sensor),
         fmt::format("mean leave-one-out NIS of the sensor {}; expected: its number of residual rows", sensor)});
  all.push_back({"solve_s", "wall-clock time of the solve [s]", true});
  all.push_back({"plan_median_s", "rendezvous: median processor time of replans [s]", true});
  all.push_back({"plan_99_s", "rendezvous: 99th percentile of the processor time of replans [s]", true});
  all.push_back({"processor_s", "processor time of the whole trial [s]", true});
  return all;
}

void set_mean_std(TrialResult& result, const std::string& name, const std::string& unit,
                  const std::optional<MeanStd>& errors) {
  if (!errors) return;
  result.set(fmt::format("{}_{}", name, unit), errors->mean);
  result.set(fmt::format("{}_std_{}", name, unit), errors->std);
}

}  // namespace

std::string ahead_metric(double seconds) { return fmt::format("ahead_{:g}s_position_m", seconds); }

const std::vector<TrialMetric>& trial_metrics() {
  static const std::vector<TrialMetric> all = make_trial_metrics();
  return all;
}

std::size_t metric_index(std::string_view name) {
  static const std::map<std::string, std::size_t, std::less<>> places = [] {
    std::map<std::string, std::size_t, std::less<>> all;
    for (std::size_t i = 0; i < trial_metrics().size(); ++i) all.emplace(trial_metrics()[i].name, i);
    return all;
  }();
  const auto found = places.find(name);
  if (found == places.end()) throw Error(fmt::format("trials have no metric {}", name));
  return found->second;
}

void TrialResult::set(std::string_view metric, std::optional<double> value) {
  if (value && !std::isfinite(*value)) value.reset();
  metrics[metric_index(metric)] = value;
}

void TrialResult::set_mean(std::string_view metric, const Moments& of) {
  if (const auto errors = of.mean_std()) set(metric, errors->mean);
}

void add_errors(const std::vector<KeyframeError>& errors, TrialResult& result) {
  for (const Keyframes& keyframes : keyframe_groups()) {
    const ErrorSummary of = summarise(errors, keyframes.type);
    result.set(keyframes.metric + "_keyframes", of.n);
    set_mean_std(result, keyframes.metric + "_error", "m", of.position);
    set_mean_std(result, keyframes.metric + "_orientation", "deg", of.orientation);
    if (keyframes.position) set_mean_std(result, "raw_" + keyframes.metric + "_error", "m", of.raw_position);
    if (keyframes.pose) set_mean_std(result, "raw_" + keyframes.metric + "_orientation", "deg", of.raw_orientation);
  }
}

void add_gap_errors(const std::vector<KeyframeError>& errors, const std::vector<std::pair<double, double>>& gaps,
                    double after, TrialResult& result) {
  Moments within, beyond, worst;
  for (const auto& [from, to] : gaps) {
    double most = -1;
    for (const KeyframeError& error : errors) {
      if (!error.position || error.t < from || error.t > to + after) continue;
      (error.t <= to ? within : beyond).add(error.position);
      if (error.t <= to) most = std::max(most, *error.position);
    }
    if (most >= 0) worst.add(most);
  }
  if (const auto s = within.mean_std()) result.set("gap_position_m", s->mean);
  if (const auto s = worst.mean_std()) result.set("gap_worst_m", s->mean);
  if (const auto s = beyond.mean_std()) result.set("after_gap_position_m", s->mean);
}

std::optional<double> correlation_time(const std::vector<KeyframeError>& errors) {
  std::vector<Vector<3>> samples;  // the first keyframe of each second
  double second = -HUGE_VAL;
  for (const KeyframeError& error : errors)
    if (error.position_vector && std::floor(error.t) > second) {
      second = std::floor(error.t);
      samples.push_back(*error.position_vector);
    }
  if (samples.size() < 20) return {};
  Vector<3> mean = Vector<3>::Zero();
  for (const Vector<3>& e : samples) mean += e / double(samples.size());
  const auto correlation = [&](std::size_t lag) {
    double sum = 0;
    for (std::size_t i = 0; i + lag < samples.size(); ++i) sum += (samples[i] - mean).dot(samples[i + lag] - mean);
    return sum;
  };
  const double level = correlation(0) / std::numbers::e;
  double before = correlation(0);
  for (std::size_t lag = 1; lag < samples.size() / 2; ++lag) {
    const double now = correlation(lag);
    if (now < level) return double(lag) - (level - now) / (before - now);
    before = now;
  }
  return {};
}

}  // namespace tandem

#include <algorithm>
#include <map>
#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {
namespace {

const char* const kDocked = "docked";

struct TypeOfError {
  std::string name;
  std::optional<KeyframeType> type;
};

const std::vector<TypeOfError>& error_types() {
  static const std::vector<TypeOfError> all = {
      {"usbl", KeyframeType::usbl}, {"optical", KeyframeType::optical}, {"gated", KeyframeType::gated}, {"all", {}}};
  return all;
}

std::vector<TrialMetric> make_trial_metrics() {
  std::vector<TrialMetric> all;
  for (const auto& [name, type] : error_types()) {
    const std::string at = name == "all" ? "all keyframes" : name + " keyframes";
    all.push_back({name + "_keyframes", "how many " + at});
    all.push_back({name + "_position_m", "mean error of the relative position at " + at + " [m]"});
    all.push_back({name + "_position_std_m", "its standard deviation [m]"});
    all.push_back({name + "_orientation_deg", "mean error of the relative orientation at " + at + " [deg]"});
    all.push_back({name + "_orientation_std_deg", "its standard deviation [deg]"});
    if (type == KeyframeType::gated || !type) continue;
    all.push_back({"raw_" + name + "_position_m", "mean error of the measurements themselves at " + at + " [m]"});
    all.push_back({"raw_" + name + "_position_std_m", "its standard deviation [m]"});
    if (type == KeyframeType::optical) {
      all.push_back({"raw_optical_orientation_deg", "mean error of the measured orientations [deg]"});
      all.push_back({"raw_optical_orientation_std_deg", "its standard deviation [deg]"});
    }
  }
  for (const double h : kAhead)
    all.push_back(
        {ahead_metric(h), fmt::format("mean error of the relative position predicted {:g} s ahead, of what is "
                                      "newest in a window [m]",
                                      h)});
  for (const auto& [name, doc] : std::vector<std::pair<std::string, std::string>>{
           {"gap_position_m", "mean error of the relative position within gaps [m]"},
           {"gap_worst_m", "largest error within each gap, mean over gaps [m]"},
           {"after_gap_position_m", "mean error in the 10 s after each gap [m]"},
           {"nees_chaser", "mean normalised squared error of the chaser's pose: 6 where consistent; in the plane 3"},
           {"nees_target", "of the target's pose, where it is one: 6; in the plane 3"},
           {"nees_relative_pose", "of the relative pose, where the target is one: 6; in the plane 3"},
           {"nees_relative_position", "of the relative position: 3; in the plane 2"},
           {"inside_three_sigma", "share of the relative position's components within 3 σ: 0.9973"},
           {"nis_usbl", "normalised squared residual of USBL fixes, each by the others' prediction: 3; in the plane 2"},
           {"nis_optical", "of optical poses, where the target is a pose: 6; in the plane 3"},
           {"correlation_time_s", "until the autocorrelation of the position error falls below 1/e [s]"},
           {"upside_down", "share of the target's poses whose z axis points down"},
           {"keyframes", "of the problem"},
           {"cost", "final"},
           {"violation", "largest of a hard constraint, in its own unit"},
           {"iterations", "of the solver"},
           {kDocked, "1 where a rendezvous docked, else 0"},
           {"dock_s", "time until it did [s]"},
           {"dock_miss_m", "the least distance from the docked position [m]"},
           {"effort_s", "integral of the squared commands, each over half its range [s]"},
           {"keep_out_violation_m", "inside the keep-out distance before docking, in truth [m]"},
           {"dock_three_sigma_m", "of the estimated relative position at the end [m]"},
           {"plans", "of a rendezvous"},
           {"plans_shifted", "of them, the plan before a step later"},
           {"chaser_position_m", "mean error of the position of a chaser that dives by its own sensors [m]"},
           {"chaser_worst_m", "its largest [m]"},
           {"chaser_outage_position_m", "its mean while the DVL is out [m]"},
           {"chaser_orientation_deg", "mean error of its orientation [deg]"},
           {"chaser_velocity_mps", "mean error of its velocity [m/s]"},
           {"chaser_inside_three_sigma", "share of its position's components within 3 σ: 0.9973"},
           {"nees_velocity", "mean normalised squared error of its velocity: 3"},
           {"nees_bias", "of its IMU's biases: 6"},
           {"nis_dvl", "normalised squared residual of DVL velocities, each by the others' prediction: 3"},
           {"nis_depth", "of depths: 1"},
           {"nis_heading", "of orientations: 3"},
           {"nis_gps", "of GPS fixes: 3"},
           {"dvl_scale_error", "of the DVL's scale factor, where it is estimated"}})
    all.push_back({name, doc, false, name == kDocked});
  all.push_back({"solve_s", "time of the solve, by the clock [s]", true});
  all.push_back({"plan_median_s", "of the plans, by the clock [s]", true});
  all.push_back({"plan_99_s", "99th percentile [s]", true});
  all.push_back({"processor_s", "processor time of the whole trial, of its thread [s]", true});
  return all;
}

void set_spread(TrialResult& result, const std::string& name, const std::string& unit,
                const std::optional<MeanStd>& spread) {
  if (!spread) return;
  result.set(fmt::format("{}_{}", name, unit), spread->mean);
  result.set(fmt::format("{}_std_{}", name, unit), spread->std);
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
  if (const auto spread = of.spread()) set(metric, spread->mean);
}

void add_errors(const std::vector<KeyframeError>& errors, TrialResult& result) {
  for (const auto& [name, type] : error_types()) {
    const ErrorSummary of = summarise(errors, type);
    result.set(name + "_keyframes", of.n);
    set_spread(result, name + "_position", "m", of.position);
    set_spread(result, name + "_orientation", "deg", of.orientation);
    if (!type) continue;
    if (type != KeyframeType::gated) set_spread(result, "raw_" + name + "_position", "m", of.raw_position);
    if (type == KeyframeType::optical) set_spread(result, "raw_optical_orientation", "deg", of.raw_orientation);
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
  if (const auto s = within.spread()) result.set("gap_position_m", s->mean);
  if (const auto s = worst.spread()) result.set("gap_worst_m", s->mean);
  if (const auto s = beyond.spread()) result.set("after_gap_position_m", s->mean);
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

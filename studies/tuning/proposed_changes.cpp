#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/problem/quantile.hpp>
#include <tandem/studies/calibration/calibration_problem.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/scenario_ego.hpp>
#include <tandem/studies/support/text.hpp>
#include <tandem/studies/tuning/proposed_changes.hpp>

namespace tandem {
namespace {

constexpr double kTimes[] = {10, 40};  // correlation times [s], tried in addition to that of the residuals
constexpr double kDelay = 0.5, kScale = 0.05, kMisalignment = 0.05;  // σ of the priors of constants [s, 1, rad]
constexpr double kWhiteShare = 0.5;     // share of σ that stays white noise if noise is split
constexpr double kLeastVariance = 0.5;  // smallest variance of noise and bias together, relative to the stated noise
constexpr double kFactor = 2;           // ratio of the values that refinements try
constexpr double kCheckedShare = 0.25;  // share of the measurements of the slower of two sensors at which both measure
constexpr double kCheckedReach = 0.25;  // largest time between these measurements, relative to the smaller step
constexpr double kLooser[] = {3, 10};   // ratios of larger to stated standard deviations of sway and heave
constexpr std::size_t kFewest = 8;      // minimum number of measurements of a sensor to propose changes

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& v : values) v *= factor;
  return values;
}

std::string numbers(const std::vector<double>& values, double factor = 1) {
  return fmt::format("{:.4g}", fmt::join(scaled(values, factor), ","));
}

std::string drifting(const std::vector<double>& sigmas, double time) {
  return fmt::format("{}:{:.3g}", numbers(sigmas), time);
}

/// Returns the time between the first and the last measurement [s].
double length(const Scenario& scenario) {
  auto [first, last] = scenario.navigation ? time_span(*scenario.navigation).value_or(std::pair(HUGE_VAL, -HUGE_VAL))
                                           : std::pair(HUGE_VAL, -HUGE_VAL);
  for (const TargetSensor& sensor : scenario.data.sensors)
    for (const Measurement& m : sensor.measurements) {
      first = std::min(first, m.t);
      last = std::max(last, m.t);
    }
  return last - first;
}

/// Returns the times of validity, in order.
std::vector<double> times_of(const TargetSensor& sensor) {
  std::vector<double> times;
  for (const Measurement& m : sensor.measurements) times.push_back(sensor.valid_at(m));
  std::sort(times.begin(), times.end());
  return times;
}

/// Returns whether another sensor of the target measures at the times of this one. Slow errors of a single sensor are
/// not observable: the motion of the target explains them, and the sensor predicts its own errors.
bool is_checked(const TargetSensor& sensor, const std::vector<TargetSensor>& sensors) {
  const std::vector<double> own = times_of(sensor);
  return std::any_of(sensors.begin(), sensors.end(), [&](const TargetSensor& other) {
    if (other.name == sensor.name) return false;
    const std::vector<double> theirs = times_of(other);
    const double reach = kCheckedReach * std::min(detail::median_step(own), detail::median_step(theirs));
    const auto common = std::count_if(own.begin(), own.end(), [&](double t) {
      const auto next = std::lower_bound(theirs.begin(), theirs.end(), t - reach);
      return next != theirs.end() && *next <= t + reach;
    });
    const std::size_t fewer = std::min(own.size(), theirs.size());
    return fewer > 0 && double(common) >= kCheckedShare * double(fewer);
  });
}

/// Returns whether predictions can show that the motion noise is smaller. With a single sensor they cannot, since its
/// noise explains the same residuals.
bool motion_is_checked(const std::vector<TargetSensor>& sensors) {
  return std::any_of(sensors.begin(), sensors.end(), [&](const TargetSensor& s) { return is_checked(s, sensors); });
}

std::vector<double> non_holonomic_sigmas(const Scenario& scenario) {
  const Vector<2>& sigmas = scenario.data.noise.non_holonomic;
  return {sigmas.data(), sigmas.data() + (scenario.data.planar ? 1 : 2)};
}

/// Residuals of all components of one sensor.
struct SensorResiduals {
  double correlation_time = 0, mean = 0, standard_deviation = 0, down_weighted = 0;
  std::size_t count = 0;
};

SensorResiduals residuals_of(const CalibratedEntry& entry, const std::vector<Misfit>& residuals) {
  SensorResiduals all;
  for (std::size_t c = 0; c < entry.components.size(); ++c)
    for (const Misfit& m : residuals) {
      if (m.parameter != entry.parameter(c) || m.value.empty()) continue;
      all.count = std::max(all.count, m.value.size());
      all.correlation_time = std::max(all.correlation_time, m.correlation_time());
      if (m.has_significant_mean()) all.mean = std::max(all.mean, std::abs(m.mean()));
      all.standard_deviation = std::max(all.standard_deviation, m.standard_deviation());
      all.down_weighted =
          std::max(all.down_weighted, double(m.down_weighted) / double(m.down_weighted + m.value.size()));
    }
  return all;
}

/// Collects the candidates of a recording.
class Proposals {
 public:
  Proposals(const Scenario& scenario, const TrackingOptions& options, const std::vector<Misfit>& residuals)
      : scenario_(scenario), options_(options), residuals_(residuals), entries_(calibrated_entries(scenario)) {}

  std::vector<ModelChange> all() {
    if (!scenario_.data.sensors.empty()) {
      add({{"robust", "true"}}, "down-weights measurements that contradict the others", 1);
      motion_models();
    }
    for (const CalibratedEntry& entry : entries_)
      if (entry.sensor) sensor(entry);
    drift_of_all_sensors();
    errors_of_own_sensors();
    return std::move(changes_);
  }

 private:
  void add(ModelSettings settings, std::string why, double parameters) {
    changes_.push_back({std::move(settings), std::move(why), parameters});
  }

  const TargetSensor* target_sensor(const std::string& name) const {
    for (const TargetSensor& s : scenario_.data.sensors)
      if (s.name == name) return &s;
    return nullptr;
  }

  void motion_models() {
    const bool poses = std::any_of(scenario_.data.sensors.begin(), scenario_.data.sensors.end(),
                                   [](const TargetSensor& s) { return s.type->has(measured::rotation); });
    for (const MotionModel model : {MotionModel::constant_twist, MotionModel::damped_twist,
                                    MotionModel::white_noise_acceleration, MotionModel::constant_velocity})
      if (model != options_.model && (!poses || !is_point_model(model)))
        add({{"model", std::string(name(model))}}, "another motion model", 1);
    if (options_.mode == Mode::A && supports_points(options_.model))
      add({{"mode", "B"}}, "points at keyframes without a measured pose", 1);
    if (uses_triples(options_.model) && motion_is_checked(scenario_.data.sensors))
      add({{"horizons", "1,2,4"}}, "slower motion noise", 1);
    non_holonomic();
    if (!scenario_.data.planar && options_.roll_pitch == Role::soft)
      add({{"roll-pitch", "off"}}, "a target that tilts", 1);
  }

  /// Proposes targets that move forwards. The stated standard deviation of sway and heave may be too small, because a
  /// turning body has sway at all points but one.
  void non_holonomic() {
    add({{"non-holonomic", "soft"}}, "a target that moves forwards", 1);
    const std::vector<double> stated = non_holonomic_sigmas(scenario_);
    for (const double factor : kLooser)
      add({{"non-holonomic", "soft"}, {"noise non_holonomic", numbers(stated, factor)}},
          "a target that moves forwards, with some sway", 2);
  }

  bool is_checked(const CalibratedEntry& entry) const {
    const TargetSensor* const target = target_sensor(entry.name);
    // The other sensors of the chaser measure the same motion.
    return !target || tandem::is_checked(*target, scenario_.data.sensors);
  }

  void sensor(const CalibratedEntry& entry) {
    const SensorResiduals r = residuals_of(entry, residuals_);
    if (r.count < kFewest) return;
    losses(entry, r);
    if (is_checked(entry)) systematic_errors(entry, r);
  }

  /// A constant systematic error.
  struct Constant {
    std::string name, why;
    double sigma, parameters;
  };
  std::vector<Constant> constants_of(const CalibratedEntry& entry) const {
    std::vector<Constant> all = {{".delay", "a delay", kDelay, 1}};
    const TargetSensor* const target = target_sensor(entry.name);
    const bool length = target ? target->type->has(measured::position | measured::range) : entry.kind == "dvl";
    const bool turns = target ? !(target->type->parts == measured::range || target->type->parts == measured::height)
                              : entry.kind == "dvl" || entry.kind == "heading";
    if (length) all.push_back({".scale", "a scale factor error", kScale, 1});
    if (turns) all.push_back({".misalignment", "a misalignment", kMisalignment, 3});
    return all;
  }

  void systematic_errors(const CalibratedEntry& entry, const SensorResiduals& r) {
    const std::string error = "error " + entry.name;
    const std::string why =
        r.correlation_time > 0
            ? fmt::format("residuals correlate for {:.2g} s", r.correlation_time)
            : fmt::format("residuals have a spread of {:.2g} standard deviations", r.standard_deviation);
    for (const double time : times(r)) add({{error, drifting(entry.sigmas, time)}}, "a drifting bias; " + why, 2);
    if (r.mean > 0) {
      // Dead reckoning integrates a bias. If it were constant, the covariance would be too small after long gaps.
      const bool drifts = !target_sensor(entry.name);
      add({{error, drifts ? drifting(scaled(entry.sigmas, 3), length(scenario_)) : numbers(entry.sigmas, 3)}},
          fmt::format("a {} bias; residuals have a mean of {:.2g}", drifts ? "slow" : "constant", r.mean),
          double(entry.sigmas.size()) + double(drifts));
    }
    for (const Constant& c : constants_of(entry)) add({{error + c.name, numbers({c.sigma})}}, c.why, c.parameters);
    if (r.standard_deviation < 1) split(entry, r);
  }

  /// Splits the stated noise into a drifting bias and white noise.
  void split(const CalibratedEntry& entry, const SensorResiduals& r) {
    for (const double time : times(r))
      add({{"noise " + entry.name, numbers(entry.sigmas, kWhiteShare)},
           {"error " + entry.name, drifting(scaled(entry.sigmas, std::sqrt(1 - kWhiteShare * kWhiteShare)), time)}},
          fmt::format("part of the noise is a drifting bias; residuals have a spread of {:.2g}", r.standard_deviation),
          3);
  }

  void losses(const CalibratedEntry& entry, const SensorResiduals& r) {
    const std::string why = r.down_weighted > 0
                                ? fmt::format("heavy tails; {:.1f} % are down-weighted", 100 * r.down_weighted)
                                : fmt::format("heavy tails; the spread is {:.2g}", r.standard_deviation);
    if (entry.kind == name(SensorType::pose)) {  // turned poses need --robust; a loss alone does not reject them
      if (!options_.robust_initial_guess)
        add({{"loss " + entry.name + ".orientation", "cauchy:2"}}, "turned orientations", 1);
      return;
    }
    add({{"loss " + entry.name, "cauchy:2"}}, why, 1);
    add({{"loss " + entry.name, fmt::format("student-t:{:.3g}", std::sqrt(4.0 + double(entry.sigmas.size())))}}, why,
        1);
  }

  void drift_of_all_sensors() {
    for (const double time : kTimes) {
      ModelSettings settings;
      for (const CalibratedEntry& entry : entries_)
        if (entry.sensor && residuals_of(entry, residuals_).count >= kFewest && is_checked(entry))
          settings["error " + entry.name] = drifting(entry.sigmas, time);
      if (settings.size() > 1) add(settings, "drifting biases of all sensors", double(settings.size() + 1));
    }
  }

  /// Adds the systematic errors of all sensors of the chaser as one change. One of them alone may gain nothing, since
  /// the errors of other sensors have the same effect.
  void errors_of_own_sensors() {
    for (const double time : {0.0, kTimes[1]}) {
      ModelSettings settings;
      double parameters = 1;
      for (const CalibratedEntry& entry : entries_) {
        if (!entry.sensor || target_sensor(entry.name) || residuals_of(entry, residuals_).count < kFewest) continue;
        const std::string error = "error " + entry.name;
        if (time > 0) settings[error] = drifting(entry.sigmas, time);
        for (const Constant& c : constants_of(entry)) {
          settings[error + c.name] = numbers({c.sigma});
          parameters += c.parameters;
        }
      }
      if (settings.size() > 1)
        add(settings, "systematic errors of all sensors of the chaser", parameters + double(time > 0));
    }
  }

  static std::vector<double> times(const SensorResiduals& r) {
    std::vector<double> all(std::begin(kTimes), std::end(kTimes));
    if (r.correlation_time > 0) all.push_back(r.correlation_time);
    return all;
  }

  const Scenario& scenario_;
  const TrackingOptions& options_;
  const std::vector<Misfit>& residuals_;
  std::vector<CalibratedEntry> entries_;
  std::vector<ModelChange> changes_;
};

/// Returns the numbers before and after the colon of "1.5,0.02:10".
std::pair<std::vector<double>, double> numbers_of(const std::string& text) {
  std::pair<std::vector<double>, double> found{{}, 0};
  const std::size_t colon = text.find(':');
  for (const std::string_view word : split(std::string_view(text).substr(0, colon), ','))
    if (const auto value = parse_number(word)) found.first.push_back(*value);
  if (colon != text.npos) found.second = parse_number(std::string_view(text).substr(colon + 1)).value_or(0);
  return found;
}

/// Collects other values for the numbers of a model.
class Refinements {
 public:
  Refinements(const Scenario& scenario, const TrackingOptions& options, const ModelSettings& settings)
      : options_(options),
        settings_(settings),
        noise_(scenario.data.noise),
        entries_(calibrated_entries(scenario)),
        less_motion_(motion_is_checked(scenario.data.sensors)),
        length_(length(scenario)) {
    convert_noise_axes(noise_, scenario.frame);  // to the axes of the files
  }

  std::vector<ModelChange> all() {
    for (const auto& [setting, value] : settings_)
      if (setting.starts_with("error ")) error(setting, value);
    motion_times();
    for (const CalibratedEntry& entry : entries_) noise(entry);
    return std::move(changes_);
  }

 private:
  void add(const std::string& setting, std::string value, std::string why) {
    changes_.push_back({{{setting, std::move(value)}}, std::move(why), 1});
  }

  void error(const std::string& setting, const std::string& value) {
    const auto [sigmas, time] = numbers_of(value);
    for (const double factor : {kFactor, 1 / kFactor}) {
      if (!(time > 0)) {
        add(setting, numbers(sigmas, factor), "another standard deviation of the constant");
        continue;
      }
      add(setting, drifting(scaled(sigmas, factor), time), "another standard deviation of the bias");
      if (time * factor <= length_)  // a slower drift is a constant
        add(setting, drifting(sigmas, time * factor), "another correlation time");
    }
  }

  void motion_times() {
    if (options_.model != MotionModel::damped_twist && options_.model != MotionModel::damped_velocity) return;
    const bool twist = options_.model == MotionModel::damped_twist && options_.mode == Mode::A;
    const Eigen::VectorXd& times = twist ? noise_.twist_time : noise_.velocity_time;
    for (const double factor : {kFactor, 1 / kFactor})
      add(twist ? "noise twist_time" : "noise velocity_time",
          numbers({times.data(), times.data() + times.size()}, factor), "another time constant");
  }

  void noise(const CalibratedEntry& entry) {
    if (entry.name.ends_with(".error")) return;
    const bool sway = entry.name == "non_holonomic" && options_.non_holonomic == Role::soft;
    const bool motion = sway || entry.name == "constant_twist" || entry.name == "constant_velocity";
    if (!entry.sensor && !motion) return;
    if (motion && !sway &&
        (entry.name == "constant_velocity") != (is_point_model(options_.model) || options_.mode == Mode::B))
      return;
    for (const double factor : {kFactor, 1 / kFactor})
      if (factor > 1 || !motion || less_motion_)
        add("noise " + entry.name, numbers(entry.sigmas, factor), factor > 1 ? "larger noise" : "smaller noise");
  }

  const TrackingOptions& options_;
  const ModelSettings& settings_;
  TrackingNoise noise_;  // in the axes of the files
  std::vector<CalibratedEntry> entries_;
  bool less_motion_;  // whether smaller motion noise is tried
  double length_;     // length of the recording [s]
  std::vector<ModelChange> changes_;
};

}  // namespace

std::vector<ModelChange> proposed_changes(const Scenario& scenario, const TrackingOptions& options,
                                          const std::vector<Misfit>& residuals) {
  return Proposals(scenario, options, residuals).all();
}

std::vector<ModelChange> refined_changes(const Scenario& scenario, const TrackingOptions& options,
                                         const ModelSettings& settings) {
  return Refinements(scenario, options, settings).all();
}

bool keeps_stated_noise(const Scenario& stated, const Scenario& scenario) {
  const std::vector<CalibratedEntry> before = calibrated_entries(stated), now = calibrated_entries(scenario);
  const auto variance = [](const std::vector<CalibratedEntry>& entries, const std::string& sensor, std::size_t i) {
    double sum = 0;
    for (const CalibratedEntry& entry : entries)
      if (entry.name == sensor || entry.name == error_name(sensor)) sum += entry.sigmas[i] * entry.sigmas[i];
    return sum;
  };
  for (const CalibratedEntry& entry : before)
    for (std::size_t i = 0; entry.sensor && i < entry.sigmas.size(); ++i)
      if (variance(now, entry.name, i) < kLeastVariance * variance(before, entry.name, i)) return false;
  return true;
}

}  // namespace tandem

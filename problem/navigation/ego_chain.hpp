#pragma once

#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <tandem/problem/navigation/dvl_factors.hpp>
#include <tandem/problem/navigation/imu_record.hpp>
#include <tandem/problem/navigation/navigation_data.hpp>
#include <tandem/problem/navigation/sensor_constants.hpp>
#include <tandem/problem/problem.hpp>

namespace tandem {

/// State of the chaser at one instant.
struct EgoState {
  SE3 pose{};                              ///< body in the world
  Vector<3> velocity = Vector<3>::Zero();  ///< m/s, world
  Vector<6> bias = Vector<6>::Zero();      ///< accelerometer [m/s²], gyroscope [rad/s], along the IMU's axes
};

/// Prior standard deviations of the first state, along world axes.
struct EgoStateSigmas {
  Vector<3> position = Vector<3>::Constant(1e-3);  ///< m
  Vector<3> rotation = Vector<3>(0.3, 0.3, 1e-3);  ///< rad, about world axes: tilt about x and y, heading about z
  Vector<3> velocity = Vector<3>::Constant(1.0);   ///< m/s
  /// Standard deviations of the IMU biases [m/s², rad/s]. If they are given, the prior mean is the bias of the state;
  /// otherwise the prior has zero mean and the initial standard deviations of the ImuSensor.
  std::optional<Vector<6>> bias{};
};

/// Options of the residuals for the chaser's own sensors.
struct EgoOptions {
  bool dvl_scale = false;         ///< estimate one scale factor error of the DVL for the whole run
  double dvl_scale_sigma = 0.05;  ///< its prior standard deviation
  /// Preintegrates DVL velocities between keyframes with the gyroscope's rotation (DvlFactors), instead of one residual
  /// per velocity. For comparisons.
  bool preintegrated_dvl = false;
  double dvl_max_age = 2.0;  ///< Maximum time that a preintegrated velocity holds [s].
  Loss loss{};               ///< For sensors without EgoSensor::loss.
  /// Root spectral densities of acceleration [m/s² /√Hz] and turn rate [rad/s /√Hz] for Coasting, which connects
  /// keyframes without IMU samples between them.
  double coasting_acceleration = 0.3, coasting_turn_rate = 0.1;
};

/// Pose, velocity and, with an IMU, biases of the chaser at one keyframe.
struct EgoKeyframe {
  double t;  ///< s
  Variable<SE3> pose;
  Variable<R3> velocity;                ///< m/s, world
  std::optional<Variable<Rn<6>>> bias;  ///< [accelerometer; gyroscope] [m/s², rad/s]; none without an IMU
  Vector<6> preintegration_bias;        ///< bias at which the samples after this keyframe are preintegrated
};

/// Returns the state at a keyframe, from the current values of its variables.
EgoState state_at(const Problem& problem, const EgoKeyframe& keyframe);

/// State of a sensor's bias (SystematicError). Measurements between which the bias hardly changes share one state.
struct EgoBias {
  double t;  ///< time of the first measurement that reads it [s]
  std::variant<Variable<Rn<1>>, Variable<Rn<3>>> state;
  double last_used = t;  ///< time of the last measurement that reads it [s]
};

/// A measurement of the chaser's own sensors in a problem.
struct PlacedEgoMeasurement {
  std::size_t sensor;
  double t;                    ///< time of validity [s]
  std::optional<Block> block;  ///< none for DVL readings that are preintegrated
  /// Block of a new bias state, if the measurement added one: its prior, or the Gauss–Markov step from the previous
  /// state.
  std::optional<Block> bias_block{};
  std::size_t index = 0;  ///< in EgoSensor::measurements; set by make_navigation_problem()
};

/// Chain of the chaser's keyframes in a problem, for a whole recording or for data that arrive one by one.
///
/// IMU preintegration connects consecutive keyframes. Coasting connects them in gaps of the IMU, or without one. Every
/// other measurement attaches to the last keyframe before it: IMU samples propagate the state from the keyframe to the
/// time of the measurement (Propagated). If samples do not cover this interval, the measurement needs its own keyframe.
class EgoChain {
 public:
  /// Copies the Earth, the sensors and their settings from `data`. Does not read samples or measurements. Throws Error
  /// if the settings of a sensor are inconsistent or its systematic errors are not supported.
  EgoChain(Problem& problem, const NavigationData& data, const EgoOptions& options = {});

  /// Adds an IMU sample. Samples must be added before later keyframes and measurements. Returns false if the sample is
  /// not later than the last one, or if there is no IMU.
  bool add(const ImuSample& sample);

  /// Adds the first keyframe with a prior. The initial guess is `guess`, or else the prior mean.
  const EgoKeyframe& start(double t, const EgoState& prior, const EgoStateSigmas& sigmas,
                           const std::optional<EgoState>& guess = {});
  /// Adds a keyframe later than the last one. The initial guess is `guess`, or else the state predicted at t.
  const EgoKeyframe& extend(double t, const std::optional<EgoState>& guess = {});
  /// Returns whether attach() accepts a measurement at t. Otherwise the measurement needs a keyframe at t.
  bool can_attach(double t) const;
  /// Adds the bias state (SystematicError) that a measurement at t needs. Returns whether a state was added.
  bool prepare_bias(std::size_t sensor, double t);
  /// Calls f(t, variable) for each bias state that a newer one has superseded since the last call. t [s] is the time of
  /// the last keyframe whose measurements read it. Only states from prepare_bias() count. The newest bias state of each
  /// sensor stays in the problem, regardless of its age.
  template <class F>
  void each_superseded_bias(F f) {
    for (const EgoBias& bias : std::exchange(superseded_biases_, {}))
      std::visit([&](const auto& x) { f(bias.t, x); }, bias.state);
  }
  /// Adds a measurement that is valid at t. Throws Error unless can_attach(t).
  PlacedEgoMeasurement attach(std::size_t sensor, const EgoMeasurement& m, double t);

  const std::deque<EgoKeyframe>& keyframes() const { return keyframes_; }
  const ImuRecord* imu() const { return imu_ ? &*imu_ : nullptr; }
  /// Scale factor error of the DVL, if EgoOptions::dvl_scale is set.
  const std::optional<Variable<Rn<1>>>& dvl_scale() const { return scale_; }
  /// Calls f(name, variable, prior standard deviations) for each systematic error. The variable of a bias is its newest
  /// state.
  template <class F>
  void each_systematic_error(F f) const {
    constants_.each(f);
    for (std::size_t i = 0; i < biases_.size(); ++i)
      if (biases_[i] && !sensors_[i].error->has_constant_bias())
        std::visit([&](const auto& x) { f(sensors_[i].name + ".bias", x, sensors_[i].error->bias_sigma); },
                   biases_[i]->state);
  }
  /// Constant systematic errors of the sensors.
  const std::vector<SensorConstant>& constants() const { return constants_.all(); }
  /// Returns state_at() a keyframe.
  EgoState state(const EgoKeyframe& keyframe) const { return state_at(*problem_, keyframe); }
  /// Returns the state of the newest keyframe, propagated to t.
  EgoState predicted(double t) const;
  /// Intervals [from, to] in seconds without IMU samples, where Coasting connects the keyframes. Empty without an IMU.
  const std::vector<std::pair<double, double>>& splits() const { return splits_; }

  /// Forgets keyframes and samples before t. The variables of these keyframes must have left the problem.
  void drop_before(double t);

 private:
  struct Sum {  // samples since the newest keyframe
    double t;
    ImuPreintegrator preintegrated;
  };

  const EgoKeyframe& add_keyframe(double t, const EgoState& state);
  void coast(const EgoKeyframe& from, const EgoKeyframe& to);
  DvlFactors::Context dvl_context() const { return {*problem_, *imu_, sensors_}; }
  /// Returns the preintegrated samples from the newest keyframe to t.
  const ImuPreintegrator& sum_to(double t) const;
  /// Returns the last keyframe at or before t, or null.
  const EgoKeyframe* before(double t) const;
  /// Returns the mean turn rate and specific force in an interval of this length centred at t, without bias.
  std::optional<ImuSample> motion_about(double t, double seconds, const Vector<6>& bias) const;
  /// Makes biases_[sensor] the bias state for a measurement at t. Returns the block of a state that it adds.
  std::optional<Block> update_bias(std::size_t sensor, double t);
  template <int N>
  Block add_bias_state(const EgoSensor& sensor, double t, std::optional<EgoBias>& newest);

  Problem* problem_;
  Earth earth_;
  std::vector<EgoSensor> sensors_;
  double initial_accelerometer_bias_ = 0, initial_gyroscope_bias_ = 0;
  EgoOptions options_;
  std::optional<ImuRecord> imu_;
  std::optional<Variable<Rn<1>>> scale_;
  std::vector<std::optional<EgoBias>> biases_;  // newest bias state of each sensor
  std::vector<EgoBias> superseded_biases_;
  SensorConstants constants_;
  std::deque<EgoKeyframe> keyframes_;
  mutable std::optional<Sum> sum_;
  std::vector<std::pair<double, double>> splits_;
  std::optional<DvlFactors> dvl_;  // if DVL velocities are preintegrated
};

}  // namespace tandem

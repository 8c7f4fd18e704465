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

/// What the chaser is estimated to be at an instant.
struct EgoState {
  SE3 pose{};                              ///< body in the world
  Vector<3> velocity = Vector<3>::Zero();  ///< m/s, world
  Vector<6> bias = Vector<6>::Zero();      ///< accelerometer [m/s²], gyroscope [rad/s], along the sensor's axes
};

/// How far a first state may be from the truth: standard deviations, along world axes.
struct EgoSpread {
  Vector<3> position = Vector<3>::Constant(1e-3);  ///< m
  Vector<3> rotation = Vector<3>(0.3, 0.3, 1e-3);  ///< rad, about world axes: tilt, and heading
  Vector<3> velocity = Vector<3>::Constant(1.0);   ///< m/s
  /// Of the biases about those of the state [m/s², rad/s]; none: they are about zero, by what the IMU is said to have.
  std::optional<Vector<6>> bias{};
};

/// How the chaser's own sensors become a problem.
struct EgoOptions {
  bool dvl_scale = false;         ///< estimate the DVL's scale factor, one number for the whole run
  double dvl_scale_sigma = 0.05;  ///< what is not known of it beforehand
  /// For comparison: DVL velocities summed up between keyframes with the gyroscope's rotation (PreintegratedDvl), in place
  /// of each being a residual of its own. See DvlFactors.
  bool preintegrated_dvl = false;
  double dvl_greatest_age = 2.0;  ///< s that a velocity which is summed up holds at most
  Loss loss{};                    ///< of measurements whose sensor has none of its own
  /// Root spectral densities that tie keyframes where there is no IMU: m/s² /√Hz and rad/s /√Hz.
  double coasting_acceleration = 0.3, coasting_turn = 0.1;
};

/// Pose, velocity and, with an IMU, biases of the chaser at one keyframe.
struct EgoKeyframe {
  double t;  ///< s
  Variable<SE3> pose;
  Variable<R3> velocity;                ///< m/s, world
  std::optional<Variable<Rn<6>>> bias;  ///< [accelerometer; gyroscope] [m/s², rad/s]; none without an IMU
  Vector<6> integrated_at;              ///< bias with which the samples after it are summed up
};

/// The bias of a sensor's StayingError, of as many rows as its residual has.
struct EgoError {
  double t;  ///< s, when it was measured with
  std::variant<Variable<Rn<1>>, Variable<Rn<3>>> state;
  double last =
      t;  ///< s, when it was measured with last: changes of less than noise can tell have no state of their own
};

/// A measurement of the chaser's own sensors in the problem.
struct PlacedEgoMeasurement {
  std::size_t sensor;
  double t;                    ///< s, when it was valid
  std::optional<Block> block;  ///< none where it waits to be summed up with others
  /// Of the bias of a sensor's StayingError: what ties its state to the one before, or holds the first.
  std::optional<Block> error{};
};

/// The chaser's keyframes in a problem, tied by its inertial sensor: preintegrated between keyframes; where that has a
/// gap, or there is none, by Coasting. Other measurements join the keyframe before them, the state there carried on to
/// their instant by the inertial samples in between (Propagated); where these do not reach, a keyframe has to stand at
/// the instant itself. Used for a whole recording and for one that comes in line by line.
class EgoChain {
 public:
  /// `data`: Earth, sensors and their settings; no samples or measurements are read.
  EgoChain(Problem& problem, const NavigationData& data, const EgoOptions& options = {});

  /// To be called before the keyframes and measurements that are later. False: not later than the last.
  bool add(const ImuSample& sample);

  /// The first keyframe and what is known of it beforehand; starts at `guess`, or at `prior`.
  const EgoKeyframe& start(double t, const EgoState& prior, const EgoSpread& spread,
                           const std::optional<EgoState>& guess = {});
  /// A keyframe later than the last one; starts at `guess`, or where the last one's state leads.
  const EgoKeyframe& extend(double t, const std::optional<EgoState>& guess = {});
  /// Whether a measurement at t can join a keyframe, or needs one of its own.
  bool reaches(double t) const;
  /// Makes ready what a measurement at t needs beside the state: the bias of its sensor's StayingError. Returns whether that
  /// is new.
  bool prepare(std::size_t sensor, double t);
  /// Calls f(t, variable) for each bias that a newer one has taken the place of since the last call, t of the keyframe that
  /// it was measured from; of those that prepare() made. The newest of each sensor stays in the problem, however old.
  template <class F>
  void each_left_bias(F f) {
    for (const EgoError& bias : std::exchange(left_errors_, {}))
      std::visit([&](const auto& x) { f(bias.t, x); }, bias.state);
  }
  /// Adds a measurement at the instant t; throws Error when it is before the first keyframe or out of reach.
  PlacedEgoMeasurement attach(std::size_t sensor, const EgoMeasurement& m, double t);

  const std::deque<EgoKeyframe>& keyframes() const { return keyframes_; }
  const ImuRecord* imu() const { return imu_ ? &*imu_ : nullptr; }
  /// The DVL's scale factor, when estimated.
  const std::optional<Variable<Rn<1>>>& dvl_scale() const { return scale_; }
  /// Calls f(name, variable, standard deviations given) for each error that stays, a bias as it was measured with last.
  template <class F>
  void each_error(F f) const {
    constants_.each(f);
    for (std::size_t i = 0; i < errors_.size(); ++i)
      if (errors_[i] && !sensors_[i].error->has_constant_bias())
        std::visit([&](const auto& x) { f(sensors_[i].name + ".bias", x, sensors_[i].error->sigma); },
                   errors_[i]->state);
  }
  /// The constants of sensors, when estimated.
  const std::vector<SensorConstant>& constants() const { return constants_.all(); }
  /// At the variables' values.
  EgoState state(const EgoKeyframe& keyframe) const;
  /// Of the newest keyframe carried on to t.
  EgoState predicted(double t) const;
  /// Gaps that split the chain so far: from, to [s].
  const std::vector<std::pair<double, double>>& splits() const { return splits_; }

  /// Forgets keyframes and samples before t, whose variables have left the problem.
  void drop_before(double t);

 private:
  struct Sum {  // the samples since the newest keyframe
    double t;
    ImuPreintegrator preintegrated;
  };

  const EgoKeyframe& add_keyframe(double t, const EgoState& state);
  void coast(const EgoKeyframe& from, const EgoKeyframe& to);
  DvlFactors::Into into() const { return {*problem_, *imu_, sensors_}; }
  const ImuPreintegrator& sum_to(double t) const;
  const EgoKeyframe* before(double t) const;
  /// The mean rate and specific force about t, over so many seconds.
  std::optional<ImuSample> motion_about(double t, double seconds, const Vector<6>& bias) const;
  /// A sensor's error at t, as the newest of its variables, and what holds it, where that is new.
  std::optional<Block> error_at(std::size_t sensor, double t);
  template <int N>
  Block tie_error(const EgoSensor& sensor, double t, std::optional<EgoError>& newest);

  Problem* problem_;
  Earth earth_;
  std::vector<EgoSensor> sensors_;
  double initial_accelerometer_bias_ = 0, initial_gyroscope_bias_ = 0;
  EgoOptions options_;
  std::optional<ImuRecord> imu_;
  std::optional<Variable<Rn<1>>> scale_;
  std::vector<std::optional<EgoError>> errors_;  // of each sensor, where it has one: the newest
  std::vector<EgoError> left_errors_;
  SensorConstants constants_;
  std::deque<EgoKeyframe> keyframes_;
  mutable std::optional<Sum> sum_;
  std::vector<std::pair<double, double>> splits_;
  std::optional<DvlFactors> dvl_;  // where velocities are summed up
};

}  // namespace tandem

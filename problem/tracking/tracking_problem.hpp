#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/problem/navigation/ego_chain.hpp>
#include <tandem/problem/navigation/sensor_constants.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/problem/tracking/keyframes.hpp>
#include <tandem/problem/tracking/outliers.hpp>
#include <tandem/residuals/bounds.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem {

/// Motion model of the target.
enum class MotionModel {
  constant_twist,            ///< ConstantTwist of three poses (Baxter & Teran Espinoza 2025).
  constant_velocity,         ///< MixedVelocity::constant of three points, without orientation.
  damped_twist,              ///< DampedTwist of three poses, with one time constant per component.
  damped_velocity,           ///< MixedVelocity::damped of three points.
  white_noise_acceleration,  ///< WhiteNoiseAcceleration, a Gaussian-process prior over poses and body twists.
  steady_course,             ///< SteadyCourse: constant heading and speed over the whole run.
  none,                      ///< No motion model, for ablation studies; the problem may be rank deficient.
};

inline constexpr std::array motion_models = {MotionModel::constant_twist,
                                             MotionModel::constant_velocity,
                                             MotionModel::damped_twist,
                                             MotionModel::damped_velocity,
                                             MotionModel::white_noise_acceleration,
                                             MotionModel::steady_course,
                                             MotionModel::none};

/// Returns "constant-twist", "constant-velocity", "damped-twist", "damped-velocity", "white-noise-acceleration",
/// "steady-course" or "no-motion".
std::string_view name(MotionModel model);
/// Returns whether the residuals of the model read three states, whose distance a Horizon gives.
bool uses_triples(MotionModel model);
/// Returns whether the target is a point at every keyframe.
bool is_point_model(MotionModel model);
/// Returns whether the model supports Mode::B.
bool supports_points(MotionModel model);

/// Representation of the target. Mode A: a pose at every keyframe. Mode B: a pose where one is measured, else a point.
enum class Mode { A, B };
inline std::string_view name(Mode mode) { return mode == Mode::A ? "A" : "B"; }

/// Connection of points to neighbouring poses in Mode B.
enum class Junction {
  boundary,  ///< each pose next to a point gets a point at the same keyframe, connected by a Boundary residual
  direct,    ///< MixedVelocity reads the positions of the poses
};

/// Keyframes k − back, k and k + ahead that a residual of the motion model connects.
struct Horizon {
  int back = 1, ahead = 1;
};

/// Role of a constraint in the problem: none, a cost, or a hard constraint.
enum class Role { off, soft, hard };

/// Options of a tracking problem.
struct TrackingOptions {
  MotionModel model = MotionModel::constant_twist;
  Mode mode = Mode::A;  ///< B requires constant or damped twist
  Junction junction = Junction::boundary;
  std::vector<Horizon> horizons{{1, 1}};  ///< for models with uses_triples()
  /// Role of RollPitch on each target pose. Unlike in the paper, it also applies to the poses of Mode B.
  Role roll_pitch = Role::soft;
  Role non_holonomic = Role::off;        ///< Sway and heave are zero between consecutive target poses.
  std::optional<Bounds<1>> surge{};      ///< Limits of the mean surge [m/s].
  std::optional<double> max_yaw_rate{};  ///< Limit of the magnitude of the mean yaw rate [rad/s].
  Role limits = Role::hard;              ///< Role of the surge and yaw-rate limits.
  Loss loss{};                           ///< For target sensors without TargetSensor::loss.
  /// Loss on measured orientations, for sensors without TargetSensor::orientation_loss. If it is set, position and
  /// orientation of a pose are two residuals, and `loss` applies to the position.
  std::optional<Loss> orientation_loss{};
  /// Fraction s of the position information of a pose measurement that becomes a separate residual, with the standard
  /// deviation σ/√s. If a robust loss rejects the pose, e.g. one turned by 180°, the position still contributes. The
  /// share has no effect together with an orientation loss.
  double position_share = 0;
  /// The initial guess ignores outliers() and inconsistent orientations; the problem ignores gross outliers.
  bool robust_initial_guess = false;
  std::size_t max_keyframes = 0;  ///< use only the first keyframes; 0: all
};

/// Returns the loss on a sensor's measurements: TargetSensor::loss, or else TrackingOptions::loss.
Loss loss_of(const TargetSensor& sensor, const TrackingOptions& options);
/// Returns the loss on a sensor's measured orientations, or nullopt if they are not separate residuals.
std::optional<Loss> orientation_loss_of(const TargetSensor& sensor, const TrackingOptions& options);

/// Pose of the chaser at a keyframe; SE2 in the plane.
using PoseVariable = std::variant<Variable<SE3>, Variable<SE2>>;
/// Pose of a target on a steady course, t seconds after its first pose.
template <LieGroup G>
struct CourseVariable {
  Variable<G> first;      ///< first pose
  Variable<Rn<1>> speed;  ///< m/s
  double t;               ///< s
};
/// Target at a keyframe: a pose, a point, or a pose on a steady course.
using TargetVariable =
    std::variant<Variable<SE3>, Variable<SE2>, Variable<R3>, Variable<R2>, CourseVariable<SE3>, CourseVariable<SE2>>;
/// Body twist [m/s, rad/s]; 3 rows in the plane.
using TwistVariable = std::variant<Variable<Rn<6>>, Variable<Rn<3>>>;

/// Position and, if it is estimated, orientation of the target.
struct TargetState {
  Vector<3> position;  ///< world [m]
  std::optional<SO3> rotation;

  TargetState(const SE3& pose) : position(pose.translation()), rotation(pose.rotation()) {}
  explicit TargetState(const Vector<3>& point) : position(point) {}
};

/// A measurement in the problem.
struct PlacedMeasurement {
  std::size_t sensor, index;  ///< indices in TrackingData::sensors and TargetSensor::measurements
  std::size_t keyframe;
  std::optional<Block> block;                  ///< none for held-out measurements and gross outliers
  std::optional<Block> orientation, position;  ///< separate residuals of a pose measurement
  /// Returns the residual and its Jacobian; only for held-out measurements.
  std::function<Problem::Linearization(const Problem&)> innovation;
};

/// Range that is assumed for a target of which only bearings are measured.
///
/// If the chaser does not manoeuvre, every scale of the target's track relative to the chaser fits the bearings. The
/// cost would be least with the target in the sensor, where it explains all noise. A LogRange residual at each of the n
/// bearings holds the range near that of the initial guess, with a standard deviation of √n. Together they are a prior
/// on the scale of the track with a standard deviation of a factor e. If the chaser manoeuvres, the data outweigh it;
/// see range_is_observable() (solvers/heading_search/range_observability.hpp).
struct AssumedRange {
  Block block;                   ///< block at the first bearing
  std::size_t sensor, keyframe;  ///< sensor and keyframe of the first bearing
};

/// A soft block whose noise is an entry of TrackingNoise, except for `prior`. A block with twice as many rows as the
/// entry has n sigmas belongs to white noise on acceleration; its rows i and i + n both have sigma i.
struct NoiseBlock {
  std::string noise;  ///< "odometry", "constant_twist", …, or e.g. "camera.error" for a systematic error
  Block block;
};

/// Joint maximum-a-posteriori problem of chaser and target at keyframes, in SE(3) or, for planar data, in SE(2).
/// Source: Baxter & Teran Espinoza 2025, §V-A, eqs. 9-14. Unlike there, RollPitch also applies to the poses of Mode B.
struct TrackingProblem {
  Problem problem;
  std::vector<Keyframe> keyframes;
  std::vector<PoseVariable> chaser;    ///< one per keyframe
  std::vector<TargetVariable> target;  ///< one per keyframe
  std::vector<TwistVariable> twist;    ///< one per keyframe; only for white_noise_acceleration
  std::vector<PlacedMeasurement> measurements;
  std::optional<AssumedRange> assumed_range;  ///< if only bearings are measured
  std::vector<Outlier> outliers;              ///< if robust_initial_guess is set
  std::vector<NoiseBlock> noise_blocks;       ///< motion, odometry, constraints on the target, systematic errors
  std::vector<SensorConstant> constants;      ///< constant systematic errors of all sensors
  std::vector<std::size_t> num_discarded;     ///< per target sensor; measurements outside the odometry's span

  // Only with TrackingData::ego:
  std::vector<EgoKeyframe> ego;  ///< one per keyframe
  std::vector<PlacedEgoMeasurement> ego_measurements;
  std::vector<std::size_t> num_discarded_ego;     ///< NavigationProblem::num_discarded
  std::optional<Variable<Rn<1>>> dvl_scale;       ///< scale factor error, if EgoOptions::dvl_scale is set
  std::vector<std::pair<double, double>> splits;  ///< EgoChain::splits()

  /// Return the poses at keyframe k from the current values of the variables, in space even if the problem is planar.
  SE3 chaser_pose(std::size_t k) const;
  TargetState target_state(std::size_t k) const;
};

/// Sets options for data with outliers: Cauchy losses at two sigmas, position share 1/9, and a robust initial guess.
void make_robust(TrackingOptions& options);

/// Throws Error if a combination of options is invalid for all data.
void check(const TrackingOptions& options);

/// Builds the problem with its keyframes, residuals and initial guess. With TrackingData::ego, the chaser's own sensors
/// replace the prior and the odometry. Throws Error if options are incompatible or data are unusable, e.g. without
/// odometry, measurements or a required noise. Throws Stopped if `stop` requests it.
TrackingProblem make_tracking_problem(const TrackingData& data, const TrackingOptions& options = {},
                                      const Stop& stop = {});

}  // namespace tandem

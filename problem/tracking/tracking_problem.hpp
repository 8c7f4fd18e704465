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

/// How the target moves between keyframes.
enum class MotionModel {
  constant_twist,            ///< over three poses: ConstantTwist. Baxter & Teran Espinoza 2025
  constant_velocity,         ///< over three points, without orientation
  damped_twist,              ///< over three poses, each component forgotten in its own time: DampedTwist
  damped_velocity,           ///< over three points: MixedVelocity::damped
  white_noise_acceleration,  ///< GP prior over poses and body twists: WhiteNoiseAcceleration
  steady_course,             ///< one heading and one speed over the whole run: OnCourse
  none,                      ///< nothing ties the poses: what no measurement says of them is free. An ablation
};

inline constexpr std::array motion_models = {MotionModel::constant_twist,
                                             MotionModel::constant_velocity,
                                             MotionModel::damped_twist,
                                             MotionModel::damped_velocity,
                                             MotionModel::white_noise_acceleration,
                                             MotionModel::steady_course,
                                             MotionModel::none};

/// "constant-twist", "constant-velocity", "damped-twist", "damped-velocity", "white-noise-acceleration", "steady-course",
/// "no-motion".
std::string_view name(MotionModel model);
/// Whether it ties triples of states, which may stand apart (Horizon).
bool ties_triples(MotionModel model);
/// Whether the target is a point throughout.
bool without_orientation(MotionModel model);
/// Whether a point may stand in for a pose (Mode::B).
bool takes_points(MotionModel model);

/// Mode A: the target is a pose at every keyframe. Mode B: a pose where a pose was measured, a point elsewhere.
enum class Mode { A, B };
inline std::string_view name(Mode mode) { return mode == Mode::A ? "A" : "B"; }

/// How Mode B ties the points to the poses beside them: each pose next to a point has a point of the same instant too
/// and a Boundary residual between them; or none, and constant velocity reads the poses' positions themselves.
enum class Junction { boundary, direct };

/// A triple (k − back, k, k + ahead) of keyframes that a model of the motion ties.
struct Horizon {
  int back = 1, ahead = 1;
};

/// How something that is known of the target enters the problem: not at all, as a cost, or as a constraint.
enum class Role { off, soft, hard };

/// Which joint problem is made of a TrackingData.
struct TrackingOptions {
  MotionModel model = MotionModel::constant_twist;
  Mode mode = Mode::A;  ///< B is for constant and for damped twist
  Junction junction = Junction::boundary;
  std::vector<Horizon> horizons{{1, 1}};  ///< of models that tie triples
  /// The target is level: RollPitch on every target pose, of Mode A as of Mode B, where the paper has none.
  Role roll_pitch = Role::soft;
  Role non_holonomic = Role::off;          ///< sway = heave = 0 between consecutive target poses
  std::optional<Bounds<1>> surge{};        ///< limits of the mean surge [m/s]
  std::optional<double> max_yaw_rate{};    ///< limit of the mean yaw rate's magnitude [rad/s]
  Role limits = Role::hard;                ///< how surge and yaw rate are held
  Loss loss{};                             ///< on the relative measurements of sensors without one of their own
  std::optional<Loss> orientation_loss{};  ///< likewise on measured orientations, which are then residuals of their own
  /// Share of a pose measurement's position information that is a residual of its own: when the pose is rejected as an
  /// outlier, e.g. turned by 180°, its position is still believed, at σ/√share. Not with an orientation loss.
  double position_share = 0;
  /// The start leaves out outliers() and measured orientations that disagree with their neighbours and the direction of
  /// travel; the problem leaves out gross outliers.
  bool robust_start = false;
  std::size_t max_keyframes = 0;  ///< keep the first ones only; 0: all
};

/// The loss of a sensor's measurements: its own, else the problem's.
Loss loss_of(const TargetSensor& sensor, const TrackingOptions& options);
/// Likewise of measured orientations as residuals of their own; nothing where they are not.
std::optional<Loss> orientation_loss_of(const TargetSensor& sensor, const TrackingOptions& options);

/// The chaser's pose at a keyframe; SE2 in the plane.
using PoseVariable = std::variant<Variable<SE3>, Variable<SE2>>;
/// A target on a steady course: where it is t seconds after its first pose, at a speed that is the same all along.
template <LieGroup G>
struct CourseVariable {
  Variable<G> first;      ///< its first pose
  Variable<Rn<1>> speed;  ///< m/s
  double t;               ///< s
};
/// The target at a keyframe: a pose, a point where Mode B has no orientation, or a pose on a steady course.
using TargetVariable =
    std::variant<Variable<SE3>, Variable<SE2>, Variable<R3>, Variable<R2>, CourseVariable<SE3>, CourseVariable<SE2>>;
/// A body twist [m/s, rad/s]; 3 rows in the plane.
using TwistVariable = std::variant<Variable<Rn<6>>, Variable<Rn<3>>>;

/// Where the target is: a pose, or a point where nothing tells its orientation.
struct TargetState {
  Vector<3> position;  ///< m
  std::optional<SO3> rotation;

  TargetState(const SE3& pose) : position(pose.translation()), rotation(pose.rotation()) {}
  explicit TargetState(const Vector<3>& point) : position(point) {}
};

/// The residual of a measurement that was held out, at the problem's values, and its Jacobian by the tangents of the
/// variables that it reads, one after the other.
struct Innovation {
  Eigen::VectorXd r;  ///< in the sensor's units
  Eigen::MatrixXd jacobian;
  std::vector<int> variables, dofs;  ///< their ids and tangent dimensions
};

/// A measurement in the problem.
struct PlacedMeasurement {
  std::size_t sensor, index;  ///< in the data
  std::size_t keyframe;
  std::optional<Block> block;                            ///< none when held out, or left out as a gross outlier
  std::optional<Block> orientation, position;            ///< where these are residuals of their own
  std::function<Innovation(const Problem&)> innovation;  ///< of one that was held out
};

/// A soft block by an entry of TrackingNoise, its prior apart: of two rows of each of its sigmas, where there are as many,
/// those of one sigma stand one round of all others apart.
struct NoisedBlock {
  std::string noise;  ///< "odometry", "constant_twist", …; "camera.error" of a sensor's StayingError
  Block block;
};

/// The joint MAP problem of a chaser and its target over keyframes, in SE(3) or, for planar data, SE(2).
/// Source: Baxter & Teran Espinoza 2025, §V-A, eqs. 9-14; but RollPitch is on every target pose of Mode B too.
struct TrackingProblem {
  Problem problem;
  std::vector<Keyframe> keyframes;
  std::vector<PoseVariable> chaser;    ///< one each a keyframe
  std::vector<TargetVariable> target;  ///< likewise: a pose, a point where there is no orientation, or on a course
  std::vector<TwistVariable> twist;    ///< body twists, white_noise_acceleration only
  std::vector<PlacedMeasurement> measurements;
  std::vector<Outlier> outliers;          ///< with a robust start: those found, of which gross ones have no block
  std::vector<NoisedBlock> noised;        ///< motion, odometry and what is known of the target
  std::vector<SensorConstant> constants;  ///< of all sensors: scale, misalignment, delay, constant bias
  std::vector<std::size_t> left_out;      ///< of each sensor: measurements that its delay puts before the odometry

  // Where the chaser moves by its own sensors (TrackingData::ego):
  std::vector<EgoKeyframe> ego;  ///< one each a keyframe: its velocity and biases beside the pose
  std::vector<PlacedEgoMeasurement> ego_measurements;
  std::vector<std::size_t> ego_left_out;     ///< of each of these sensors: before the first keyframe, or out of reach
  std::optional<Variable<Rn<1>>> dvl_scale;  ///< scale factor error, where estimated
  std::vector<std::pair<double, double>> splits;  ///< where keyframes are not tied by the IMU: from, to [s]

  /// At the variables' values, in space also when planar.
  SE3 chaser_pose(std::size_t k) const;
  TargetState target_state(std::size_t k) const;
};

/// One setting for real detections: Cauchy losses at two sigmas, a share of a ninth, the robust start.
void make_robust(TrackingOptions& options);

/// Throws Error, saying which, where options exclude each other, whatever the data.
void check(const TrackingOptions& options);

/// Keyframes, residuals and the initial guess out of the data. Throws Error when the data cannot make a problem (no
/// odometry, no measurements, a measurement outside the odometry's time span, noise that is missing) or the options
/// exclude each other, and Stopped when it is to stop. With TrackingData::ego, prior and odometry give way to the
/// chaser's own sensors.
TrackingProblem make_tracking_problem(const TrackingData& data, const TrackingOptions& options = {},
                                      const Stop& stop = {});

}  // namespace tandem

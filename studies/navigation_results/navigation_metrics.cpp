#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/residuals/imu_prediction.hpp>
#include <tandem/studies/navigation_results/navigation_metrics.hpp>
#include <tandem/studies/support/mahalanobis.hpp>

namespace tandem {
namespace {

constexpr double kUnknownHeading = 0.17;  // rad: standard deviation from which the heading counts as unobserved
constexpr double kSparseTruth = 0.2;      // s: interval of true poses from which interpolation is not accurate

bool measures(const NavigationData& data, EgoSensorType type) {
  return std::any_of(data.sensors.begin(), data.sensors.end(),
                     [&](const EgoSensor& sensor) { return sensor.type == type && !sensor.measurements.empty(); });
}

/// Returns the angle of the rotation about the vertical that brings `from` nearest to `to` [rad].
double turn_between(const SO3& from, const SO3& to) {
  const Matrix<3, 3> M = (to * from.inverse()).matrix();
  return std::atan2(M(1, 0) - M(0, 1), M(0, 0) + M(1, 1));
}

class Comparison {
 public:
  Comparison(const Navigation& navigation, const Scenario& scenario) : navigation_(navigation), scenario_(scenario) {}

  NavigationComparison run() {
    find_antenna();
    carry_to_truth();
    align();
    for (std::size_t k = 0; k < compared_.size(); ++k) add_error(k);
    if (first_) out_.distance = travelled(compared_.front().t, compared_.back().t);
    if (measures(navigation_.data, EgoSensorType::gps)) add_outages();
    return std::move(out_);
  }

 private:
  Vector<3> estimated_position(std::size_t k) const { return compared_[k].value.pose.act(out_.point); }
  std::optional<SE3> truth(double t) const {
    const auto pose = pose_at(scenario_.truth_chaser, t);
    if (!pose) return {};
    return out_.to_estimate * *pose;
  }

  void find_antenna() {
    if (scenario_.truth_orientation || scenario_.truth_chaser.empty() || !scenario_.navigation) return;
    for (const EgoSensor& sensor : scenario_.navigation->sensors) {
      if (sensor.type != EgoSensorType::gps || sensor.mount.translation().isZero(0)) continue;
      out_.point = sensor.mount.translation();
      out_.antenna = sensor.name;
      return;
    }
  }

  /// Sets the states to be compared: those at the keyframes. If the truth is sparse, IMU samples propagate each state
  /// to the next true pose, unless the next keyframe comes first. Interpolation between poses 1 s apart would miss the
  /// roll of a vehicle.
  void carry_to_truth() {
    compared_ = navigation_.states;
    const auto& track = scenario_.truth_chaser;
    if (track.size() < 2) return;
    interval_ = (track.back().t - track.front().t) / double(track.size() - 1);
    if (interval_ < kSparseTruth || !navigation_.data.imu) return;
    const ImuRecord record = record_of(*navigation_.data.imu);
    for (std::size_t k = 0; k < compared_.size(); ++k) {
      auto& [t, state] = compared_[k];
      const auto next = std::lower_bound(track.begin(), track.end(), t - kSameInstant,
                                         [](const Stamped<SE3>& pose, double time) { return pose.t < time; });
      const bool last = k + 1 == compared_.size();
      if (next == track.end() || next->t - t > (last ? interval_ : compared_[k + 1].t - t)) continue;
      if (next->t - t < kSameInstant || !record.covers(t, next->t)) continue;
      ImuPreintegrator sum = record.start(state.bias);
      record.integrate(t, next->t, sum);
      const auto predicted =
          predict(state.pose, R3(state.velocity), Rn<6>(state.bias), sum.delta(), navigation_.data.earth);
      state.pose = predicted.pose;
      state.velocity = predicted.velocity.vector();
      t = next->t;
    }
  }

  bool heading_is_arbitrary() const {
    const NavigationData& data = navigation_.data;
    if (measures(data, EgoSensorType::gps) || measures(data, EgoSensorType::heading)) return false;
    if (data.earth.rate.isZero(0)) return true;
    if (navigation_.covariance.empty()) return false;
    const Matrix<3, 3> R = compared_[*first_].value.pose.rotation().matrix();
    const Matrix<3, 3> S = navigation_.covariance[*first_].pose.bottomRightCorner<3, 3>();
    return std::sqrt((R * S * R.transpose())(2, 2)) > kUnknownHeading;
  }

  /// Returns the angle of the rotation about the vertical, through the first position, that best aligns the true track
  /// with the estimated one [rad].
  double turn_of_track(const Vector<3>& true_start) const {
    double sine = 0, cosine = 0;
    const Vector<3> start = estimated_position(*first_);
    for (std::size_t k = *first_; k < compared_.size(); ++k) {
      const auto pose = pose_at(scenario_.truth_chaser, compared_[k].t);
      if (!pose) continue;
      const Vector<3> a = pose->translation() - true_start, b = estimated_position(k) - start;
      sine += a.x() * b.y() - a.y() * b.x();
      cosine += a.x() * b.x() + a.y() * b.y();
    }
    return std::atan2(sine, cosine);
  }

  void align() {
    for (std::size_t k = 0; k < compared_.size() && !first_; ++k)
      if (pose_at(scenario_.truth_chaser, compared_[k].t)) first_ = k;
    if (!first_ || measures(navigation_.data, EgoSensorType::gps)) return;
    const auto& [t, state] = compared_[*first_];
    const SE3 there = *pose_at(scenario_.truth_chaser, t);
    SO3 turn;
    out_.alignment = "No sensor observes the position in the world";
    if (heading_is_arbitrary()) {
      turn = SO3::Exp({0, 0,
                       scenario_.truth_orientation ? turn_between(there.rotation(), state.pose.rotation())
                                                   : turn_of_track(there.translation())});
      out_.alignment +=
          fmt::format(" or the heading; {} aligned with the truth",
                      scenario_.truth_orientation ? "the first position and heading were"
                                                  : "the first position and the direction of the track were");
    } else {
      out_.alignment += "; the first position was aligned with the truth";
    }
    out_.alignment += ".";
    Vector<3> offset = estimated_position(*first_) - turn.act(there.translation());
    if (measures(navigation_.data, EgoSensorType::depth)) offset.z() = 0;
    out_.to_estimate = SE3(turn, offset);
  }

  /// Returns the central difference of true positions; nothing if the truth is that of an antenna, whose velocity
  /// differs from that of the body's origin.
  std::optional<Vector<3>> true_velocity(double t) const {
    if (!out_.antenna.empty()) return {};
    const double reach = interval_ < kSparseTruth ? 2 * interval_ : interval_;
    const auto a = truth(t - reach), b = truth(t + reach);
    if (!a || !b || !(reach > 0)) return {};
    return Vector<3>((b->translation() - a->translation()) / (2 * reach));
  }

  void add_error(std::size_t k) {
    const auto& [t, state] = compared_[k];
    NavigationError& error = out_.errors.emplace_back(NavigationError{t});
    if (const auto true_pose = truth(t)) {
      error.position = estimated_position(k) - true_pose->translation();
      if (scenario_.truth_orientation)
        error.orientation = (true_pose->rotation().inverse() * state.pose.rotation()).Log();
      if (const auto velocity = true_velocity(t)) error.velocity = state.velocity - *velocity;
    }
    if (navigation_.covariance.empty()) return;
    // Rotates the covariance from the body axes at the keyframe to those at the time of the comparison.
    const Matrix<3, 3> turn = (state.pose.rotation().inverse() * navigation_.states[k].value.pose.rotation()).matrix();
    Matrix<6, 6> axes = Matrix<6, 6>::Zero();
    axes.topLeftCorner<3, 3>() = turn;
    axes.bottomRightCorner<3, 3>() = turn;
    const Matrix<6, 6> pose = axes * navigation_.covariance[k].pose * axes.transpose();
    const auto J = state.pose.act_jacobian(out_.point);
    const Matrix<3, 3> S = J * pose * J.transpose();
    error.position_sigma = S.diagonal().cwiseSqrt();
    error.orientation_sigma = pose.diagonal().tail<3>().cwiseSqrt();
    error.velocity_sigma = navigation_.covariance[k].velocity.diagonal().cwiseSqrt();
    if (!error.position) return;
    error.position_nees = normalized_squared_error(*error.position, S);
    if (!error.orientation) return;
    const Vector<6> e = (state.pose.inverse() * *truth(t)).Log();
    error.pose_nees = normalized_squared_error(e, pose);
  }

  /// Returns the length of the true track, sampled at the keyframes [m].
  double travelled(double from, double to) const {
    double sum = 0;
    std::optional<Vector<3>> last;
    for (const auto& [t, state] : compared_) {
      if (t < from - kSameInstant || t > to + kSameInstant) continue;
      const auto pose = truth(t);
      if (!pose) continue;
      if (last) sum += (pose->translation() - *last).norm();
      last = pose->translation();
    }
    return sum;
  }

  void add_outages() {
    std::vector<double> fixes = {navigation_.states.front().t};
    for (const PlacedEgoMeasurement& m : navigation_.placed)
      if (navigation_.data.sensors[m.sensor].type == EgoSensorType::gps) fixes.push_back(m.t);
    fixes.push_back(navigation_.states.back().t);
    std::sort(fixes.begin(), fixes.end());
    for (std::size_t i = 1; i < fixes.size(); ++i) {
      if (fixes[i] - fixes[i - 1] <= kMinGpsOutage) continue;
      GpsOutage& outage = out_.outages.emplace_back(GpsOutage{fixes[i - 1], fixes[i]});
      for (const NavigationError& error : out_.errors) {
        if (!error.position || error.t < outage.from || error.t > outage.to) continue;
        outage.drift = horizontal(*error.position);
        outage.largest = std::max(outage.largest.value_or(0), *outage.drift);
      }
      if (outage.drift) outage.distance = travelled(outage.from, outage.to);
    }
  }

  const Navigation& navigation_;
  const Scenario& scenario_;
  std::vector<Stamped<EgoState>> compared_;  // one per keyframe
  double interval_ = 0;                      // mean interval between true poses [s]
  std::optional<std::size_t> first_;         // first keyframe that the truth covers
  NavigationComparison out_;
};

/// Running statistics of values ≥ 0.
class Accumulator {
 public:
  void add(double value) {
    ++n_;
    sum_ += value;
    squares_ += value * value;
    max_ = std::max(max_, value);
  }
  std::optional<Statistics> statistics() const {
    if (n_ == 0) return {};
    return Statistics{n_, sum_ / n_, std::sqrt(squares_ / n_), max_};
  }
  std::optional<double> mean() const {
    if (n_ == 0) return {};
    return sum_ / n_;
  }

 private:
  int n_ = 0;
  double sum_ = 0, squares_ = 0, max_ = 0;
};

/// Running mean of three components.
class MeanAccumulator {
 public:
  void add(const Vector<3>& value) {
    ++n_;
    sum_ += value;
  }
  std::optional<Vector<3>> mean() const {
    if (n_ == 0) return {};
    return Vector<3>(sum_ / n_);
  }

 private:
  int n_ = 0;
  Vector<3> sum_ = Vector<3>::Zero();
};

Vector<3> within_three_sigma(const Vector<3>& error, const Vector<3>& sigma) {
  return (error.array().abs() <= 3 * sigma.array()).cast<double>();
}

}  // namespace

NavigationComparison compare_with_truth(const Navigation& navigation, const Scenario& scenario) {
  return Comparison(navigation, scenario).run();
}

NavigationErrorSummary summarise(const std::vector<NavigationError>& errors, double after) {
  NavigationErrorSummary summary;
  Accumulator position, horizontal_position, orientation, velocity, pose_nees, position_nees;
  MeanAccumulator orientation_squares, position_within, orientation_within;
  for (const NavigationError& error : errors) {
    if (error.t < errors.front().t + after - kSameInstant) continue;
    ++summary.n;
    if (error.position) {
      ++summary.compared;
      position.add(error.position->norm());
      horizontal_position.add(horizontal(*error.position));
      if (error.position_sigma) position_within.add(within_three_sigma(*error.position, *error.position_sigma));
    }
    if (error.orientation) {
      orientation.add(error.orientation->norm());
      orientation_squares.add(error.orientation->cwiseAbs2());
      if (error.orientation_sigma)
        orientation_within.add(within_three_sigma(*error.orientation, *error.orientation_sigma));
    }
    if (error.velocity) velocity.add(error.velocity->norm());
    if (error.pose_nees) pose_nees.add(*error.pose_nees);
    if (error.position_nees) position_nees.add(*error.position_nees);
  }
  summary.position = position.statistics();
  summary.horizontal = horizontal_position.statistics();
  summary.orientation = orientation.statistics();
  summary.velocity = velocity.statistics();
  if (const auto squares = orientation_squares.mean()) summary.orientation_rms = squares->cwiseSqrt();
  summary.position_within = position_within.mean();
  summary.orientation_within = orientation_within.mean();
  summary.pose_nees = pose_nees.mean();
  summary.position_nees = position_nees.mean();
  return summary;
}

double horizontal(const Vector<3>& v) { return v.head<2>().norm(); }

}  // namespace tandem

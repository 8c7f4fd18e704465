#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>
#include <tandem/solvers/calibration/evidence.hpp>
#include <tandem/solvers/calibration/flat_range.hpp>
#include <tandem/solvers/calibration/log_factors.hpp>

namespace tandem {
namespace {

using namespace detail;

// Steps and distances refer to log factors.
constexpr double kNegligibleGain = 0.01;  // Promised gain [nats] below which a failed line search is a maximum.
constexpr double kLongestStep = 1.5;      // A factor of 4.5.
constexpr double kDifferenceStep = 0.3;   // For the curvature, in units of the initial standard error.
constexpr double kNear = 0.3;             // Within this distance of the maximum the evidence is nearly a parabola.
constexpr double kSharp = 0.25;           // Standard error below which a maximum is certainly identifiable.
constexpr double kMinImprovement = 1.0;   // Increase of the log evidence that makes another maximum worth a search.
constexpr int kMaxRestarts = 2, kMaxHalvings = 8, kMaxRounds = 5;  // Rounds update counted_rows.

class Search {
 public:
  Search(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups, const CalibrationOptions& options)
      : groups_(groups),
        options_(options),
        evidence_(problems, groups, options),
        bound_(std::log(options.max_factor)),
        prior_sigma_(prior_sigmas(groups)) {
    if (groups.empty()) throw BadInputError("calibrate: no noise group is given");
  }

  Calibration run() {
    try {
      search();
    } catch (const Stopped&) {
      finish_interrupted();
    }
    out_.problems = evidence_.problems();
    return std::move(out_);
  }

 private:
  [[noreturn]] static void throw_unusable(const std::string& noise, const Evidence::Value& value) {
    throw_without_result("calibrate: the problem cannot be solved " + noise + ": " + value.why, value.unobservable);
  }

  void search() {
    theta_ = initial();
    fixed_.assign(groups_.size(), false);
    current_ = evidence_.at(theta_);
    if (!current_.usable) throw_unusable("with the given noise", current_);
    start_ = current_.log_evidence;  // independent of counted_rows, since the log factors are 0 or the rows are given
    const bool counted = options_.counted_rows.size() > 0;
    for (int round = 0; round < kMaxRounds && ((!counted && evidence_.count_rows()) || round == 0); ++round) {
      current_ = evidence_.at(theta_);
      maximize();
    }
    // First pass with the approximate curvature: reset unidentifiable factors, then maximise over the others.
    out_.noise.resize(groups_.size());
    for (int restart = 0; options_.ranges && !interrupted(); ++restart) {
      estimate_curvature();
      best_seen_ = {current_.log_evidence, theta_};
      const bool fixed = fix_unidentifiable(false);
      const bool higher =
          !fixed && best_seen_.first > current_.log_evidence + kMinImprovement && restart < kMaxRestarts;
      if (!fixed && !higher) break;
      if (higher) theta_ = best_seen_.second;
      current_ = evidence_.at(theta_);
      accept();
      maximize();
      if (fixed) break;
    }
    // Final pass with the curvature from differences.
    for (int restart = 0; options_.ranges && !interrupted(); ++restart) {
      find_curvature();
      while (!interrupted() && fix_unidentifiable(true)) {
        current_ = evidence_.at(theta_);
        maximize();
        if (!interrupted()) find_curvature();
      }
      if (restart == kMaxRestarts || !retry_from_given()) break;
    }
    out_.log_evidence = current_.log_evidence;
    out_.counted_rows = evidence_.counted();
    if (!options_.ranges && options_.initial_log_factors.size() > 0) {  // one of many calls: skip the report
      out_.gain = current_.log_evidence - start_;
      out_.solves = evidence_.solves();
      return fill_report(current_.effective_rows);
    }
    out_.gain = current_.log_evidence - evidence_.at(Eigen::VectorXd::Zero(theta_.size())).log_evidence;
    report();
  }
  /// Resets one factor at a time to the given value. If the evidence is then clearly higher, the estimate was a local
  /// maximum: maximises again from there and returns true.
  bool retry_from_given() {
    best_seen_ = {current_.log_evidence, theta_};
    for (const Eigen::Index g : free())
      if (!interrupted() && std::abs(theta_[g]) > kNear) given_value_[g] = profile_at(g, 0.0).value;
    if (!(best_seen_.first > current_.log_evidence + kMinImprovement)) return false;
    given_value_.clear();
    theta_ = best_seen_.second;
    current_ = evidence_.at(theta_);
    accept();
    maximize();
    return true;
  }
  Eigen::VectorXd initial() const {
    return options_.initial_log_factors.size() > 0
               ? options_.initial_log_factors
               : Eigen::VectorXd(Eigen::VectorXd::Zero(Eigen::Index(groups_.size())));
  }
  /// After a stop: reports the factors that were accepted last.
  void finish_interrupted() {
    theta_ = accepted_.size() > 0 ? accepted_ : initial();
    evidence_.set_noise(theta_);
    finish(options_.stop.interrupted() ? Status::interrupted : Status::time_limit, "stopped: the best factors so far");
    out_.gain = accepted_.size() > 0 ? accepted_value_.log_evidence - start_ : 0;
    out_.log_covariance = Eigen::MatrixXd::Zero(theta_.size(), theta_.size());
    out_.noise.assign(groups_.size(), {});
    fill_report(accepted_.size() > 0 ? accepted_value_.effective_rows : evidence_.rows());
    out_.solves = evidence_.solves();
  }
  void fill_report(const Eigen::VectorXd& effective_rows) {
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const auto at = Eigen::Index(g);
      CalibratedNoise& noise = out_.noise[g];
      noise.name = groups_[g].name;
      noise.factor = std::exp(theta_[at]);
      noise.at_limit = is_at_limit(at);
      noise.rows = evidence_.rows()[at];
      noise.effective_rows = effective_rows[at];
    }
  }
  void accept() {
    accepted_ = theta_;
    accepted_value_ = current_;
  }
  bool is_at_limit(Eigen::Index g) const { return std::abs(theta_[g]) >= bound_ * (1 - 1e-9); }
  bool interrupted() const { return options_.stop.reached(); }
  std::vector<Eigen::Index> free() const { return indices_of(fixed_, false); }
  LogPrior prior(Eigen::Index g) const { return {prior_sigma_[g]}; }

  /// Maximises the evidence over the free factors. Takes scoring steps (average information) until they are short, then
  /// BFGS steps. Without the average information, BFGS starts from a curvature of 2 per effective row.
  void maximize() {
    const auto free = this->free();
    const Eigen::Index n = Eigen::Index(free.size());
    Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index i = 0; i < n; ++i) inverse(i, i) = rough_variance(free[std::size_t(i)]);
    bool far = true;
    out_.status = Status::max_iterations;
    out_.message = "max_iterations was reached";
    if (n == 0) return finish(Status::converged, "no factor is free");
    for (int k = 0; k < options_.max_iterations; ++k) {
      options_.stop.check("calibrate");
      const Eigen::VectorXd gradient = current_.gradient(free);
      const std::optional<Eigen::VectorXd> scored = far ? scoring_step(free, gradient, inverse) : std::nullopt;
      Eigen::VectorXd step = scored ? *scored : Eigen::VectorXd(inverse * gradient);
      far = scored && scored->cwiseAbs().maxCoeff() > kNear;
      const double longest = step.cwiseAbs().maxCoeff();
      if (longest > kLongestStep) step *= kLongestStep / longest;
      ++out_.iterations;
      Eigen::VectorXd taken;
      const std::optional<Evidence::Value> next = line_search(free, step, gradient, taken);
      if (!next) {
        evidence_.at(theta_);
        if (!last_.why.empty() && out_.noise.empty())  // even the shortest step failed: there is no maximum here
          throw_unusable("with noise near the current estimate", last_);
        // The gradient neglects the change of Jacobians, so it may promise a little more than there is.
        if (0.5 * gradient.dot(step) < kNegligibleGain)
          return finish(Status::converged, "the evidence is at its maximum");
        return finish(Status::failed, "no step along the gradient increases the evidence");
      }
      const Eigen::VectorXd change = gradient - next->gradient(free);
      current_ = *next;
      accept();
      update_inverse(inverse, taken, change, 1e-12);
      if (options_.progress) options_.progress(out_.iterations, theta_.array().exp(), current_.log_evidence - start_);
      if (taken.cwiseAbs().maxCoeff() <= options_.tolerance)
        return finish(Status::converged, "the step is below the tolerance");
    }
  }
  /// Returns a Newton step with the average information, scaled per group. For a single group, the step sets the sum of
  /// squares to its expectation (½ log of their ratio). Near the maximum this is Newton's step; far from it, it reaches
  /// the maximum at once, as an EM step does. Sets `inverse` to the inverse of the information including the priors.
  std::optional<Eigen::VectorXd> scoring_step(const std::vector<Eigen::Index>& free, const Eigen::VectorXd& gradient,
                                              Eigen::MatrixXd& inverse) {
    const std::optional<Eigen::MatrixXd> information = evidence_.information();
    if (!information) return {};
    const Eigen::Index n = Eigen::Index(free.size());
    Eigen::VectorXd target(n), scale(n), prior_information(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index g = free[std::size_t(i)];
      const double rows = current_.effective_rows[g];
      prior_information[i] = prior(g).information();
      const double data_gradient = gradient[i] + prior_information[i] * theta_[g];
      const double ratio = rows > 0.5 ? 1 + data_gradient / rows : 1.0;
      const bool known = ratio > 0 && ratio != 1;
      target[i] = (known ? rows * std::log(ratio) : data_gradient) - prior_information[i] * theta_[g];
      scale[i] = known ? std::sqrt(ratio) : 1.0;
    }
    Eigen::MatrixXd curvature =
        scale.cwiseInverse().asDiagonal() * (*information)(free, free) * scale.cwiseInverse().asDiagonal();
    curvature.diagonal() += prior_information;
    curvature.diagonal() = curvature.diagonal().cwiseMax(1.0);  // bounds the step of a barely identifiable factor
    const Eigen::LLT<Eigen::MatrixXd> factor(curvature);
    if (factor.info() != Eigen::Success) return {};
    const Eigen::VectorXd step = factor.solve(target);
    if (!(step.dot(gradient) > 0)) return {};
    inverse = factor.solve(Eigen::MatrixXd::Identity(n, n));
    return step;
  }
  /// A rough variance of a log factor: the inverse of 2 per effective row, plus the information of the prior.
  double rough_variance(Eigen::Index g) const {
    return 1 / (2 * std::max(current_.effective_rows[g], 0.5) + prior(g).information());
  }

  std::optional<Evidence::Value> line_search(const std::vector<Eigen::Index>& free, const Eigen::VectorXd& step,
                                             const Eigen::VectorXd& gradient, Eigen::VectorXd& taken) {
    const Eigen::VectorXd from = theta_;
    double share = 1;
    for (int h = 0; h <= kMaxHalvings; ++h, share /= 2) {
      theta_ = from;
      taken = share * step;
      for (std::size_t i = 0; i < free.size(); ++i) {
        double& x = theta_[free[i]];
        x = std::clamp(x + taken[Eigen::Index(i)], -bound_, bound_);
        taken[Eigen::Index(i)] = x - from[free[i]];
      }
      last_ = evidence_.at(theta_);
      const Evidence::Value& next = last_;
      // The gradient is approximate, so steps below the tolerance need no sufficient increase.
      const double slack = 1e-9 * (1 + std::abs(current_.log_evidence));
      const double needed = taken.cwiseAbs().maxCoeff() <= options_.tolerance ? 0.0 : 1e-4 * gradient.dot(taken);
      if (next.usable && next.log_evidence >= current_.log_evidence + needed - slack) return next;
    }
    theta_ = from;
    return {};
  }

  void finish(Status status, const char* message) {
    out_.status = status;
    out_.message = message;
  }

  /// The log evidence without the prior of factor g.
  double without_prior(Eigen::Index g, const Evidence::Value& value, double log_factor) const {
    return value.log_evidence - prior(g).value(log_factor);
  }
  /// The profile evidence of factor g and its slope, both without the prior.
  ProfilePoint profile_point(Eigen::Index g, const Evidence::Value& value, double log_factor) const {
    return {without_prior(g, value, log_factor), value.gradient[g] - prior(g).slope(log_factor)};
  }
  /// Evaluates the profile evidence at another value of factor g; the other factors stay.
  ProfilePoint profile_at(Eigen::Index g, double log_factor) {
    Eigen::VectorXd theta = theta_;
    theta[g] = log_factor;
    const Evidence::Value value = evidence_.at(theta);
    if (value.usable && value.log_evidence > best_seen_.first) best_seen_ = {value.log_evidence, theta};
    return value.usable ? profile_point(g, value, log_factor) : ProfilePoint{-HUGE_VAL, 0};
  }
  /// The curvature of the profile evidence of factor g, without the prior.
  double data_curvature(Eigen::Index g) const { return curvature_(g, g) - prior(g).information(); }
  /// Whether the maximum is so sharp, and so little shifted by the prior, that a parabola describes the profile
  /// evidence.
  bool is_sharp(Eigen::Index g) const {
    const double c = data_curvature(g), pulled = c > 0 ? std::abs(prior(g).slope(theta_[g])) / c : 0.0;
    return c > 1 / (kSharp * kSharp) && pulled < kSharp && std::abs(theta_[g]) < bound_ * (1 - 1e-9);
  }
  FlatRange parabola(Eigen::Index g) const {
    const double reach = std::sqrt(2 * kEvidenceDrop / data_curvature(g));
    return {theta_[g] - reach, theta_[g] + reach, true, true};
  }
  FlatRange flat_range(Eigen::Index g) {
    const double c = data_curvature(g);
    const double reach = c > 1 / (kMaxHalfWidth * kMaxHalfWidth) ? 1.2 * std::sqrt(2 * kEvidenceDrop / c)
                                                                 : 2 * std::sqrt(rough_variance(g));
    return detail::flat_range(theta_[g], profile_point(g, current_, theta_[g]), reach, bound_,
                              [&](double log_factor) { return profile_at(g, log_factor); });
  }
  /// Resets the free factors that are not identifiable to the given value and fixes them. Returns whether there were
  /// any. With `final_check`, the factors are at their estimates, and a sufficient data curvature skips the test.
  bool fix_unidentifiable(bool final_check) {
    bool any = false;
    for (const Eigen::Index g : free()) {
      if (interrupted()) break;
      if (final_check && is_identifiable(data_curvature(g), prior(g).sigma)) continue;
      CalibratedNoise& noise = out_.noise[std::size_t(g)];
      (!final_check && is_sharp(g) ? parabola(g) : flat_range(g)).assign_to(noise, theta_[g]);
      if (noise.identifiable || noise.bounded) continue;
      fixed_[std::size_t(g)] = any = true;
      theta_[g] = 0;
      current_ = evidence_.at(theta_);  // the next factors are tested with this one reset
      if (!current_.usable) {           // no solution with the other estimates: reset all
        theta_.setZero();
        current_ = evidence_.at(theta_);
      }
      if (!current_.usable) throw_unusable("with the given noise", current_);
      accept();
    }
    return any;
  }

  void report() {
    const auto free = this->free();
    out_.log_covariance = Eigen::MatrixXd::Zero(theta_.size(), theta_.size());
    if (curvature_.size() > 0 && !free.empty())
      out_.log_covariance(free, free) = regularized_covariance(prior_sigma_(free), bound_, curvature_(free, free));
    fill_report(current_.effective_rows);
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const auto at = Eigen::Index(g);
      CalibratedNoise& noise = out_.noise[g];
      noise.log_error = std::sqrt(std::max(0.0, out_.log_covariance(at, at)));
      if (options_.ranges && theta_[at] != 0 && !interrupted()) noise.gain = gain_of(at);
      if (options_.ranges) add_profile(at, noise);
    }
    evidence_.at(theta_);
    out_.solves = evidence_.solves();
  }
  /// The increase of the profile evidence from the given value to the estimate; by the parabola if they are near.
  double gain_of(Eigen::Index g) {
    const double x = theta_[g];
    if (std::abs(x) > kNear) {
      const auto known = given_value_.find(g);
      return without_prior(g, current_, x) - (known != given_value_.end() ? known->second : profile_at(g, 0.0).value);
    }
    // At the maximum the slope of the data is x / prior².
    return x * x * (0.5 * data_curvature(g) + prior(g).information());
  }
  void add_profile(Eigen::Index g, CalibratedNoise& noise) {
    const double here = without_prior(g, current_, theta_[g]);
    for (const double x : profile_grid(noise, options_.profile_points, -bound_, bound_))
      if (!interrupted()) noise.profile.emplace_back(std::exp(x), profile_at(g, x).value - here);
  }
  /// Sets curvature_ to the average information of the free factors, or to differences if that is not available.
  void estimate_curvature() {
    current_ = evidence_.at(theta_);
    const std::optional<Eigen::MatrixXd> information = evidence_.information();
    if (!information) return find_curvature();
    const auto free = this->free();
    curvature_ = Eigen::MatrixXd::Identity(theta_.size(), theta_.size());
    curvature_(free, free) = (*information)(free, free);
    for (const Eigen::Index i : free) curvature_(i, i) += prior(i).information();
  }
  /// Sets curvature_ to symmetrised central differences of the gradient. One-sided where the problem can be solved on
  /// one side only; the previous curvature where it can be solved on neither.
  void find_curvature() {
    const auto free = this->free();
    const Eigen::MatrixXd estimated =
        curvature_.size() > 0 ? curvature_ : Eigen::MatrixXd::Identity(theta_.size(), theta_.size());
    curvature_ = Eigen::MatrixXd::Identity(theta_.size(), theta_.size());
    for (const Eigen::Index i : free) {
      const double step = kDifferenceStep * std::sqrt(rough_variance(i));
      Eigen::VectorXd theta = theta_;
      theta[i] += step;
      const Evidence::Value above = evidence_.at(theta);
      theta[i] -= 2 * step;
      const Evidence::Value below = evidence_.at(theta);
      const Eigen::VectorXd& high = above.usable ? above.gradient : current_.gradient;
      const Eigen::VectorXd& low = below.usable ? below.gradient : current_.gradient;
      const double apart = (int(above.usable) + int(below.usable)) * step;
      for (const Eigen::Index j : free) curvature_(j, i) = apart > 0 ? (low[j] - high[j]) / apart : estimated(j, i);
    }
    curvature_ = (0.5 * (curvature_ + curvature_.transpose())).eval();
  }

  const std::vector<NoiseGroup>& groups_;
  const CalibrationOptions& options_;
  Evidence evidence_;
  double bound_, start_ = 0;
  Eigen::VectorXd prior_sigma_;
  Eigen::VectorXd theta_, accepted_;  // log factors: current, and last accepted (reported after a stop)
  Evidence::Value accepted_value_;
  std::vector<bool> fixed_;
  Evidence::Value current_;
  Eigen::MatrixXd curvature_;                                   // −∂² log p by the log factors
  std::map<Eigen::Index, double> given_value_;                  // profile evidence with one factor as given
  Evidence::Value last_;                                        // evidence at the last trial point
  std::pair<double, Eigen::VectorXd> best_seen_{HUGE_VAL, {}};  // the best point of profile_at()
  Calibration out_;
};

}  // namespace

Calibration calibrate(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                      const CalibrationOptions& options) {
  return Search(problems, groups, options).run();
}

}  // namespace tandem

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

namespace tandem {
namespace {

using detail::Along;
using detail::Evidence;
using detail::FlatRange;
using detail::kFall;
using detail::kWidest;

constexpr double kLongestStep = 1.5;  // of a logarithm: a factor of 4.5 at once
constexpr double kDifference = 0.3;   // of a standard error, for the curvature
constexpr double kNear = 0.3;         // of a logarithm, where the evidence is a parabola
constexpr double kSharp = 0.25;       // of a logarithm
constexpr double kHigher = 1.0;       // of the log evidence, by which another maximum is worth a climb
constexpr int kRestarts = 2, kShorter = 8;
constexpr int kRounds = 5;  // of counting rows anew under robust losses

class Search {
 public:
  Search(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups, const CalibrationOptions& options)
      : groups_(groups), options_(options), evidence_(problems, groups, options), bound_(std::log(options.most)) {
    if (groups.empty()) throw Error("calibrate: there is no noise group");
    for (const Eigen::VectorXd* of_groups : {&options.start, &options.counted_rows})
      if (of_groups->size() > 0 && of_groups->size() != Eigen::Index(groups.size()))
        throw Error("calibrate: `start` and `counted_rows` have one entry a group");
    if (options.start.size() > 0 && options.counted_rows.size() == 0)
      throw Error("calibrate: `start` needs `counted_rows`");
    if (!(options.most > 1)) throw Error("calibrate: `most` must be above 1");
    if (!(options.tolerance > 0)) throw Error("calibrate: the tolerance must be positive");
  }

  Calibration run() {
    try {
      search();
    } catch (const Stopped&) {
      leave();
    }
    return std::move(out_);
  }

 private:
  void search() {
    theta_ = first();
    held_.assign(groups_.size(), false);
    now_ = evidence_.at(theta_);
    if (!now_.usable) throw Error("calibrate: the problem cannot be solved as it is given: " + now_.why);
    start_ = now_.log_evidence;  // how rows count is no part of it where all factors are 1, or it stays
    const bool counted = options_.counted_rows.size() > 0;
    for (int round = 0; round < kRounds && ((!counted && evidence_.count_rows()) || round == 0); ++round) {
      now_ = evidence_.at(theta_);
      climb();
    }
    // What the data do not tell keeps what was given, and the others are found again beside it.
    out_.noise.resize(groups_.size());
    for (int restart = 0; options_.ranges && !interrupted(); ++restart) {
      estimate_curvature();
      best_seen_ = {now_.log_evidence, theta_};
      const bool held = hold_undetermined(false);
      const bool higher = !held && best_seen_.first > now_.log_evidence + kHigher && restart < kRestarts;
      if (!held && !higher) break;
      if (higher) theta_ = best_seen_.second;
      now_ = evidence_.at(theta_);
      take();
      climb();
      if (held) break;
    }
    for (int restart = 0; options_.ranges && !interrupted(); ++restart) {
      find_curvature();
      while (!interrupted() && hold_undetermined(true)) {
        now_ = evidence_.at(theta_);
        climb();
        if (!interrupted()) find_curvature();
      }
      if (restart == kRestarts || !climb_from_given()) break;
    }
    out_.log_evidence = now_.log_evidence;
    out_.counted_rows = evidence_.counted();
    if (!options_.ranges && options_.start.size() > 0) {  // one of many: as short as can be
      out_.gain = now_.log_evidence - start_;
      out_.solves = evidence_.solves();
      return tell(now_.effective_rows);
    }
    out_.gain = now_.log_evidence - evidence_.at(Eigen::VectorXd::Zero(theta_.size())).log_evidence;
    report();
  }
  /// Where the evidence is higher with one factor as given, the others as found: this was another maximum.
  bool climb_from_given() {
    best_seen_ = {now_.log_evidence, theta_};
    for (const Eigen::Index g : free())
      if (!interrupted() && std::abs(theta_[g]) > kNear) as_given_[g] = elsewhere(g, 0.0).value;
    if (!(best_seen_.first > now_.log_evidence + kHigher)) return false;
    as_given_.clear();
    theta_ = best_seen_.second;
    now_ = evidence_.at(theta_);
    take();
    climb();
    return true;
  }
  Eigen::VectorXd first() const {
    return options_.start.size() > 0 ? options_.start
                                     : Eigen::VectorXd(Eigen::VectorXd::Zero(Eigen::Index(groups_.size())));
  }
  /// Stopped: at the factors that were taken last.
  void leave() {
    theta_ = taken_.size() > 0 ? taken_ : first();
    evidence_.set_noise(theta_);
    finish(options_.stop.interrupted() ? Status::interrupted : Status::time_limit, "stopped: the best factors so far");
    out_.gain = taken_.size() > 0 ? taken_value_.log_evidence - start_ : 0;
    out_.log_covariance = Eigen::MatrixXd::Zero(theta_.size(), theta_.size());
    out_.noise.assign(groups_.size(), {});
    tell(taken_.size() > 0 ? taken_value_.effective_rows : evidence_.rows());
    out_.solves = evidence_.solves();
  }
  /// The factors, and how much there is behind each.
  void tell(const Eigen::VectorXd& effective_rows) {
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const auto at = Eigen::Index(g);
      CalibratedNoise& noise = out_.noise[g];
      noise.name = groups_[g].name;
      noise.factor = std::exp(theta_[at]);
      noise.at_bound = is_at_bound(at);
      noise.rows = evidence_.rows()[at];
      noise.effective_rows = effective_rows[at];
    }
  }
  void take() {
    taken_ = theta_;
    taken_value_ = now_;
  }
  bool is_at_bound(Eigen::Index g) const { return std::abs(theta_[g]) >= bound_ * (1 - 1e-9); }
  bool interrupted() const { return options_.stop.reached(); }
  std::vector<Eigen::Index> free() const {
    std::vector<Eigen::Index> result;
    for (std::size_t g = 0; g < held_.size(); ++g)
      if (!held_[g]) result.push_back(Eigen::Index(g));
    return result;
  }

  /// BFGS on −log p: from the average information where that is known, after steps by it until they are short; else from
  /// the curvature that effective rows have, 2 each.
  void climb() {
    const auto free = this->free();
    const Eigen::Index n = Eigen::Index(free.size());
    Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index i = 0; i < n; ++i) inverse(i, i) = first_scale(free[std::size_t(i)]);
    bool far = true;
    out_.status = Status::max_iterations;
    out_.message = "the limit of iterations was reached";
    if (n == 0) return finish(Status::converged, "no factor is free");
    for (int k = 0; k < options_.max_iterations; ++k) {
      options_.stop.check("calibrate");
      Eigen::VectorXd gradient(n);
      for (Eigen::Index i = 0; i < n; ++i) gradient[i] = now_.gradient[free[std::size_t(i)]];
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
        if (!unusable_.empty() && out_.noise.empty())  // however near: there is no maximum to be found
          throw Error("calibrate: the problem cannot be solved by noise near that: " + unusable_);
        return finish(Status::converged, "no step along the gradient raises the evidence");
      }
      Eigen::VectorXd change(n);
      for (Eigen::Index i = 0; i < n; ++i) change[i] = gradient[i] - next->gradient[free[std::size_t(i)]];
      now_ = *next;
      take();
      const double along = taken.dot(change);
      if (along > 1e-12 * taken.norm() * change.norm()) {
        const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(n, n) - taken * change.transpose() / along;
        inverse = A * inverse * A.transpose() + taken * taken.transpose() / along;
      }
      if (options_.progress) options_.progress(out_.iterations, theta_.array().exp(), now_.log_evidence - start_);
      if (taken.cwiseAbs().maxCoeff() <= options_.tolerance)
        return finish(Status::converged, "the factors change no more");
    }
  }
  /// Of a group alone, the step that makes its squares what they should be: ½ log of their ratio. That is Newton's step
  /// near the maximum, and far from it one that gets there at once, as EM's does.
  /// `inverse` becomes that of the information with the priors'.
  std::optional<Eigen::VectorXd> scoring_step(const std::vector<Eigen::Index>& free, const Eigen::VectorXd& gradient,
                                              Eigen::MatrixXd& inverse) {
    const std::optional<Eigen::MatrixXd> information = evidence_.information();
    if (!information) return {};
    const Eigen::Index n = Eigen::Index(free.size());
    Eigen::VectorXd target(n), scale(n), beliefs(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index g = free[std::size_t(i)];
      const double prior = groups_[std::size_t(g)].prior, rows = now_.effective_rows[g];
      beliefs[i] = prior > 0 ? 1 / (prior * prior) : 0.0;
      const double of_data = gradient[i] + beliefs[i] * theta_[g];
      const double ratio = rows > 0.5 ? 1 + of_data / rows : 1.0;
      const bool known = ratio > 0 && ratio != 1;
      target[i] = (known ? rows * std::log(ratio) : of_data) - beliefs[i] * theta_[g];
      scale[i] = known ? std::sqrt(ratio) : 1.0;
    }
    Eigen::MatrixXd curvature =
        scale.cwiseInverse().asDiagonal() * (*information)(free, free) * scale.cwiseInverse().asDiagonal();
    curvature.diagonal() += beliefs;
    curvature.diagonal() = curvature.diagonal().cwiseMax(1.0);  // of a factor that the data hardly tell
    const Eigen::LLT<Eigen::MatrixXd> factor(curvature);
    if (factor.info() != Eigen::Success) return {};
    const Eigen::VectorXd step = factor.solve(target);
    if (!(step.dot(gradient) > 0)) return {};
    inverse = factor.solve(Eigen::MatrixXd::Identity(n, n));
    return step;
  }
  double first_scale(Eigen::Index g) const {
    const double prior = groups_[std::size_t(g)].prior;
    return 1 / (2 * std::max(now_.effective_rows[g], 0.5) + (prior > 0 ? 1 / (prior * prior) : 0.0));
  }

  std::optional<Evidence::Value> line_search(const std::vector<Eigen::Index>& free, const Eigen::VectorXd& step,
                                             const Eigen::VectorXd& gradient, Eigen::VectorXd& taken) {
    const Eigen::VectorXd from = theta_;
    double share = 1;
    for (int h = 0; h <= kShorter; ++h, share /= 2) {
      theta_ = from;
      taken = share * step;
      for (std::size_t i = 0; i < free.size(); ++i) {
        double& x = theta_[free[i]];
        x = std::clamp(x + taken[Eigen::Index(i)], -bound_, bound_);
        taken[Eigen::Index(i)] = x - from[free[i]];
      }
      const Evidence::Value next = evidence_.at(theta_);
      unusable_ = next.why;
      // But under Student's t the gradient leaves out how H changes with the point: a step short enough to be lost in that is taken.
      const double slack = 1e-9 * (1 + std::abs(now_.log_evidence));
      if (next.usable && next.log_evidence >= now_.log_evidence + 1e-4 * gradient.dot(taken) - slack) return next;
      if (taken.cwiseAbs().maxCoeff() <= options_.tolerance && next.usable &&
          next.log_evidence >= now_.log_evidence - slack)
        return next;
    }
    theta_ = from;
    return {};
  }

  void finish(Status status, const char* message) {
    out_.status = status;
    out_.message = message;
  }

  /// The evidence with one factor elsewhere, the others as found, without their priors' part in it.
  double without_prior(Eigen::Index g, const Evidence::Value& value, double log_factor) const {
    const double prior = groups_[std::size_t(g)].prior;
    return value.log_evidence + (prior > 0 ? 0.5 * log_factor * log_factor / (prior * prior) : 0.0);
  }
  /// The same where the factor is, and its slope there.
  Along along(Eigen::Index g, const Evidence::Value& value, double log_factor) const {
    const double prior = groups_[std::size_t(g)].prior;
    return {without_prior(g, value, log_factor), value.gradient[g] + (prior > 0 ? log_factor / (prior * prior) : 0.0)};
  }
  Along elsewhere(Eigen::Index g, double log_factor) {
    Eigen::VectorXd theta = theta_;
    theta[g] = log_factor;
    const Evidence::Value value = evidence_.at(theta);
    if (value.usable && value.log_evidence > best_seen_.first) best_seen_ = {value.log_evidence, theta};
    return value.usable ? along(g, value, log_factor) : Along{-HUGE_VAL, 0};
  }
  /// The data's own part in the curvature along one factor, the others as found.
  double data_curvature(Eigen::Index g) const {
    const double prior = groups_[std::size_t(g)].prior;
    return curvature_(g, g) - (prior > 0 ? 1 / (prior * prior) : 0.0);
  }
  /// So sharp a maximum, and so little moved by a prior, that nobody needs to follow it further.
  bool is_sharp(Eigen::Index g) const {
    const double c = data_curvature(g), prior = groups_[std::size_t(g)].prior;
    const double pulled = prior > 0 && c > 0 ? std::abs(theta_[g]) / (prior * prior * c) : 0.0;
    return c > 1 / (kSharp * kSharp) && pulled < kSharp && std::abs(theta_[g]) < bound_ * (1 - 1e-9);
  }
  FlatRange parabola(Eigen::Index g) const {
    const double reach = std::sqrt(2 * kFall / data_curvature(g));
    return {theta_[g] - reach, theta_[g] + reach, true, true};
  }
  /// Of the data alone, the other factors as found.
  FlatRange flat_range(Eigen::Index g) {
    const double c = data_curvature(g);
    const double reach = c > 1 / (kWidest * kWidest) ? 1.2 * std::sqrt(2 * kFall / c) : 2 * std::sqrt(first_scale(g));
    return detail::flat_range(theta_[g], along(g, now_, theta_[g]), reach, bound_,
                              [&](double log_factor) { return elsewhere(g, log_factor); });
  }
  /// Of those that are free; `again`: that the data do not tell where all is found, whatever it looked like on the way.
  bool hold_undetermined(bool again) {
    bool any = false;
    for (const Eigen::Index g : free()) {
      if (interrupted()) break;
      if (again && detail::is_told(data_curvature(g), groups_[std::size_t(g)].prior)) continue;
      CalibratedNoise& noise = out_.noise[std::size_t(g)];
      (!again && is_sharp(g) ? parabola(g) : flat_range(g)).tell(noise, theta_[g]);
      if (noise.determined || noise.bounded) continue;
      held_[std::size_t(g)] = any = true;
      theta_[g] = 0;
      now_ = evidence_.at(theta_);  // those that follow are told with this one as given
      if (!now_.usable) {           // there is none with the others as found: with all as given
        theta_.setZero();
        now_ = evidence_.at(theta_);
      }
      if (!now_.usable) throw Error("calibrate: the problem cannot be solved as it is given: " + now_.why);
      take();
    }
    return any;
  }

  void report() {
    const auto free = this->free();
    out_.log_covariance = Eigen::MatrixXd::Zero(theta_.size(), theta_.size());
    if (curvature_.size() > 0 && !free.empty()) out_.log_covariance(free, free) = covariance(free);
    tell(now_.effective_rows);
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
  double gain_of(Eigen::Index g) {
    const double x = theta_[g], prior = groups_[std::size_t(g)].prior;
    if (std::abs(x) > kNear) {
      const auto known = as_given_.find(g);
      return without_prior(g, now_, x) - (known != as_given_.end() ? known->second : elsewhere(g, 0.0).value);
    }
    return x * x *
           (0.5 * data_curvature(g) + (prior > 0 ? 1 / (prior * prior) : 0.0));  // the prior pulls by x / prior²
  }
  void add_profile(Eigen::Index g, CalibratedNoise& noise) {
    const double low = std::log(noise.flat_from), high = std::log(noise.flat_to);
    const double middle = 0.5 * (low + high), half = 0.8 * (high - low);
    const double here = without_prior(g, now_, theta_[g]);
    for (int i = 0; i < options_.profile && !interrupted(); ++i) {
      const double x = middle + half * (options_.profile > 1 ? 2.0 * i / (options_.profile - 1) - 1 : 0.0);
      if (std::abs(x) <= bound_) noise.profile.emplace_back(std::exp(x), elsewhere(g, x).value - here);
    }
  }
  Eigen::MatrixXd covariance(const std::vector<Eigen::Index>& free) const {
    Eigen::VectorXd before(static_cast<Eigen::Index>(free.size()));
    for (std::size_t i = 0; i < free.size(); ++i) {
      const double prior = groups_[std::size_t(free[i])].prior;
      before[Eigen::Index(i)] = prior > 0 ? prior : bound_;
    }
    return detail::covariance_within(before, curvature_(free, free));
  }
  /// −∂² log p at the factors as they are, for those that are free, about: the average information, where that is known.
  void estimate_curvature() {
    now_ = evidence_.at(theta_);
    const std::optional<Eigen::MatrixXd> information = evidence_.information();
    if (!information) return find_curvature();
    const auto free = this->free();
    curvature_ = Eigen::MatrixXd::Identity(theta_.size(), theta_.size());
    curvature_(free, free) = (*information)(free, free);
    for (const Eigen::Index i : free)
      if (const double prior = groups_[std::size_t(i)].prior; prior > 0) curvature_(i, i) += 1 / (prior * prior);
  }
  /// The same by differences of its gradient, made symmetric; what can be solved on one side alone by that one, on none as
  /// it was.
  void find_curvature() {
    const auto free = this->free();
    const Eigen::MatrixXd estimated =
        curvature_.size() > 0 ? curvature_ : Eigen::MatrixXd::Identity(theta_.size(), theta_.size());
    curvature_ = Eigen::MatrixXd::Identity(theta_.size(), theta_.size());
    for (const Eigen::Index i : free) {
      const double step = kDifference * std::sqrt(first_scale(i));
      Eigen::VectorXd theta = theta_;
      theta[i] += step;
      const Evidence::Value above = evidence_.at(theta);
      theta[i] -= 2 * step;
      const Evidence::Value below = evidence_.at(theta);
      const Eigen::VectorXd& high = above.usable ? above.gradient : now_.gradient;
      const Eigen::VectorXd& low = below.usable ? below.gradient : now_.gradient;
      const double apart = (int(above.usable) + int(below.usable)) * step;
      for (const Eigen::Index j : free) curvature_(j, i) = apart > 0 ? (low[j] - high[j]) / apart : estimated(j, i);
    }
    curvature_ = (0.5 * (curvature_ + curvature_.transpose())).eval();
  }

  const std::vector<NoiseGroup>& groups_;
  const CalibrationOptions& options_;
  Evidence evidence_;
  double bound_, start_ = 0;
  Eigen::VectorXd theta_, taken_;  // the latter are those that leave() goes by, with
  Evidence::Value taken_value_;    // what they gave
  std::vector<bool> held_;
  Evidence::Value now_;
  Eigen::MatrixXd curvature_;
  std::map<Eigen::Index, double> as_given_;  // the data's evidence with one factor as given, the others as found
  std::string unusable_;                     // why the last step could not be tried
  std::pair<double, Eigen::VectorXd> best_seen_{HUGE_VAL, {}};  // while ranges are looked for: another maximum, perhaps
  Calibration out_;
};

}  // namespace

Calibration calibrate(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                      const CalibrationOptions& options) {
  return Search(problems, groups, options).run();
}

}  // namespace tandem

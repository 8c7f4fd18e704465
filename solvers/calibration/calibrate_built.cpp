#include <algorithm>
#include <cmath>
#include <sstream>

#include <tandem/solvers/calibration/built_evidence.hpp>
#include <tandem/solvers/calibration/calibrate_built.hpp>
#include <tandem/solvers/calibration/flat_range.hpp>
#include <tandem/solvers/calibration/log_factors.hpp>

namespace tandem {
namespace {

using detail::BuiltEvidence;
using detail::LogPrior;
using detail::ProfilePoint;
using Point = BuiltEvidence::Point;

class BuiltSearch {
 public:
  BuiltSearch(const BuildProblems& build, const std::vector<BuiltParameter>& parameters,
              const CalibrationOptions& options)
      : parameters_(parameters),
        options_(options),
        prior_sigma_(detail::prior_sigmas(parameters)),
        evidence_(build, parameters, options) {
    const auto n = Eigen::Index(parameters.size());
    x_ = Eigen::VectorXd::Zero(n);
    fixed_.assign(parameters.size(), false);
    out_.parameters.resize(parameters.size());
    out_.log_covariance = Eigen::MatrixXd::Zero(n, n);
  }

  BuiltCalibration run() {
    try {
      search();
    } catch (const Stopped&) {
      out_.status = options_.stop.interrupted() ? Status::interrupted : Status::time_limit;
      out_.message = "stopped: the best parameters so far";
      finish_interrupted();
    }
    out_.values = evidence_.values(x_);
    out_.builds = evidence_.builds();
    out_.solves = evidence_.solves();
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
      const auto at = Eigen::Index(i);
      CalibratedNoise& p = out_.parameters[i];
      p.name = parameters_[i].name;
      p.factor = std::exp(x_[at]);
      p.at_limit = x_[at] != 0 && (x_[at] <= low(at) + kAtBound || x_[at] >= high(at) - kAtBound);
    }
    return std::move(out_);
  }

 private:
  // Steps and distances refer to log parameters.
  static constexpr double kAtBound = 1e-9;
  static constexpr double kLongestStep = 1.0;
  static constexpr double kMinGain = 1e-3;        // predicted increase of the log evidence at which the search ends
  static constexpr double kDifferenceStep = 0.5;  // for the curvature, in units of the standard error
  static constexpr int kMaxHalvings = 6;

  void search() {
    current_ = evidence_.first(out_.noise, start_);
    if (options_.ranges) given_value_ = current_;
    maximize();
    if (options_.ranges) {
      for (bool final_check = false; fix_unidentifiable(final_check); final_check = true) {
        const Status status = out_.status;
        const std::string message = out_.message;
        maximize();
        // The parameters were fixed after an unfinished search: keep its status.
        if (status != Status::converged) end(status, message);
      }
      given_value_ = {};
      find_curvature();
      fill_report();
    }
    finish_noise();
  }

  double low(Eigen::Index i) const { return evidence_.low()[i]; }
  double high(Eigen::Index i) const { return evidence_.high()[i]; }
  Point profile(const Eigen::VectorXd& x) { return evidence_.profile(x, current_); }
  Eigen::VectorXd with(Eigen::Index i, double value) const {
    Eigen::VectorXd x = x_;
    x[i] = value;
    return x;
  }
  std::vector<Eigen::Index> free() const { return detail::indices_of(fixed_, false); }
  LogPrior prior(Eigen::Index i) const { return {prior_sigma_[i]}; }
  Eigen::VectorXd gradient(const Eigen::VectorXd& x, const Point& point, const std::vector<Eigen::Index>& free,
                           Eigen::VectorXd* curvature = nullptr) {
    Eigen::VectorXd g(Eigen::Index(free.size()));
    if (curvature) curvature->resize(g.size());
    for (std::size_t i = 0; i < free.size(); ++i) {
      const auto [first, second] = evidence_.derivatives(x, point, free[i]);
      g[Eigen::Index(i)] = first;
      if (curvature) (*curvature)[Eigen::Index(i)] = -second;
    }
    return g;
  }

  void maximize() {
    const auto free = this->free();
    if (free.empty()) return end(Status::converged, "no parameter is free");
    Eigen::VectorXd curvature;
    Eigen::VectorXd g = gradient(x_, current_, free, &curvature);
    Eigen::MatrixXd inverse = curvature.cwiseMax(0.5).cwiseInverse().asDiagonal();
    for (int k = 0; k < options_.max_iterations; ++k) {
      Eigen::VectorXd step = inverse * g;
      for (std::size_t i = 0; i < free.size(); ++i) {  // parameters at a bound stay if the step points outwards
        const Eigen::Index at = free[i];
        if ((x_[at] <= low(at) && step[Eigen::Index(i)] < 0) || (x_[at] >= high(at) && step[Eigen::Index(i)] > 0))
          step[Eigen::Index(i)] = 0;
      }
      if (!(0.5 * g.dot(step) > kMinGain)) return end(Status::converged, "the predicted gain is below the tolerance");
      const double longest = step.cwiseAbs().maxCoeff();
      if (longest > kLongestStep) step *= kLongestStep / longest;
      const Eigen::VectorXd from = x_;
      Eigen::VectorXd taken;
      Point next;
      double share = 1;
      int h = 0;
      for (; h <= kMaxHalvings; ++h, share /= 2) {
        x_ = from;
        for (std::size_t i = 0; i < free.size(); ++i)
          x_[free[i]] = std::clamp(from[free[i]] + share * step[Eigen::Index(i)], low(free[i]), high(free[i]));
        taken = (x_ - from)(free);
        const Eigen::VectorXd to = x_;
        x_ = from;  // the value after a stop
        next = profile(to);
        if (next.usable && next.value >= current_.value + 1e-4 * g.dot(taken)) {
          x_ = to;
          break;
        }
      }
      if (h > kMaxHalvings)
        return end(Status::failed,
                   next.usable ? "no step along the gradient increases the evidence, although the gradient is not zero"
                               : "the problems cannot be built or solved beyond " + changed_parameters(free, taken) +
                                     ": " + evidence_.why());
      current_ = next;
      ++out_.iterations;
      if (options_.progress) {
        Eigen::VectorXd factors(current_.factors.size() + x_.size());
        factors << current_.factors.array().exp().matrix(), x_.array().exp().matrix();
        options_.progress(out_.iterations, factors, current_.value - start_);
      }
      const Eigen::VectorXd g_next = gradient(x_, current_, free);
      detail::update_inverse(inverse, taken, g - g_next, 1e-9);
      g = g_next;
    }
    end(Status::max_iterations, "max_iterations was reached");
  }
  void end(Status status, const std::string& message) {
    out_.status = status;
    out_.message = message;
  }
  /// Lists the parameters that `step` changes, with their values before the step.
  std::string changed_parameters(const std::vector<Eigen::Index>& free, const Eigen::VectorXd& step) const {
    const Eigen::VectorXd values = evidence_.values(x_);
    std::ostringstream text;
    text.precision(4);
    for (std::size_t i = 0; i < free.size(); ++i)
      if (step[Eigen::Index(i)] != 0)
        text << (text.tellp() > 0 ? ", " : "") << parameters_[std::size_t(free[i])].name << " = " << values[free[i]];
    return text.str();
  }

  /// The profile evidence of parameter i without its prior.
  ProfilePoint profile_point(Eigen::Index i, double x, const Point& point, double slope) const {
    return {point.value - prior(i).value(x), slope - prior(i).slope(x)};
  }
  ProfilePoint profile_at(Eigen::Index i, double x) {
    const Point point = profile(with(i, x));
    if (!point.usable) return {-HUGE_VAL, 0};
    return profile_point(i, x, point, evidence_.derivatives(with(i, x), point, i).first);
  }
  /// Resets the free parameters that are not identifiable to the given value and fixes them. Returns whether there were
  /// any. With `final_check`, the parameters are at their estimates, and a sufficient data curvature skips the test.
  bool fix_unidentifiable(bool final_check) {
    bool any = false, failed = false;
    for (const Eigen::Index i : free()) {
      CalibratedNoise& p = out_.parameters[std::size_t(i)];
      const auto [slope, second] = evidence_.derivatives(x_, current_, i);
      const double data_curvature = -second - prior(i).information();
      if (final_check && detail::is_identifiable(data_curvature, prior(i).sigma)) continue;
      detail::flat_range(x_[i], profile_point(i, x_[i], current_, slope),
                         1.2 * std::sqrt(2 * detail::kEvidenceDrop / std::max(data_curvature, 0.5)),
                         std::max(-low(i), high(i)),
                         [&](double x) { return profile_at(i, std::clamp(x, low(i), high(i))); })
          .assign_to(p, x_[i]);
      if (p.identifiable || p.bounded) continue;
      fixed_[std::size_t(i)] = any = true;
      const Point point = profile(with(i, 0));
      if (!point.usable) {
        failed = true;
        continue;
      }
      x_[i] = 0;
      current_ = point;
    }
    if (failed) {  // no problem with one reset and the others at their estimates: reset all fixed ones, or all
      Eigen::VectorXd x = x_;
      for (Eigen::Index i = 0; i < x.size(); ++i)
        if (fixed_[std::size_t(i)]) x[i] = 0;
      Point point = profile(x);
      if (!point.usable) {
        x.setZero();
        point = given_value_;
      }
      x_ = x;
      current_ = point;
    }
    return any;
  }

  /// Computes the posterior covariance from differences of the gradient, and the sensitivity of the noise factors.
  void find_curvature() {
    const auto free = this->free();
    if (free.empty()) return;
    const auto n = Eigen::Index(free.size());
    Eigen::MatrixXd curvature(n, n);
    factor_sensitivity_ = Eigen::MatrixXd::Zero(current_.factors.size(), n);
    Eigen::VectorXd rough;
    const Eigen::VectorXd here = gradient(x_, current_, free, &rough);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double step = std::clamp(kDifferenceStep / std::sqrt(std::max(rough[k], 0.5)), 0.1, 0.5);
      const auto side = [&](double by, Eigen::VectorXd& g, Eigen::VectorXd& factors) {
        const Eigen::Index i = free[std::size_t(k)];
        const Eigen::VectorXd to = with(i, std::clamp(x_[i] + by, low(i), high(i)));
        const Point point = to[i] != x_[i] ? profile(to) : Point();
        g = point.usable ? gradient(to, point, free) : here;
        factors = point.usable ? point.factors : current_.factors;
        return point.usable ? std::abs(to[i] - x_[i]) : 0.0;
      };
      Eigen::VectorXd g_high, g_low, high, low;
      const double apart = side(step, g_high, high) + side(-step, g_low, low);
      if (apart > 0) {
        curvature.col(k) = (g_low - g_high) / apart;
        factor_sensitivity_.col(k) = (high - low) / apart;
      } else {
        curvature.col(k) = rough[k] * Eigen::VectorXd::Unit(n, k);
      }
    }
    curvature = (0.5 * (curvature + curvature.transpose())).eval();
    out_.log_covariance(free, free) =
        detail::regularized_covariance(prior_sigma_(free), std::log(options_.max_factor), curvature);
  }
  /// Fills in the standard errors, gains and profiles of the parameters.
  void fill_report() {
    for (Eigen::Index i = 0; i < x_.size(); ++i) {
      CalibratedNoise& p = out_.parameters[std::size_t(i)];
      p.log_error = std::sqrt(std::max(0.0, out_.log_covariance(i, i)));
      const double here = current_.value - prior(i).value(x_[i]);
      const double given = x_[i] != 0 ? value_of_data(i, 0) : here;
      if (std::isfinite(given)) p.gain = here - given;
      for (const double x : detail::profile_grid(p, options_.profile_points, low(i), high(i)))
        if (const double value = value_of_data(i, x); std::isfinite(value))
          p.profile.emplace_back(std::exp(x), value - here);
    }
  }
  /// The profile evidence of parameter i without its prior; −∞ if there is no problem.
  double value_of_data(Eigen::Index i, double x) { return profile(with(i, x)).value - prior(i).value(x); }

  /// Calibrates the noise at the estimated parameters and adds their uncertainty to its standard errors.
  void finish_noise() {
    out_.gain = current_.value - start_;
    if (!evidence_.has_noise()) {
      out_.noise.status = Status::converged;
      out_.noise.message = "no noise group is free";
      return;
    }
    double value = 0;
    Calibration found = evidence_.noise(x_, current_, value);
    out_.gain = value - start_;
    const auto free = this->free();
    for (std::size_t g = 0; g < found.noise.size() && factor_sensitivity_.cols() > 0; ++g) {
      CalibratedNoise& noise = found.noise[g];
      if (!noise.identifiable && !noise.bounded) continue;
      const Eigen::VectorXd by = factor_sensitivity_.row(Eigen::Index(g));
      noise.log_error = std::sqrt(noise.log_error * noise.log_error + by.dot(out_.log_covariance(free, free) * by));
    }
    found.iterations += out_.noise.iterations;
    found.solves += out_.noise.solves;
    out_.noise = std::move(found);
  }
  /// After a stop: reports the last accepted point.
  void finish_interrupted() {
    for (CalibratedNoise& p : out_.parameters) p = {};
    out_.log_covariance.setZero();
    out_.gain = current_.usable ? current_.value - start_ : out_.noise.gain;
    if (!current_.usable) return;  // the result of the first calibrate()
    for (std::size_t g = 0; g < out_.noise.noise.size(); ++g) {
      CalibratedNoise& noise = out_.noise.noise[g];
      noise.factor = std::exp(current_.factors[Eigen::Index(g)]);
      noise.flat_from = noise.flat_to = 1;
      noise.identifiable = noise.bounded = false;
      noise.log_error = noise.gain = 0;
      noise.profile.clear();
    }
  }

  const std::vector<BuiltParameter>& parameters_;
  const CalibrationOptions& options_;
  const Eigen::VectorXd prior_sigma_;
  BuiltEvidence evidence_;
  std::vector<bool> fixed_;
  Eigen::VectorXd x_;
  Point current_, given_value_;
  double start_ = 0;
  Eigen::MatrixXd factor_sensitivity_;  // derivative of the log noise factors by the free log parameters
  BuiltCalibration out_;
};

}  // namespace

BuiltCalibration calibrate_built(const BuildProblems& build, const std::vector<BuiltParameter>& parameters,
                                 const CalibrationOptions& options) {
  return BuiltSearch(build, parameters, options).run();
}

}  // namespace tandem

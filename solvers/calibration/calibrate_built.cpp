#include <algorithm>
#include <cmath>
#include <sstream>

#include <tandem/solvers/calibration/built_evidence.hpp>
#include <tandem/solvers/calibration/calibrate_built.hpp>
#include <tandem/solvers/calibration/flat_range.hpp>

namespace tandem {
namespace {

using detail::Along;
using detail::BuiltEvidence;
using detail::kWidest;
using Point = BuiltEvidence::Point;

class BuiltSearch {
 public:
  BuiltSearch(const BuildProblems& build, const std::vector<BuiltParameter>& parameters,
              const CalibrationOptions& options)
      : parameters_(parameters), options_(options), evidence_(build, parameters, options) {
    const auto n = Eigen::Index(parameters.size());
    x_ = Eigen::VectorXd::Zero(n);
    held_.assign(parameters.size(), false);
    out_.parameters.resize(parameters.size());
    out_.log_covariance = Eigen::MatrixXd::Zero(n, n);
  }

  BuiltCalibration run() {
    try {
      search();
    } catch (const Stopped&) {
      out_.status = options_.stop.interrupted() ? Status::interrupted : Status::time_limit;
      out_.message = "stopped: the best parameters so far";
      leave();
    }
    out_.values = evidence_.values(x_);
    out_.builds = evidence_.builds();
    out_.solves = evidence_.solves();
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
      const auto at = Eigen::Index(i);
      CalibratedNoise& p = out_.parameters[i];
      p.name = parameters_[i].name;
      p.factor = std::exp(x_[at]);
      p.at_bound = x_[at] != 0 && (x_[at] <= low(at) + kAtBound || x_[at] >= high(at) - kAtBound);
    }
    return std::move(out_);
  }

 private:
  static constexpr double kAtBound = 1e-9;     // of a logarithm
  static constexpr double kLongestStep = 1.0;  // of a logarithm
  static constexpr double kEnough = 1e-3;      // of the log evidence, that a step would still gain
  static constexpr double kOfError = 0.5;      // of a standard error, for the curvature
  static constexpr int kShorter = 6;

  void search() {
    now_ = evidence_.first(out_.noise, start_);
    if (options_.ranges) as_given_ = now_;
    climb();
    if (options_.ranges) {
      for (bool again = false; hold_undetermined(again); again = true) {
        const Status status = out_.status;
        const std::string message = out_.message;
        climb();
        if (status != Status::converged) end(status, message);  // what is held was told there
      }
      as_given_ = {};
      find_curvature();
      tell();
    }
    finish_noise();
  }

  double low(Eigen::Index i) const { return evidence_.low()[i]; }
  double high(Eigen::Index i) const { return evidence_.high()[i]; }
  Point profile(const Eigen::VectorXd& x) { return evidence_.profile(x, now_); }
  Eigen::VectorXd with(Eigen::Index i, double value) const {
    Eigen::VectorXd x = x_;
    x[i] = value;
    return x;
  }
  std::vector<Eigen::Index> free() const {
    std::vector<Eigen::Index> free;
    for (std::size_t i = 0; i < held_.size(); ++i)
      if (!held_[i]) free.push_back(Eigen::Index(i));
    return free;
  }
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

  void climb() {
    const auto free = this->free();
    if (free.empty()) return end(Status::converged, "no parameter is free");
    Eigen::VectorXd curvature;
    Eigen::VectorXd g = gradient(x_, now_, free, &curvature);
    Eigen::MatrixXd inverse = curvature.cwiseMax(0.5).cwiseInverse().asDiagonal();
    for (int k = 0; k < options_.max_iterations; ++k) {
      Eigen::VectorXd step = inverse * g;
      for (std::size_t i = 0; i < free.size(); ++i) {  // what pushes against a bound stays
        const Eigen::Index at = free[i];
        if ((x_[at] <= low(at) && step[Eigen::Index(i)] < 0) || (x_[at] >= high(at) && step[Eigen::Index(i)] > 0))
          step[Eigen::Index(i)] = 0;
      }
      if (!(0.5 * g.dot(step) > kEnough)) return end(Status::converged, "the parameters change no more");
      const double longest = step.cwiseAbs().maxCoeff();
      if (longest > kLongestStep) step *= kLongestStep / longest;
      const Eigen::VectorXd from = x_;
      Eigen::VectorXd taken;
      Point next;
      double share = 1;
      int h = 0;
      for (; h <= kShorter; ++h, share /= 2) {
        x_ = from;
        for (std::size_t i = 0; i < free.size(); ++i)
          x_[free[i]] = std::clamp(from[free[i]] + share * step[Eigen::Index(i)], low(free[i]), high(free[i]));
        taken = (x_ - from)(free);
        const Eigen::VectorXd to = x_;
        x_ = from;  // where a stop leaves it
        next = profile(to);
        if (next.usable && next.value >= now_.value + 1e-4 * g.dot(taken)) {
          x_ = to;
          break;
        }
      }
      if (h > kShorter)
        return end(Status::failed, next.usable ? "no step along the gradient raises the evidence, though it should"
                                               : "problems cannot be built or solved beyond " + moved(free, taken));
      now_ = next;
      ++out_.iterations;
      if (options_.progress) {
        Eigen::VectorXd factors(now_.factors.size() + x_.size());
        factors << now_.factors.array().exp().matrix(), x_.array().exp().matrix();
        options_.progress(out_.iterations, factors, now_.value - start_);
      }
      const Eigen::VectorXd g_next = gradient(x_, now_, free);
      const Eigen::VectorXd change = g - g_next;
      const double along = taken.dot(change);
      if (along > 1e-9 * taken.norm() * change.norm()) {
        const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(g.size(), g.size()) - taken * change.transpose() / along;
        inverse = A * inverse * A.transpose() + taken * taken.transpose() / along;
      }
      g = g_next;
    }
    end(Status::max_iterations, "the limit of iterations was reached");
  }
  void end(Status status, const std::string& message) {
    out_.status = status;
    out_.message = message;
  }
  /// The parameters of a step, as they are without it.
  std::string moved(const std::vector<Eigen::Index>& free, const Eigen::VectorXd& step) const {
    const Eigen::VectorXd values = evidence_.values(x_);
    std::ostringstream text;
    text.precision(4);
    for (std::size_t i = 0; i < free.size(); ++i)
      if (step[Eigen::Index(i)] != 0)
        text << (text.tellp() > 0 ? ", " : "") << parameters_[std::size_t(free[i])].name << " = " << values[free[i]];
    return text.str();
  }

  /// The data's own evidence along one parameter, factors found again, the other parameters as found.
  Along along(Eigen::Index i, double x, const Point& point, double slope) const {
    const double prior = parameters_[std::size_t(i)].prior;
    return {point.value - evidence_.prior(i, x), slope + (prior > 0 ? x / (prior * prior) : 0.0)};
  }
  Along elsewhere(Eigen::Index i, double x) {
    const Point point = profile(with(i, x));
    if (!point.usable) return {-HUGE_VAL, 0};
    return along(i, x, point, evidence_.derivatives(with(i, x), point, i).first);
  }
  /// Of those that are free; `again`: that the data do not tell where all is found, whatever it looked like on the way.
  bool hold_undetermined(bool again) {
    bool any = false, apart = false;
    for (const Eigen::Index i : free()) {
      CalibratedNoise& p = out_.parameters[std::size_t(i)];
      const auto [slope, second] = evidence_.derivatives(x_, now_, i);
      const double prior = parameters_[std::size_t(i)].prior;
      const double of_data = -second - (prior > 0 ? 1 / (prior * prior) : 0.0);
      if (again && detail::is_told(of_data, prior)) continue;
      detail::flat_range(x_[i], along(i, x_[i], now_, slope),
                         1.2 * std::sqrt(2 * detail::kFall / std::max(of_data, 0.5)), std::max(-low(i), high(i)),
                         [&](double x) { return elsewhere(i, std::clamp(x, low(i), high(i))); })
          .tell(p, x_[i]);
      if (p.determined || p.bounded) continue;
      held_[std::size_t(i)] = any = true;
      const Point point = profile(with(i, 0));
      if (!point.usable) {
        apart = true;
        continue;
      }
      x_[i] = 0;
      now_ = point;
    }
    if (apart) {  // there are none with that one as given and the others as found: together, or all as given
      Eigen::VectorXd x = x_;
      for (Eigen::Index i = 0; i < x.size(); ++i)
        if (held_[std::size_t(i)]) x[i] = 0;
      Point point = profile(x);
      if (!point.usable) {
        x.setZero();
        point = as_given_;
      }
      x_ = x;
      now_ = point;
    }
    return any;
  }

  /// By differences of the profile's gradient; of the factors, too, what a parameter moves them by.
  void find_curvature() {
    const auto free = this->free();
    if (free.empty()) return;
    const auto n = Eigen::Index(free.size());
    Eigen::MatrixXd curvature(n, n);
    moved_ = Eigen::MatrixXd::Zero(now_.factors.size(), n);
    Eigen::VectorXd rough;
    const Eigen::VectorXd here = gradient(x_, now_, free, &rough);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double step = std::clamp(kOfError / std::sqrt(std::max(rough[k], 0.5)), 0.1, 0.5);
      const auto side = [&](double by, Eigen::VectorXd& g, Eigen::VectorXd& factors) {
        const Eigen::Index i = free[std::size_t(k)];
        const Eigen::VectorXd to = with(i, std::clamp(x_[i] + by, low(i), high(i)));
        const Point point = to[i] != x_[i] ? profile(to) : Point();
        g = point.usable ? gradient(to, point, free) : here;
        factors = point.usable ? point.factors : now_.factors;
        return point.usable ? std::abs(to[i] - x_[i]) : 0.0;
      };
      Eigen::VectorXd g_high, g_low, high, low;
      const double apart = side(step, g_high, high) + side(-step, g_low, low);
      if (apart > 0) {
        curvature.col(k) = (g_low - g_high) / apart;
        moved_.col(k) = (high - low) / apart;
      } else {
        curvature.col(k) = rough[k] * Eigen::VectorXd::Unit(n, k);
      }
    }
    curvature = (0.5 * (curvature + curvature.transpose())).eval();
    Eigen::VectorXd before(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double prior = parameters_[std::size_t(free[std::size_t(k)])].prior;
      before[k] = prior > 0 ? prior : std::log(options_.most);
    }
    out_.log_covariance(free, free) = detail::covariance_within(before, curvature);
  }
  /// Errors, gains and profiles of the parameters.
  void tell() {
    for (Eigen::Index i = 0; i < x_.size(); ++i) {
      CalibratedNoise& p = out_.parameters[std::size_t(i)];
      p.log_error = std::sqrt(std::max(0.0, out_.log_covariance(i, i)));
      const double here = now_.value - evidence_.prior(i, x_[i]);
      const double given = x_[i] != 0 ? value_of_data(i, 0) : here;
      if (std::isfinite(given)) p.gain = here - given;
      const double from = std::log(p.flat_from), to = std::log(p.flat_to);
      const double middle = 0.5 * (from + to), half = 0.8 * (to - from);
      for (int k = 0; k < options_.profile; ++k) {
        const double x = middle + half * (options_.profile > 1 ? 2.0 * k / (options_.profile - 1) - 1 : 0.0);
        if (x < low(i) || x > high(i)) continue;
        if (const double value = value_of_data(i, x); std::isfinite(value))
          p.profile.emplace_back(std::exp(x), value - here);
      }
    }
  }
  /// −∞ where there is no problem.
  double value_of_data(Eigen::Index i, double x) { return profile(with(i, x)).value - evidence_.prior(i, x); }

  /// The noise beside the parameters as found; they have a share in its errors.
  void finish_noise() {
    out_.gain = now_.value - start_;
    if (!evidence_.has_noise()) {
      out_.noise.status = Status::converged;
      out_.noise.message = "no noise was asked for";
      return;
    }
    double value = 0;
    Calibration found = evidence_.noise(x_, now_, value);
    out_.gain = value - start_;
    const auto free = this->free();
    for (std::size_t g = 0; g < found.noise.size() && moved_.cols() > 0; ++g) {
      CalibratedNoise& noise = found.noise[g];
      if (!noise.determined && !noise.bounded) continue;
      const Eigen::VectorXd by = moved_.row(Eigen::Index(g));
      noise.log_error = std::sqrt(noise.log_error * noise.log_error + by.dot(out_.log_covariance(free, free) * by));
    }
    found.iterations += out_.noise.iterations;
    found.solves += out_.noise.solves;
    out_.noise = std::move(found);
  }
  /// Stopped: at what was taken last.
  void leave() {
    for (CalibratedNoise& p : out_.parameters) p = {};
    out_.log_covariance.setZero();
    out_.gain = now_.usable ? now_.value - start_ : out_.noise.gain;
    if (!now_.usable) return;  // by the first calibrate() as it ended
    for (std::size_t g = 0; g < out_.noise.noise.size(); ++g) {
      CalibratedNoise& noise = out_.noise.noise[g];
      noise.factor = std::exp(now_.factors[Eigen::Index(g)]);
      noise.flat_from = noise.flat_to = 1;
      noise.determined = noise.bounded = false;
      noise.log_error = noise.gain = 0;
      noise.profile.clear();
    }
  }

  const std::vector<BuiltParameter>& parameters_;
  const CalibrationOptions& options_;
  BuiltEvidence evidence_;
  std::vector<bool> held_;
  Eigen::VectorXd x_;
  Point now_, as_given_;
  double start_ = 0;
  Eigen::MatrixXd moved_;  // factors' logarithms by those of the parameters that are free
  BuiltCalibration out_;
};

}  // namespace

BuiltCalibration calibrate_built(const BuildProblems& build, const std::vector<BuiltParameter>& parameters,
                                 const CalibrationOptions& options) {
  return BuiltSearch(build, parameters, options).run();
}

}  // namespace tandem

#include <algorithm>
#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/built_evidence.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/calibration/log_factors.hpp>
#include <tandem/solvers/calibration/saved_values.hpp>

namespace tandem::detail {
namespace {

constexpr double kStep = 0.05;  // step of a log factor, for differences

std::vector<NoiseGroup> some_of(const std::vector<NoiseGroup>& all, const std::vector<Eigen::Index>& which) {
  std::vector<NoiseGroup> some;
  for (const Eigen::Index g : which) some.push_back(all[std::size_t(g)]);
  return some;
}

Eigen::VectorXd log_factors(const Calibration& found) {
  Eigen::VectorXd logs(Eigen::Index(found.noise.size()));
  for (std::size_t g = 0; g < found.noise.size(); ++g) logs[Eigen::Index(g)] = std::log(found.noise[g].factor);
  return logs;
}

/// Returns two steps for differences, given the room below and above: one to each side, or two to the side with room.
/// Steps are 0 without room.
std::pair<double, double> steps(double below, double above) {
  if (above < std::min(below, 0.5 * kStep)) {
    const double step = std::min(kStep, 0.5 * below);
    return {-2 * step, -step};
  }
  if (below < 0.5 * kStep) {
    const double step = std::min(kStep, 0.5 * above);
    return {2 * step, step};
  }
  return {std::min(kStep, above), -std::min(kStep, below)};
}

}  // namespace

BuiltEvidence::BuiltEvidence(const BuildProblems& build, const std::vector<BuiltParameter>& parameters,
                             const CalibrationOptions& options)
    : build_(build), parameters_(parameters), options_(options) {
  if (parameters.empty()) throw BadInputError("calibrate: no parameter is given");
  if (!(options.max_factor > 1)) throw BadInputError("calibrate: max_factor must be greater than 1");
  const auto n = Eigen::Index(parameters.size());
  given_.resize(n);
  low_.resize(n);
  high_.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const BuiltParameter& p = parameters[std::size_t(i)];
    if (!(p.given > 0 && std::isfinite(p.given) && p.lower <= p.given && p.given <= p.upper && p.prior >= 0))
      throw BadInputError("calibrate: parameter " + p.name +
                          " needs a positive, finite value within its bounds, and a prior that is not negative");
    given_[i] = p.given;
    low_[i] = std::max(std::log(p.lower / p.given), -std::log(options.max_factor));
    high_[i] = std::min(std::log(p.upper / p.given), std::log(options.max_factor));
  }
}

Eigen::VectorXd BuiltEvidence::values(const Eigen::VectorXd& x) const {
  Eigen::VectorXd values = given_.cwiseProduct(x.array().exp().matrix());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const BuiltParameter& p = parameters_[std::size_t(i)];
    values[i] = std::clamp(values[i], p.lower, p.upper);  // against rounding of the logarithm
  }
  return values;
}

BuiltEvidence::Built BuiltEvidence::make(const Eigen::VectorXd& x, const Point* from) {
  options_.stop.check("calibrate");
  ++builds_;
  Built built{build_(values(x)), {}, 0};
  built.raw = pointers_to(built.of.problems);
  built.constants = log_constants(built.raw, built.of.measured);
  for (std::size_t p = 0; from && p < built.raw.size(); ++p) copy_values(*from->solved[p], *built.raw[p]);
  return built;
}

/// Returns nothing if BuildProblems reports that there is no problem at x.
std::optional<BuiltEvidence::Built> BuiltEvidence::try_make(const Eigen::VectorXd& x, const Point& from) try {
  return make(x, &from);
} catch (const BadInputError&) {
  throw;
} catch (const StaleHandleError&) {
  throw;
} catch (const Stopped&) {
  throw;
} catch (const Error& error) {
  why_ = error.what();
  return {};
}

CalibrationOptions BuiltEvidence::inner(const Built& built) const {
  CalibrationOptions options = options_;
  options.measured = built.of.measured;
  options.absolute_evidence = true;
  options.progress = {};
  options.ranges = false;
  options.initial_log_factors = {};
  options.counted_rows = {};
  return options;
}

double BuiltEvidence::priors(const Eigen::VectorXd& x) const {
  double sum = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i) sum += LogPrior{parameters_[std::size_t(i)].prior}.value(x[i]);
  return sum;
}

BuiltEvidence::Point BuiltEvidence::first(Calibration& found, double& as_given) {
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(given_.size());
  const Built built = make(zero, nullptr);
  const double constants = built.constants;
  if (built.of.groups.empty()) {
    const Point point = profile_of(built, {});
    as_given = point.value;
    return point;
  }
  CalibrationOptions options = inner(built);
  options.progress = options_.progress;
  options.ranges = options_.ranges;
  options.profile_points = 0;
  found = calibrate(built, built.of.groups, options);
  options_.stop.check("calibrate");
  counted_ = found.counted_rows;
  for (const CalibratedNoise& noise : found.noise)
    free_noise_.push_back(!options_.ranges || noise.identifiable || noise.bounded);
  as_given = found.log_evidence - found.gain + constants;
  return {true, found.log_evidence + constants, log_factors(found), found.problems};
}

Calibration BuiltEvidence::calibrate(const Built& built, const std::vector<NoiseGroup>& groups,
                                     const CalibrationOptions& options) {
  Calibration found = tandem::calibrate(built.raw, groups, options);
  solves_ += found.solves;
  return found;
}

/// Evaluates the evidence with fixed noise factors; `factors` has all groups. Sets `solved`, if not null, to the solved
/// copies of the problems.
Evidence::Value BuiltEvidence::evidence(const Built& built, const Eigen::VectorXd& factors, Problems* solved) {
  const auto free = indices_of(free_noise_, true);
  const auto groups = some_of(built.of.groups, free);
  CalibrationOptions options = inner(built);
  if (!free.empty()) options.counted_rows = counted_(free);
  Evidence evidence(built.raw, groups, options);
  struct Count {
    const Evidence& of;
    int& to;
    ~Count() { to += of.solves(); }
  } const count{evidence, solves_};
  if (solved) *solved = evidence.problems();
  return evidence.at(free.empty() ? Eigen::VectorXd() : Eigen::VectorXd(factors(free)));
}

BuiltEvidence::Point BuiltEvidence::profile_of(const Built& built, const Eigen::VectorXd& factors) {
  const auto free = indices_of(free_noise_, true);
  Point point{true, 0, Eigen::VectorXd::Zero(Eigen::Index(free_noise_.size()))};
  if (free.empty()) {
    const Evidence::Value value = evidence(built, factors, &point.solved);
    if (!value.usable)
      throw_without_result("calibrate: the problem cannot be solved with the given noise: " + value.why,
                           value.unobservable);
    point.value = value.log_evidence;
  } else {
    CalibrationOptions options = inner(built);
    options.initial_log_factors = factors(free);
    options.counted_rows = counted_(free);
    const Calibration found = calibrate(built, some_of(built.of.groups, free), options);
    options_.stop.check("calibrate");
    point.value = found.log_evidence;
    point.factors(free) = log_factors(found);
    point.solved = found.problems;
  }
  point.value += built.constants;
  return point;
}

BuiltEvidence::Point BuiltEvidence::profile(const Eigen::VectorXd& x, const Point& from) try {
  const std::optional<Built> built = try_make(x, from);
  if (!built) return {};
  Point point = profile_of(*built, from.factors);
  point.value += priors(x);
  point.usable = std::isfinite(point.value);
  return point;
} catch (const NumericalError& error) {
  why_ = error.what();
  return {};
}

double BuiltEvidence::at(const Eigen::VectorXd& x, const Point& point) try {
  const std::optional<Built> built = try_make(x, point);
  if (!built) return -HUGE_VAL;
  const Evidence::Value value = evidence(*built, point.factors);
  return value.usable ? value.log_evidence + built->constants + priors(x) : -HUGE_VAL;
} catch (const NumericalError&) {
  return -HUGE_VAL;
}

std::pair<double, double> BuiltEvidence::derivatives(const Eigen::VectorXd& x, const Point& point, Eigen::Index i) {
  const auto [a, b] = steps(x[i] - low_[i], high_[i] - x[i]);
  const auto value = [&](double step) {
    if (step == 0) return -HUGE_VAL;
    Eigen::VectorXd near = x;
    near[i] = std::clamp(x[i] + step, low_[i], high_[i]);
    return at(near, point);
  };
  const double at_a = value(a), at_b = value(b);
  if (std::isfinite(at_a) && std::isfinite(at_b)) {  // derivatives of the parabola through three points
    if (a == -b) return {(at_a - at_b) / (2 * a), (at_a - 2 * point.value + at_b) / (a * a)};
    const double second = 2 * ((at_a - point.value) / a - (at_b - point.value) / b) / (a - b);
    return {(at_a - at_b) / (a - b) - 0.5 * (a + b) * second, second};
  }
  if (std::isfinite(at_a)) return {(at_a - point.value) / a, 0};
  if (std::isfinite(at_b)) return {(at_b - point.value) / b, 0};
  return {0, 0};
}

Calibration BuiltEvidence::noise(const Eigen::VectorXd& x, const Point& at, double& value) {
  const Built built = make(x, &at);
  CalibrationOptions options = inner(built);
  options.ranges = options_.ranges;
  options.initial_log_factors = at.factors;
  options.counted_rows = counted_;
  Calibration found = calibrate(built, built.of.groups, options);
  options_.stop.check("calibrate");
  value = found.log_evidence + built.constants + priors(x);
  return found;
}

}  // namespace tandem::detail

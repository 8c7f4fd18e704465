#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/held_out.hpp>
#include <tandem/studies/calibration/constant_trials.hpp>

namespace tandem {
namespace {

/// Fixes a constant to zero (the identity) during its lifetime.
class ScopedZeroConstant {
 public:
  ScopedZeroConstant(Problem& problem, const SensorConstant& constant) : problem_(problem), constant_(constant) {
    visit([&]<LieGroup G>(const Variable<G>& x) {
      was_ = problem_.value(x).Log();
      problem_.set_value(x, G());
      problem_.fix(x);
    });
  }
  ~ScopedZeroConstant() {
    visit([&]<LieGroup G>(const Variable<G>& x) {
      problem_.fix(x, false);
      problem_.set_value(x, G::Exp(typename G::Tangent(was_)));
    });
  }
  ScopedZeroConstant(const ScopedZeroConstant&) = delete;

 private:
  template <class F>
  void visit(F f) {
    std::visit(f, constant_.state);
  }

  Problem& problem_;
  const SensorConstant& constant_;
  Eigen::VectorXd was_;
};

/// Holds out the measurements of a fold during its lifetime. `noise` is their own noise.
class ScopedHoldOut {
 public:
  ScopedHoldOut(std::span<Problem* const> problems, const std::vector<HeldOutMeasurement>& fold)
      : problem_(*problems[0]), fold_(fold) {
    detail::hold_out(problems, fold, noise);
  }
  ~ScopedHoldOut() {
    for (std::size_t i = 0; i < fold_.size(); ++i) problem_.set_noise(fold_[i].block, noise[i]);
  }
  ScopedHoldOut(const ScopedHoldOut&) = delete;

  std::vector<Gaussian> noise;

 private:
  Problem& problem_;
  const std::vector<HeldOutMeasurement>& fold_;
};

}  // namespace

ConstantTrials cross_validate_constants(Problem& problem, const std::vector<SensorConstant>& constants,
                                        const std::vector<std::vector<HeldOutMeasurement>>& folds,
                                        const CalibrationOptions& options) {
  ConstantTrials result;
  Problem* const problems[] = {&problem};
  std::vector<std::vector<double>> gains(constants.size());  // by constant and fold
  try {
    for (std::size_t f = 0; f < folds.size(); ++f) {
      std::vector<HeldOutMeasurement> fold = folds[f];
      if (fold.empty()) continue;
      for (HeldOutMeasurement& m : fold) m.problem = 0;
      const ScopedHoldOut out(problems, fold);
      const auto predict = [&] {
        if (std::string why; !detail::solve_all(problems, options, why)) throw Error(why);
        return detail::predictions(problems, fold, f, out.noise, options.stop);
      };
      const auto with = predict();
      for (std::size_t c = 0; c < constants.size(); ++c) {
        const ScopedZeroConstant zero(problem, constants[c]);
        gains[c].push_back(detail::log_likelihood_gain(predict(), with));
      }
    }
    for (std::size_t c = 0; c < constants.size(); ++c) {
      ConstantTrial& trial = result.trials.emplace_back(ConstantTrial{constants[c].name});
      for (const double gain : gains[c]) trial.gain += gain;
      trial.gain_error = detail::standard_error_of_sum(gains[c]);
    }
  } catch (const Stopped&) {
    throw;
  } catch (const Error& error) {
    result.why = error.what();
  }
  std::string ignored;
  detail::solve_all(problems, options, ignored);
  return result;
}

}  // namespace tandem

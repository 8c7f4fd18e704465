#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/held_out.hpp>
#include <tandem/studies/calibration/constant_trials.hpp>
#include <tandem/studies/calibration/singularity_messages.hpp>

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
  std::vector<std::vector<double>> gains(constants.size());  // [constant][fold]
  try {
    for (std::size_t f = 0; f < folds.size(); ++f) {
      std::vector<HeldOutMeasurement> fold = folds[f];
      if (fold.empty()) continue;
      for (HeldOutMeasurement& m : fold) m.problem = 0;
      fold = detail::counterparts(problems, std::move(fold));  // the problem may have been rebuilt
      const ScopedHoldOut out(problems, fold);
      const auto predict = [&] {
        if (const auto failed = detail::solve_all(problems, options))
          throw_without_result(failed->message, describe(failed->unobservable));
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
  } catch (const NumericalError& error) {
    result.why = explain_singularity(error);
  }
  detail::solve_all(problems, options);
  return result;
}

}  // namespace tandem

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/held_out.hpp>
#include <tandem/studies/calibration/constant_trials.hpp>

namespace tandem {
namespace {

/// A constant that is none while this lives.
class HeldAtNone {
 public:
  HeldAtNone(Problem& problem, const SensorConstant& constant) : problem_(problem), constant_(constant) {
    visit([&]<LieGroup G>(const Variable<G>& x) {
      was_ = problem_.value(x).Log();
      problem_.set_value(x, G());
      problem_.fix(x);
    });
  }
  ~HeldAtNone() {
    visit([&]<LieGroup G>(const Variable<G>& x) {
      problem_.fix(x, false);
      problem_.set_value(x, G::Exp(typename G::Tangent(was_)));
    });
  }
  HeldAtNone(const HeldAtNone&) = delete;

 private:
  template <class F>
  void visit(F f) {
    std::visit(f, constant_.state);
  }

  Problem& problem_;
  const SensorConstant& constant_;
  Eigen::VectorXd was_;
};

/// The noise that a fold's measurements have otherwise.
class LeftOutForNow {
 public:
  LeftOutForNow(std::span<Problem* const> problems, const std::vector<LeftOut>& fold)
      : problem_(*problems[0]), fold_(fold) {
    detail::leave_out(problems, fold, noise);
  }
  ~LeftOutForNow() {
    for (std::size_t i = 0; i < fold_.size(); ++i) problem_.set_noise(fold_[i].block, noise[i]);
  }
  LeftOutForNow(const LeftOutForNow&) = delete;

  std::vector<Gaussian> noise;

 private:
  Problem& problem_;
  const std::vector<LeftOut>& fold_;
};

}  // namespace

ConstantTrials try_constants(Problem& problem, const std::vector<SensorConstant>& constants,
                             const std::vector<std::vector<LeftOut>>& folds, const CalibrationOptions& options) {
  ConstantTrials result;
  Problem* const problems[] = {&problem};
  std::vector<std::vector<double>> gains(constants.size());  // of each fold
  try {
    for (std::size_t f = 0; f < folds.size(); ++f) {
      std::vector<LeftOut> fold = folds[f];
      if (fold.empty()) continue;
      for (LeftOut& m : fold) m.problem = 0;
      const LeftOutForNow out(problems, fold);
      const auto predict = [&] {
        if (std::string why; !detail::solve_all(problems, options, why)) throw Error(why);
        return detail::predictions(problems, fold, f, out.noise, options.stop);
      };
      const auto with = predict();
      for (std::size_t c = 0; c < constants.size(); ++c) {
        const HeldAtNone none(problem, constants[c]);
        gains[c].push_back(detail::gain_of(predict(), with));
      }
    }
    for (std::size_t c = 0; c < constants.size(); ++c) {
      ConstantTrial& trial = result.trials.emplace_back(ConstantTrial{constants[c].name});
      for (const double gain : gains[c]) trial.gain += gain;
      trial.gain_error = detail::error_of_sum(gains[c]);
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

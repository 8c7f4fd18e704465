#pragma once

#include <optional>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include <tandem/lie/se2.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/problem/navigation/systematic_error.hpp>
#include <tandem/problem/problem.hpp>

namespace tandem {

/// A constant systematic error in a problem: scale factor error [1], misalignment [rad], delay [s], or constant bias
/// [units of the residual's rows].
struct SensorConstant {
  std::string name;  ///< "usbl.scale", "camera.misalignment", "dvl.delay", "gps.bias"
  std::variant<Variable<Rn<1>>, Variable<Rn<2>>, Variable<Rn<3>>, Variable<Rn<6>>, Variable<SO3>, Variable<SO2>> state;
  Eigen::VectorXd sigma;  ///< standard deviations of its zero-mean prior, one per tangent dimension
};

/// Constant systematic errors of all sensors of a problem. Each variable is added when it is first requested.
class SensorConstants {
 public:
  /// Returns the variable of the constant `what` ("scale", "misalignment" or "delay"). Adds it with its prior if it is
  /// new. Returns fixed_identity() if `sigma`, its prior standard deviation, is zero. G is Rn<1>, SO3 or SO2.
  template <LieGroup G>
  Variable<G> get_or_add(Problem& problem, const std::string& sensor, const char* what, double sigma);
  /// Returns a variable that is fixed at the identity. It fills the arguments of a residual that do not apply, such as
  /// disabled errors or unused states. Fixed variables add no unknowns.
  template <LieGroup G>
  Variable<G> fixed_identity(Problem& problem);
  /// Registers a constant bias that is already in the problem, with its prior.
  template <int N>
  void add_bias(const std::string& sensor, const Variable<Rn<N>>& bias, const Eigen::VectorXd& sigma) {
    all_.push_back({sensor + ".bias", bias, sigma});
  }
  const std::vector<SensorConstant>& all() const { return all_; }
  /// Calls f(name, variable, prior standard deviations) for each constant.
  template <class F>
  void each(F f) const {
    for (const SensorConstant& c : all_) std::visit([&](const auto& x) { f(c.name, x, c.sigma); }, c.state);
  }

 private:
  std::vector<SensorConstant> all_;
  std::tuple<std::optional<Variable<Rn<1>>>, std::optional<Variable<Rn<2>>>, std::optional<Variable<Rn<3>>>,
             std::optional<Variable<Rn<6>>>, std::optional<Variable<SO3>>, std::optional<Variable<SO2>>,
             std::optional<Variable<SE3>>, std::optional<Variable<SE2>>>
      fixed_;
};

}  // namespace tandem

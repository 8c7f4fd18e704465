#pragma once

#include <optional>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include <tandem/lie/se2.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/problem/navigation/staying_error.hpp>
#include <tandem/problem/problem.hpp>

namespace tandem {

/// One of the constants of a sensor's StayingError in a problem: 1; rad; s; of a bias in the units of its rows.
struct SensorConstant {
  std::string name;  ///< "usbl.scale", "camera.misalignment", "dvl.delay", "gps.bias"
  std::variant<Variable<Rn<1>>, Variable<Rn<2>>, Variable<Rn<3>>, Variable<Rn<6>>, Variable<SO3>, Variable<SO2>> state;
  Eigen::VectorXd sigma;  ///< of its prior, whose mean is 0: one a row
};

/// The constants of all sensors of a problem, each made when it is first asked for. A residual that reads one which its
/// sensor has not gets a variable that is fixed at zero, and that solvers do not see.
class SensorConstants {
 public:
  /// `what`: "scale", "misalignment" or "delay", of this standard deviation; 0: the sensor has none.
  /// Of Rn<1>, SO3 and SO2.
  template <LieGroup G>
  Variable<G> get(Problem& problem, const std::string& sensor, const char* what, double sigma);
  /// Of these, of a bias, and of a pose or point that a residual does not read.
  template <LieGroup G>
  Variable<G> none(Problem& problem);
  /// A bias that is one for the whole recording, and has its prior already.
  template <int N>
  void add_bias(const std::string& sensor, const Variable<Rn<N>>& bias, const Eigen::VectorXd& sigma) {
    all_.push_back({sensor + ".bias", bias, sigma});
  }
  const std::vector<SensorConstant>& all() const { return all_; }
  /// Calls f(name, variable, standard deviations given) for each.
  template <class F>
  void each(F f) const {
    for (const SensorConstant& c : all_) std::visit([&](const auto& x) { f(c.name, x, c.sigma); }, c.state);
  }

 private:
  std::vector<SensorConstant> all_;
  std::tuple<std::optional<Variable<Rn<1>>>, std::optional<Variable<Rn<2>>>, std::optional<Variable<Rn<3>>>,
             std::optional<Variable<Rn<6>>>, std::optional<Variable<SO3>>, std::optional<Variable<SO2>>,
             std::optional<Variable<SE3>>, std::optional<Variable<SE2>>>
      none_;
};

}  // namespace tandem

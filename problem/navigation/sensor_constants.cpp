#include <tandem/problem/navigation/sensor_constants.hpp>
#include <tandem/residuals/prior.hpp>

namespace tandem {

template <LieGroup G>
Variable<G> SensorConstants::get_or_add(Problem& problem, const std::string& sensor, const char* what, double sigma) {
  if (!(sigma > 0)) return fixed_identity<G>(problem);
  const std::string name = sensor + "." + what;
  for (const SensorConstant& c : all_)
    if (c.name == name) return std::get<Variable<G>>(c.state);
  const Variable<G> x = problem.add(G(), name);
  const Eigen::VectorXd sigmas = Eigen::VectorXd::Constant(G::dof, sigma);
  problem.minimize(Prior<G>{G()}, Gaussian(sigmas), {x});
  all_.push_back({name, x, sigmas});
  return x;
}

template <LieGroup G>
Variable<G> SensorConstants::fixed_identity(Problem& problem) {
  auto& x = std::get<std::optional<Variable<G>>>(fixed_);
  if (!x) {
    x = problem.add(G(), "no error");
    problem.fix(*x);
  }
  return *x;
}

template Variable<Rn<1>> SensorConstants::get_or_add(Problem&, const std::string&, const char*, double);
template Variable<SO3> SensorConstants::get_or_add(Problem&, const std::string&, const char*, double);
template Variable<SO2> SensorConstants::get_or_add(Problem&, const std::string&, const char*, double);
template Variable<Rn<1>> SensorConstants::fixed_identity(Problem&);
template Variable<Rn<2>> SensorConstants::fixed_identity(Problem&);
template Variable<Rn<3>> SensorConstants::fixed_identity(Problem&);
template Variable<Rn<6>> SensorConstants::fixed_identity(Problem&);
template Variable<SO3> SensorConstants::fixed_identity(Problem&);
template Variable<SO2> SensorConstants::fixed_identity(Problem&);
template Variable<SE3> SensorConstants::fixed_identity(Problem&);
template Variable<SE2> SensorConstants::fixed_identity(Problem&);

}  // namespace tandem

#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/navigation/found_constants.hpp>

namespace tandem {

std::string FoundConstant::text() const {
  return deviation > 0 ? fmt::format("{} {:.5f} ± {:.5f}", name, value, deviation)
                       : fmt::format("{} {:.5f}", name, value);
}

std::vector<FoundConstant> found_constants(const Problem& problem, const std::vector<SensorConstant>& constants,
                                           const Marginals* marginals) {
  std::vector<FoundConstant> found;
  const auto add = [&]<LieGroup G>(const SensorConstant& constant, const Variable<G>& x) {
    const typename G::Tangent value = problem.value(x).Log();
    constexpr const char* axes[] = {".rx", ".ry", ".rz"};
    typename G::Tangent deviation = G::Tangent::Zero();
    if (marginals) deviation = marginals->covariance(x).diagonal().cwiseSqrt();
    for (int i = 0; i < G::dof; ++i)
      found.push_back({constant.name + (G::dof == 3 ? axes[i] : ""), value[i], constant.sigma, deviation[i]});
  };
  for (const SensorConstant& constant : constants) std::visit([&](const auto& x) { add(constant, x); }, constant.state);
  return found;
}

std::vector<FoundConstant> found_errors(const std::vector<OnlineEstimator::SensorError>& errors) {
  std::vector<FoundConstant> found;
  for (const OnlineEstimator::SensorError& e : errors)
    for (Eigen::Index i = 0; i < e.value.size(); ++i) {
      const bool turn = e.name.ends_with(".misalignment") && e.value.size() == 3;
      const std::string row = turn                        ? fmt::format(".r{:c}", "xyz"[i])
                              : e.name.ends_with(".bias") ? fmt::format(".{}", i + 1)
                                                          : std::string();
      found.push_back({e.name + row, e.value[i], e.given[i], e.deviation.size() ? e.deviation[i] : 0.0});
    }
  return found;
}

std::string constants_text(const std::vector<FoundConstant>& constants) {
  if (constants.empty()) return "";
  std::string text = "Errors that stay (scale 1, misalignment rad, delay s, bias in the units of its rows):\n";
  std::vector<std::string> untold;
  for (const FoundConstant& c : constants) {
    text += fmt::format("  {}\n", c.text());
    if (c.deviation > 0 && !c.determined()) untold.push_back(c.name);
  }
  if (!untold.empty())
    text += fmt::format("The data do not tell {} apart from the motion and the other errors: held at what was given.\n",
                        fmt::join(untold, ", "));
  return text;
}

}  // namespace tandem

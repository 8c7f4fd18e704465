#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/navigation/found_constants.hpp>

namespace tandem {

std::string FoundConstant::text() const {
  return deviation > 0 ? fmt::format("{} {:.5f} ± {:.5f}", name, value, deviation)
                       : fmt::format("{} {:.5f}", name, value);
}

namespace {

/// Each row of an error by the name it has in tables.
void add_rows(const std::string& name, const Eigen::VectorXd& value, const Eigen::VectorXd& given,
              const Eigen::VectorXd& deviation, std::vector<FoundConstant>& found) {
  for (Eigen::Index i = 0; i < value.size(); ++i) {
    const std::string row = name.ends_with(".bias") ? fmt::format(".{}", i + 1)
                            : value.size() == 3     ? fmt::format(".r{:c}", "xyz"[i])
                                                    : std::string();
    found.push_back({name + row, value[i], given[i], deviation.size() ? deviation[i] : 0.0});
  }
}

}  // namespace

std::vector<FoundConstant> found_constants(const Problem& problem, const std::vector<SensorConstant>& constants,
                                           const Marginals* marginals) {
  std::vector<FoundConstant> found;
  const auto add = [&]<LieGroup G>(const SensorConstant& constant, const Variable<G>& x) {
    Eigen::VectorXd deviation;
    if (marginals) deviation = marginals->covariance(x).diagonal().cwiseSqrt();
    add_rows(constant.name, problem.value(x).Log(), constant.sigma, deviation, found);
  };
  for (const SensorConstant& constant : constants) std::visit([&](const auto& x) { add(constant, x); }, constant.state);
  return found;
}

std::vector<FoundConstant> found_errors(const std::vector<OnlineEstimator::SensorError>& errors) {
  std::vector<FoundConstant> found;
  for (const OnlineEstimator::SensorError& e : errors) add_rows(e.name, e.value, e.given, e.deviation, found);
  return found;
}

std::string constants_text(const std::vector<FoundConstant>& constants) {
  if (constants.empty()) return "";
  std::string text = "Errors that stay (scale 1, misalignment rad, delay s, bias in the units of its rows):\n";
  std::vector<std::string> untold, at_odds;
  for (const FoundConstant& c : constants) {
    text += fmt::format("  {}\n", c.text());
    if (c.at_odds())
      at_odds.push_back(c.name);
    else if (c.deviation > 0 && !c.determined())
      untold.push_back(c.name);
  }
  if (!at_odds.empty())
    text += fmt::format(
        "{} is more than two of its standard deviations from none: it may stand for a misfit elsewhere, of the "
        "target's "
        "motion above all. Try another --model, or leave it out.\n",
        fmt::join(at_odds, ", "));
  if (!untold.empty())
    text += fmt::format("The data do not tell {} apart from the motion and the other errors: held at what was given.\n",
                        fmt::join(untold, ", "));
  return text;
}

}  // namespace tandem

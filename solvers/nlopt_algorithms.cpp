#include <algorithm>
#include <array>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/name_suggestions.hpp>
#include <tandem/solvers/nlopt.hpp>
#include <tandem/solvers/nlopt_algorithms.hpp>

namespace tandem {

using detail::NloptAlgorithm;

namespace {

const std::array kAlgorithms{
    NloptAlgorithm{"lbfgs", nlopt::LD_LBFGS, {}, false, false, false},
    NloptAlgorithm{"tnewton", nlopt::LD_TNEWTON, {}, false, false, false},
    NloptAlgorithm{"tnewton-restart", nlopt::LD_TNEWTON_RESTART, {}, false, false, false},
    NloptAlgorithm{"tnewton-precond", nlopt::LD_TNEWTON_PRECOND, {}, false, false, false},
    NloptAlgorithm{"tnewton-precond-restart", nlopt::LD_TNEWTON_PRECOND_RESTART, {}, false, false, false},
    NloptAlgorithm{"var1", nlopt::LD_VAR1, {}, false, false, false},
    NloptAlgorithm{"var2", nlopt::LD_VAR2, {}, false, false, false},
    NloptAlgorithm{"mma", nlopt::LD_MMA, {}, false, true, false},
    NloptAlgorithm{"ccsaq", nlopt::LD_CCSAQ, {}, false, true, false},
    NloptAlgorithm{"slsqp", nlopt::LD_SLSQP, {}, true, true, true},
    NloptAlgorithm{"auglag-lbfgs", nlopt::AUGLAG, nlopt::LD_LBFGS, true, true, false},
    NloptAlgorithm{"auglag-tnewton", nlopt::AUGLAG, nlopt::LD_TNEWTON_PRECOND_RESTART, true, true, false},
};

}  // namespace

std::vector<std::string> nlopt_algorithms() {
  std::vector<std::string> names;
  for (const auto& a : kAlgorithms) names.emplace_back(a.name);
  return names;
}

const NloptAlgorithm& detail::find_algorithm(const std::string& name) {
  const auto it = std::find_if(kAlgorithms.begin(), kAlgorithms.end(), [&](const auto& a) { return a.name == name; });
  if (it == kAlgorithms.end())
    throw BadInputError("nlopt has no algorithm '" + name + "'" + did_you_mean(name, nlopt_algorithms()));
  return *it;
}

}  // namespace tandem

#pragma once

#include <optional>
#include <string>

#include <nlopt.hpp>

namespace tandem::detail {

/// An algorithm of NLopt that Tandem offers.
struct NloptAlgorithm {
  const char* name;
  nlopt::algorithm method;
  std::optional<nlopt::algorithm> inner;  // inner algorithm of AUGLAG
  bool equalities, inequalities, dense;   // supported constraints; uses a dense matrix of all unknowns
};

/// Returns the algorithm of this name. Throws BadInputError if there is none.
const NloptAlgorithm& find_algorithm(const std::string& name);

}  // namespace tandem::detail

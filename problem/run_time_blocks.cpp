#include <array>

#include <tandem/problem/problem.hpp>

// Blocks whose residual type is known at run time only.
namespace tandem {

std::vector<int> Problem::slots_of(const detail::ResidualType& type, std::span<const VariableHandle> x) {
  const auto arity = std::size_t(type.functions.arity);
  if (x.size() != arity)
    throw BadInputError(std::string(type.functions.name) + ": the residual reads " + std::to_string(arity) +
                        " variables, not " + std::to_string(x.size()));
  std::array<detail::StateStoreBase*, detail::kMaxStates> stores;
  type.stores_of(type, *this, stores.data());
  std::vector<int> slots;
  for (std::size_t s = 0; s < arity; ++s) {
    const VariableInfo& variable = variables_[std::size_t(id(x[s]))];
    if (variable.store != stores[s])
      throw BadInputError(std::string(type.functions.name) + ": the residual cannot read variable " + variable.name() +
                          " at position " + std::to_string(s) + ", because its group differs");
    slots.push_back(variable.slot);
  }
  return slots;
}

Block Problem::minimize(const detail::ResidualType& type, const void* residual, std::span<const VariableHandle> x,
                        const Gaussian& noise, const Loss& loss) {
  if (type.hard) throw BadInputError(std::string(type.functions.name) + ": a constraint was given as a cost");
  return add_soft(type, residual, slots_of(type, x).data(), noise, loss);
}

Block Problem::subject_to(const detail::ResidualType& type, const void* residual, std::span<const VariableHandle> x,
                          std::span<const double> lower, std::span<const double> upper) {
  if (!type.hard) throw BadInputError(std::string(type.functions.name) + ": a cost was given as a constraint");
  if (lower.size() != std::size_t(type.functions.dim) || upper.size() != lower.size())
    throw BadInputError(std::string(type.functions.name) + ": the residual has " + std::to_string(type.functions.dim) +
                        " rows, but there are bounds for " + std::to_string(lower.size()));
  return add_hard(type, residual, slots_of(type, x).data(), lower.data(), upper.data());
}

}  // namespace tandem

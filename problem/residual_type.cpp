#include <vector>

#include <tandem/problem/residual_type.hpp>

namespace tandem::detail {
namespace {

// A function-local static, because registration happens before main() in unspecified order.
template <class Type>
std::vector<const Type*>& registered() {
  static std::vector<const Type*> types;
  return types;
}

}  // namespace

RegisteredResidual::RegisteredResidual(const ResidualType& type) { registered<ResidualType>().push_back(&type); }

GroupType::GroupType(const std::type_info& t, StoreOf of) : type(t), store_of(of) {
  registered<GroupType>().push_back(this);
}

std::span<const ResidualType* const> residual_types() { return registered<ResidualType>(); }
std::span<const GroupType* const> group_types() { return registered<GroupType>(); }

}  // namespace tandem::detail

#include <utility>
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

RunTimeResidualType::RunTimeResidualType(const ResidualFunctions& f, bool is_hard, std::vector<const GroupType*> groups,
                                         Prepare before)
    : ResidualType{f,
                   is_hard,
                   [](const void*, Fields& fields, const Use*) { fields.fail("the residual is defined at run time"); },
                   [](const ResidualType& type, Problem& problem, StateStoreBase** stores) {
                     for (const GroupType* group : static_cast<const RunTimeResidualType&>(type).states)
                       *stores++ = group->store_of(problem);
                   },
                   before,
                   true},
      states(std::move(groups)) {}

std::span<const ResidualType* const> residual_types() { return registered<ResidualType>(); }
std::span<const GroupType* const> group_types() { return registered<GroupType>(); }

}  // namespace tandem::detail

#pragma once

#include <concepts>
#include <span>
#include <string>
#include <typeinfo>

#include <tandem/problem/pool.hpp>
#include <tandem/residuals/fields.hpp>
#include <tandem/residuals/residual_functions.hpp>

namespace tandem {

class Problem;

namespace detail {

/// A residual type in one role that is compiled into this program.
struct ResidualType {
  /// Passes the members of the residual `from` through `fields`, or of a default-constructed residual if `from` is
  /// null. If `to` is not null and all fields are complete, adds the residual to that pool.
  using Pass = void (*)(const void* from, Fields& fields, PoolBase* to, const int* slots);
  /// Sets `stores` to the store of each state; creates those that the problem lacks.
  using StoresOf = void (*)(Problem& problem, StateStoreBase** stores);

  const ResidualFunctions& functions;
  bool hard;
  Pass pass;
  StoresOf stores_of;

  const std::type_info& type() const { return *functions.type; }
};
/// Registers a residual type by name before main(), so that problem files with blocks of this type can be read.
struct RegisteredResidual {
  explicit RegisteredResidual(const ResidualType& type);
};
/// A Lie group whose variables are compiled into this program. Registers itself by name before main().
struct GroupType {
  using StoreOf = StateStoreBase* (*)(Problem& problem);  ///< returns the store of such variables

  GroupType(const std::type_info& type, StoreOf store_of);
  const std::type_info& type;
  StoreOf store_of;
};
/// Return all registered types.
std::span<const ResidualType* const> residual_types();
std::span<const GroupType* const> group_types();

template <class R>
void pass_residual(const void* from, Fields& fields, PoolBase* to, const int* slots) {
  if constexpr (std::default_initializable<R>) {
    R residual = from ? R(*static_cast<const R*>(from)) : R{};
    pass_fields(residual, fields);
    if (to && fields.complete()) to->add_residual(&residual, slots);
  } else {
    fields.fail(typeid(R));
  }
}

}  // namespace detail
}  // namespace tandem

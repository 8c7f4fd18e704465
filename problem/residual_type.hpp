#pragma once

#include <concepts>
#include <span>
#include <string>
#include <typeinfo>
#include <vector>

#include <tandem/problem/function_ref.hpp>
#include <tandem/problem/pool.hpp>
#include <tandem/residuals/fields.hpp>
#include <tandem/residuals/residual_functions.hpp>

namespace tandem {

class Problem;

namespace detail {

/// A residual type in one role.
struct ResidualType {
  using Use = FunctionRef<void(const void* residual)>;
  /// Passes the members of the residual `from` through `fields`, or of a default-constructed residual if `from` is
  /// null. If `use` is not null and all fields are complete, calls it with the residual.
  using Pass = void (*)(const void* from, Fields& fields, const Use* use);
  /// Sets `stores` to the store of each state; creates those that the problem lacks.
  using StoresOf = void (*)(const ResidualType& type, Problem& problem, StateStoreBase** stores);
  /// Evaluates all blocks of a pool at the point, before the pool is read by several threads.
  using Prepare = void (*)(const PoolBase& pool, bool jacobians);

  const ResidualFunctions& functions;
  bool hard;
  Pass pass;
  StoresOf stores_of;
  Prepare prepare = nullptr;      ///< null for residuals that any thread may evaluate
  bool made_at_run_time = false;  ///< types with the same C++ type are then different types

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
/// A residual type that is made at run time, for example by a scripting language. It must outlive all problems with
/// such blocks. Problem files cannot hold its blocks.
struct RunTimeResidualType : ResidualType {
  RunTimeResidualType(const ResidualFunctions& functions, bool hard, std::vector<const GroupType*> states,
                      Prepare prepare);

  std::vector<const GroupType*> states;
};
/// Return all registered types.
std::span<const ResidualType* const> residual_types();
std::span<const GroupType* const> group_types();

template <class R>
void pass_residual(const void* from, Fields& fields, const ResidualType::Use* use) {
  if constexpr (std::default_initializable<R>) {
    R residual = from ? R(*static_cast<const R*>(from)) : R{};
    pass_fields(residual, fields);
    if (use && fields.complete()) (*use)(&residual);
  } else {
    fields.fail(typeid(R));
  }
}

}  // namespace detail
}  // namespace tandem

#pragma once

#include <concepts>
#include <span>
#include <string>
#include <typeinfo>

#include <tandem/problem/pool.hpp>
#include <tandem/residuals/fields.hpp>

namespace tandem {

class Problem;

namespace detail {

/// A type of residual in a role, or of a group's variables, that this program can make: it is known by name from the
/// program's start, so that files can be read that have some. There is one for each that is compiled, made when the
/// program starts, which registers itself.
struct ResidualType {
  /// Passes the numbers of a residual, `from` or, where that is null, one as it is made by default; where `to` is not
  /// null and all went well, a block of it is added there.
  using Pass = void (*)(const void* from, Fields& fields, PoolBase* to, const int* slots);
  using PoolOf = int (*)(Problem& problem);  ///< the pool of such blocks, made where there is none

  ResidualType(const std::type_info& type, bool hard, Pass pass, PoolOf pool_of);
  const std::type_info& type;
  bool hard;
  Pass pass;
  PoolOf pool_of;
};
struct GroupType {
  using StoreOf = StateStoreBase* (*)(Problem& problem);  ///< of such variables

  GroupType(const std::type_info& type, StoreOf store_of);
  const std::type_info& type;
  StoreOf store_of;
};
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

#pragma once

#include <tuple>

#include <tandem/problem/state_store.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// A typed handle of a variable; valid until the variable is removed (Problem::has tells), at most as long as its
/// problem, which may be moved meanwhile.
template <LieGroup G>
struct Variable {
  detail::StateStore<G>* store = nullptr;
  int slot = -1;
  unsigned generation = 0;  ///< slots are used again
};

namespace detail {

template <class States>
struct HandlesOf;
template <class... Xs>
struct HandlesOf<std::tuple<Xs...>> {
  using type = std::tuple<Variable<Xs>...>;
};

}  // namespace detail

/// The handles that residual R is given: one Variable for each state it reads.
template <Residual R>
using VariablesOf = typename detail::HandlesOf<typename R::States>::type;

/// A handle of a residual block, soft or hard; valid until the block is removed, by Problem::marginalize too.
struct Block {
  int pool = -1;
  int id = -1;
  unsigned generation = 0;  ///< ids are used again
};

}  // namespace tandem

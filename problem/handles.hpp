#pragma once

#include <tuple>

#include <tandem/problem/state_store.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Handle of a variable, typed by its group and cheap to copy. Valid until the variable is removed (see Problem::has)
/// or its problem is destroyed. Moving the problem keeps the handle valid.
template <LieGroup G>
struct Variable {
  detail::StateStore<G>* store = nullptr;
  int slot = -1;
  unsigned generation = 0;  ///< detects that the slot was reused for another variable
};

namespace detail {

template <class States>
struct HandlesOf;
template <class... Xs>
struct HandlesOf<std::tuple<Xs...>> {
  using type = std::tuple<Variable<Xs>...>;
};

}  // namespace detail

/// Handles to pass with a residual R: one Variable for each state it reads.
template <Residual R>
using VariablesOf = typename detail::HandlesOf<typename R::States>::type;

/// Handle of a residual block, soft or hard. Valid until the block is removed by Problem::remove() or
/// Problem::marginalize().
struct Block {
  int pool = -1;
  int id = -1;
  unsigned generation = 0;  ///< detects that the ID was reused for another block
};

}  // namespace tandem

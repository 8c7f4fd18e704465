#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include <tandem/lie/lie_group.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Handle of a variable without its group. It refers to nothing that can be destroyed, so an invalid handle is detected
/// at every use.
struct VariableHandle {
  std::uint64_t problem = 0;  ///< serial number of the problem; 0 if the handle was never set
  int slot = -1;              ///< ID of the variable
  unsigned generation = 0;    ///< detects that the ID was reused for another variable
  std::shared_ptr<const std::string> name;
};

/// Handle of a variable, typed by its group and cheap to copy. Valid until the variable is removed (see Problem::has).
/// It belongs to the contents of one problem: it stays valid in the problem to which they are moved, but not in a copy.
template <LieGroup G>
struct Variable : VariableHandle {
  Variable() = default;
  explicit Variable(VariableHandle handle) : VariableHandle(std::move(handle)) {}
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
/// Problem::marginalize(), in the problem that returned it, in the problem to which its contents are moved, and in
/// later copies of it.
struct Block {
  int pool = -1;
  int id = -1;
  unsigned generation = 0;      ///< detects that the ID was reused for another block
  std::uint64_t problem = 0;    ///< serial number of the problem to which the block was added; 0 if never set
  std::string_view residual{};  ///< name of the residual
};

}  // namespace tandem

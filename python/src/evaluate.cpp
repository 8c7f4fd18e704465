#include "evaluate.hpp"

#include <array>
#include <new>

#include <tandem/lie/error.hpp>

namespace tandem::python {

py::object evaluate(const FamilyResidual& residual, const py::args& states, bool jacobians) {
  std::vector<const Group*> groups;
  std::size_t count = 1;
  bool single = true;
  for (const py::handle state : states) {
    groups.push_back(group_of(state));
    if (!groups.back())
      throw py::type_error(residual.family->name + ": states are group elements such as SE3, not " +
                           std::string(py::str(py::type::of(state).attr("__name__"))));
    const auto [n, one] = groups.back()->count(state);
    count = common_size(count, single, n, one, residual.family->name);
    single = single && one;
  }
  const BoundResidual bound(residual, groups);
  count = common_size(count, single, bound.count(), bound.single(), residual.family->name);
  single = single && bound.single();

  const detail::ResidualFunctions& f = bound.instance().soft->functions;
  const auto dim = std::size_t(f.dim), arity = std::size_t(f.arity);
  Numbers rows = new_array(count, single, {f.dim});
  std::vector<Numbers> J;
  for (std::size_t s = 0; s < arity && jacobians; ++s) J.push_back(new_array(count, single, {f.dim, f.dofs[s]}));

  constexpr std::size_t kEntries = std::size_t(detail::kMaxRows) * std::size_t(detail::kMaxDofs);
  constexpr std::align_val_t kAlignment{detail::kScratchAlignment};
  const auto allocate = [&](std::size_t n) {
    return static_cast<double*>(::operator new(n * sizeof(double), kAlignment));
  };
  const auto free = [=](double* p) { ::operator delete(p, kAlignment); };
  using Memory = std::unique_ptr<double, decltype(free)>;
  const Memory r(allocate(std::size_t(detail::kMaxRows)), free);
  std::vector<Memory> scratch;
  std::array<double*, detail::kMaxStates> to{};
  for (std::size_t s = 0; s < J.size(); ++s) to[s] = scratch.emplace_back(allocate(kEntries), free).get();
  std::array<const void*, detail::kMaxStates> x{};
  constexpr std::array<int, detail::kMaxStates> all{};
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t s = 0; s < arity; ++s) x[s] = groups[s]->element(states[s], i);
    bound.make(i, [&](const void* object) {
      if (jacobians)
        f.linearize(object, x.data(), all.data(), r.get(), to.data());
      else
        f.evaluate(object, x.data(), r.get());
    });
    std::copy_n(r.get(), dim, rows.mutable_data() + i * dim);
    for (std::size_t s = 0; s < J.size(); ++s) {
      const auto dofs = std::size_t(f.dofs[s]);
      double* out = J[s].mutable_data() + i * dim * dofs;
      for (std::size_t row = 0; row < dim; ++row)
        for (std::size_t column = 0; column < dofs; ++column) *out++ = to[s][column * dim + row];
    }
  }
  if (!jacobians) return rows;
  py::list list;
  for (const Numbers& by : J) list.append(by);
  return py::make_tuple(rows, list);
}

}  // namespace tandem::python

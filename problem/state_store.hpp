#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <tandem/lie/exp_curvature.hpp>
#include <tandem/lie/lie_group.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/problem/function_ref.hpp>
#include <tandem/problem/slots.hpp>
#include <tandem/problem/symmetric_pattern.hpp>
#include <tandem/residuals/fields.hpp>

namespace tandem::detail {

/// Points and charts of the variables of one group, for reading without its C++ type. Valid until a variable is added.
struct StateView {
  const std::byte* points;
  std::size_t size;      ///< size of a point [bytes]
  const double* charts;  ///< null if the charts are the identity
  int dof;

  const void* point(int slot) const { return points + std::size_t(slot) * size; }
  const double* chart(int slot) const { return charts ? charts + std::ptrdiff_t(slot) * dof * dof : nullptr; }
};

using VariableName = std::shared_ptr<const std::string>;

/// All variables of one group, stored contiguously. Each variable has a value X̄ and a point X = X̄ ⊕ δ that a solver
/// moves. The chart of a variable is dX/dδ = Jr(δ), for right perturbations of X.
class StateStoreBase {
 public:
  virtual ~StateStoreBase() = default;
  /// Returns the number of slots, used or free.
  virtual int size() const = 0;
  virtual int dof() const = 0;
  virtual StateView view() const = 0;

  // The following methods process the slots begin … end − 1.

  /// Sets point = value ⊕ δ for each free variable. `offsets` gives the first entry of each variable in `delta`,
  /// negative if fixed.
  virtual void move(const double* delta, const std::vector<int>& offsets, int begin, int end) = 0;
  /// Computes the charts at the current δ. Call begin_charts() first.
  virtual void chart_point(int begin, int end) = 0;
  /// Adds the second derivatives of the charts to the diagonal blocks of a Hessian with respect to δ. `gradient` is
  /// with respect to perturbations of the point. `blocks` gives the block of each variable in the pattern, negative if
  /// fixed.
  virtual void add_chart_curvature(const double* gradient, const std::vector<int>& blocks,
                                   const SymmetricPattern& pattern, int begin, int end, double* H) const = 0;

  /// Sets value = point and δ = 0.
  virtual void recenter(int begin, int end) = 0;

  /// Allocates the charts. Later derivatives are with respect to δ.
  virtual void begin_charts() = 0;
  /// Sets point = value.
  virtual void reset() = 0;
  /// save() stores a copy of all values. restore() sets them to this copy.
  virtual void save() = 0;
  virtual void restore() = 0;
  /// Returns the largest rotation angle between value and point [rad].
  virtual double largest_angle() const = 0;
  /// Returns whether a tangent entry is a rotation.
  virtual bool is_rotation(int entry) const = 0;
  /// Removes a variable. Its slot is reused.
  virtual void remove(int slot) = 0;
  /// Returns an empty store of the same group.
  virtual std::unique_ptr<StateStoreBase> new_empty() const = 0;
  /// Adds a variable with the value of a variable of `from`, a store of the same group. Returns its slot.
  virtual int add_copy(const StateStoreBase& from, int slot, int variable_id) = 0;
  /// Returns a copy with the same slots and values; points are reset.
  virtual std::unique_ptr<StateStoreBase> copy() const = 0;
  /// Adds a variable at the identity. Returns its slot.
  virtual int add_identity(int variable_id, VariableName name) = 0;
  /// Write a variable's value or anchor to `fields`, or read it from there. Reading a value also sets the point.
  virtual void pass_value(int slot, Fields& fields) = 0;
  virtual void pass_anchor(int slot, Fields& fields) = 0;
  /// Sets a value to that of a variable of `from`, a store of the same group.
  virtual void copy_value(const StateStoreBase& from, int from_slot, int slot) = 0;
  /// Moves a value as that of a variable moved from `before` to `after`, stores of the same group: x becomes
  /// x before⁻¹ after.
  virtual void move_value(const StateStoreBase& before, const StateStoreBase& after, int from_slot, int slot) = 0;
  /// Sets the anchor of a variable to its value.
  virtual void set_anchor(int slot) = 0;
  /// Computes x = Log(anchor⁻¹ point) and, if J is not null, its Jacobian with respect to the unknowns: dof × dof,
  /// column-major.
  virtual void anchor_difference(int slot, double* x, double* J) const = 0;
  /// Computes the same with one entry of δ increased by `step`. J is with respect to δ.
  virtual void perturbed_anchor_difference(int slot, int entry, double step, double* x, double* J) const = 0;

  /// Calls f with the point, with one entry of δ increased by `step`, and Jr there.
  virtual void with_perturbed(int slot, int entry, double step,
                              FunctionRef<void(const void* point, const double* chart)> f) const = 0;

  std::vector<int> id;   ///< variable ID of each slot, −1 if free
  bool charted = false;  ///< derivatives are with respect to δ; otherwise to perturbations of the point
  /// Name of each variable by slot, null if the slot is free. Handles of a variable and of its counterparts in copies
  /// of the problem share one object, which identifies them.
  std::vector<VariableName> name;
};

template <LieGroup G>
class StateStore final : public StateStoreBase {
 public:
  std::vector<G> value, point, saved;
  std::vector<typename G::Tangent> delta;
  std::vector<typename G::Jacobian> chart;  ///< Jr(delta); valid only if `charted`
  std::vector<G> anchor;                    ///< linearisation point of each variable that a MarginalPrior reads
  Slots slots;

  int add(const G& x, int variable_id, VariableName variable_name) {
    const int slot = slots.allocate();
    if (slot == static_cast<int>(value.size())) {
      value.push_back(x);
      point.push_back(x);
      delta.push_back(G::Tangent::Zero());
      id.push_back(variable_id);
      name.emplace_back();
    }
    value[std::size_t(slot)] = point[std::size_t(slot)] = x;
    id[std::size_t(slot)] = variable_id;
    name[std::size_t(slot)] = std::move(variable_name);
    return slot;
  }
  void remove(int slot) override {
    id[std::size_t(slot)] = -1;
    name[std::size_t(slot)].reset();
    delta[std::size_t(slot)].setZero();
    slots.release(slot);
  }

  std::unique_ptr<StateStoreBase> new_empty() const override { return std::make_unique<StateStore>(); }
  int add_copy(const StateStoreBase& from, int slot, int variable_id) override {
    return add(static_cast<const StateStore&>(from).value[std::size_t(slot)], variable_id,
               from.name[std::size_t(slot)]);
  }
  std::unique_ptr<StateStoreBase> copy() const override {
    auto store = std::make_unique<StateStore>(*this);
    store->reset();
    return store;
  }
  int add_identity(int variable_id, VariableName variable_name) override {
    return add(G::identity(), variable_id, std::move(variable_name));
  }
  void pass_value(int slot, Fields& fields) override {
    pass_fields(value[std::size_t(slot)], fields);
    if (fields.reads()) point[std::size_t(slot)] = value[std::size_t(slot)];
  }
  void pass_anchor(int slot, Fields& fields) override {
    anchor.resize(value.size());
    pass_fields(anchor[std::size_t(slot)], fields);
  }
  void copy_value(const StateStoreBase& from, int from_slot, int slot) override {
    value[std::size_t(slot)] = point[std::size_t(slot)] =
        static_cast<const StateStore&>(from).value[std::size_t(from_slot)];
  }
  void move_value(const StateStoreBase& before, const StateStoreBase& after, int from_slot, int slot) override {
    const G& from = static_cast<const StateStore&>(before).value[std::size_t(from_slot)];
    const G& to = static_cast<const StateStore&>(after).value[std::size_t(from_slot)];
    value[std::size_t(slot)] = point[std::size_t(slot)] = value[std::size_t(slot)] * (from.inverse() * to);
  }

  int size() const override { return static_cast<int>(value.size()); }
  int dof() const override { return G::dof; }
  StateView view() const override {
    static_assert(sizeof(typename G::Jacobian) == sizeof(double) * G::dof * G::dof);
    return {reinterpret_cast<const std::byte*>(point.data()), sizeof(G),
            charted && !chart.empty() ? chart.front().data() : nullptr, G::dof};
  }
  void move(const double* d, const std::vector<int>& offsets, int begin, int end) override {
    for (std::size_t i = std::size_t(begin); i < std::size_t(end); ++i) {
      const int offset = id[i] < 0 ? -1 : offsets[static_cast<std::size_t>(id[i])];
      if (offset < 0) continue;
      delta[i] = Eigen::Map<const typename G::Tangent>(d + offset);
      point[i] = value[i] * G::Exp(delta[i]);
    }
  }
  void begin_charts() override {
    chart.resize(value.size());
    charted = true;
  }
  void chart_point(int begin, int end) override {
    for (std::size_t i = std::size_t(begin); i < std::size_t(end); ++i) chart[i] = G::Jr(delta[i]);
  }
  void add_chart_curvature(const double* gradient, const std::vector<int>& blocks, const SymmetricPattern& pattern,
                           int begin, int end, double* H) const override {
    if constexpr (HasExpCurvature<G>) {
      for (std::size_t i = std::size_t(begin); i < std::size_t(end) && charted; ++i) {
        const int block = id[i] < 0 ? -1 : blocks[std::size_t(id[i])];
        if (block < 0) continue;
        const typename G::Tangent g =
            Eigen::Map<const typename G::Tangent>(gradient + pattern.first[std::size_t(block)]);
        const typename G::Jacobian C = ExpCurvature<G>::hessian(delta[i], g);
        for (int k = 0; k < G::dof; ++k)
          for (int j = 0; j < G::dof; ++j) H[pattern.diagonal(block, k) - k + j] += C(j, k);
      }
    }
  }
  void recenter(int begin, int end) override {
    for (std::size_t i = std::size_t(begin); i < std::size_t(end); ++i) {
      value[i] = point[i];
      delta[i].setZero();
    }
  }
  void reset() override {
    point = value;
    for (auto& d : delta) d.setZero();
    charted = false;
  }
  void save() override { saved = value; }
  void restore() override { value = saved; }
  bool is_rotation(int entry) const override { return G::angle(G::Tangent::Unit(entry)) > 0; }
  double largest_angle() const override {
    double largest = 0;
    for (const auto& d : delta) largest = std::max(largest, G::angle(d));
    return largest;
  }

  void set_anchor(int slot) override {
    anchor.resize(value.size());
    anchor[std::size_t(slot)] = value[std::size_t(slot)];
  }
  void anchor_difference(int slot, double* x, double* J) const override {
    const std::size_t i = std::size_t(slot);
    const typename G::Tangent v = (anchor[i].inverse() * point[i]).Log();
    Eigen::Map<typename G::Tangent> to(x);
    to = v;
    if (!J) return;
    Eigen::Map<typename G::Jacobian> by(J);
    if (charted) {
      by = G::Jr_inverse(v) * chart[i];
    } else {
      by = G::Jr_inverse(v);
    }
  }
  void perturbed_anchor_difference(int slot, int entry, double step, double* x, double* J) const override {
    const std::size_t i = std::size_t(slot);
    typename G::Tangent d = delta[i];
    d[entry] += step;
    const typename G::Tangent v = (anchor[i].inverse() * value[i] * G::Exp(d)).Log();
    Eigen::Map<typename G::Tangent> to(x);
    Eigen::Map<typename G::Jacobian> by(J);
    to = v;
    by = G::Jr_inverse(v) * G::Jr(d);
  }

  void with_perturbed(int slot, int entry, double step,
                      FunctionRef<void(const void* point, const double* chart)> f) const override {
    typename G::Tangent d = delta[std::size_t(slot)];
    d[entry] += step;
    const G moved = value[std::size_t(slot)] * G::Exp(d);
    const typename G::Jacobian by_delta = G::Jr(d);
    f(&moved, by_delta.data());
  }
};

extern template class StateStore<SE3>;
extern template class StateStore<SE2>;
extern template class StateStore<SO3>;
extern template class StateStore<SO2>;
extern template class StateStore<Rn<1>>;
extern template class StateStore<Rn<2>>;
extern template class StateStore<Rn<3>>;
extern template class StateStore<Rn<6>>;

}  // namespace tandem::detail

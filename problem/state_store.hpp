#pragma once

#include <algorithm>
#include <vector>

#include <tandem/lie/lie_group.hpp>

namespace tandem::detail {

/// All variables of one group, side by side. A solver moves the `point` in the chart around `value`:
/// point = value ⊕ delta, with dX/dδ = Jr(delta) in `chart` once `charted`.
class StateStoreBase {
 public:
  virtual ~StateStoreBase() = default;
  /// point = value ⊕ delta, each variable's part of `delta` standing at its offset; fixed ones have a negative offset.
  virtual void move(const double* delta, const std::vector<int>& offsets) = 0;
  /// Fills `chart` for the delta of the last move.
  virtual void chart_point() = 0;
  /// value = point: the chart is centred there.
  virtual void recenter() = 0;
  /// point = value.
  virtual void reset() = 0;
  /// Remembers `value`, and gives it back.
  virtual void keep() = 0;
  virtual void restore() = 0;
  /// The largest angle that a variable turns between value and point [rad].
  virtual double largest_angle() const = 0;
  /// Whether an entry of the tangent is a rotation.
  virtual bool turns(int entry) const = 0;

  bool charted = false;  ///< derivatives are with respect to delta, else to perturbations of the point
};

template <LieGroup G>
class StateStore final : public StateStoreBase {
 public:
  std::vector<G> value, point, kept;
  std::vector<typename G::Tangent> delta;
  std::vector<typename G::Jacobian> chart;  ///< Jr(delta); read only when `charted`
  std::vector<int> id;                      ///< of the variable in its problem

  void add(const G& x, int variable_id) {
    value.push_back(x);
    point.push_back(x);
    delta.push_back(G::Tangent::Zero());
    id.push_back(variable_id);
  }

  void move(const double* d, const std::vector<int>& offsets) override {
    charted = false;
    for (std::size_t i = 0; i < value.size(); ++i) {
      const int offset = offsets[static_cast<std::size_t>(id[i])];
      if (offset < 0) continue;
      delta[i] = Eigen::Map<const typename G::Tangent>(d + offset);
      point[i] = value[i] * G::Exp(delta[i]);
    }
  }
  void chart_point() override {
    chart.resize(value.size());
    for (std::size_t i = 0; i < value.size(); ++i) chart[i] = G::Jr(delta[i]);
    charted = true;
  }
  void recenter() override {
    value = point;
    for (auto& d : delta) d.setZero();
    charted = false;
  }
  void reset() override {
    point = value;
    for (auto& d : delta) d.setZero();
    charted = false;
  }
  void keep() override { kept = value; }
  void restore() override { value = kept; }
  bool turns(int entry) const override { return G::angle(G::Tangent::Unit(entry)) > 0; }
  double largest_angle() const override {
    double largest = 0;
    for (const auto& d : delta) largest = std::max(largest, G::angle(d));
    return largest;
  }
};

}  // namespace tandem::detail

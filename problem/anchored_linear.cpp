#include <algorithm>

#include <tandem/problem/anchored_linear.hpp>

namespace tandem::detail {

void AnchoredLinear::set(std::vector<AnchoredState> states, Eigen::MatrixXd A, Eigen::VectorXd b) {
  has_block_ = true;
  states_ = std::move(states);
  A_ = std::move(A);
  b_ = std::move(b);
  ids_.clear();
  dofs_.clear();
  first_.clear();
  first_jacobian_.clear();
  int columns = 0, entries = 0, widest = 0;
  for (const AnchoredState& s : states_) {
    s.store->set_anchor(s.slot);
    ids_.push_back(s.id);
    dofs_.push_back(s.dof);
    first_.push_back(columns);
    first_jacobian_.push_back(entries);
    columns += s.dof;
    entries += s.dof * s.dof;
    widest = std::max(widest, s.dof);
  }
  x_.resize(columns);
  r_.resize(b_.size());
  w_.resize(b_.size());
  g_.resize(columns);
  J_.resize(entries);
  column_.resize(widest);
}

void AnchoredLinear::clear() {
  has_block_ = false;
  states_.clear();
  ids_.clear();
  A_.resize(0, 0);
  b_.resize(0);
}

void AnchoredLinear::use_stores(const StoreMapping& mapping) {
  for (AnchoredState& s : states_) s.store = mapping(s.store);
}

const Eigen::VectorXd& AnchoredLinear::evaluate(const int* offset) const {
  for (std::size_t s = 0; s < states_.size(); ++s)
    states_[s].store->anchor_difference(states_[s].slot, x_.data() + first_[s],
                                        offset && offset[s] >= 0 ? J_.data() + first_jacobian_[s] : nullptr);
  r_ = b_;
  r_.noalias() += A_ * x_;
  return r_;
}

void AnchoredLinear::linearize(const int* offset, double* r, double* J) const {
  const std::vector<int> all(states_.size(), 0);
  if (!offset) offset = all.data();
  evaluate(offset);
  std::copy_n(r_.data(), r_.size(), r);
  for (std::size_t s = 0; s < states_.size(); ++s) {
    Eigen::MatrixXd by_state = Eigen::MatrixXd::Zero(rows(), states_[s].dof);
    if (offset[s] >= 0) by_state = A_.middleCols(first_[s], states_[s].dof) * jacobian(s);
    J = std::copy_n(by_state.data(), by_state.size(), J);
  }
}

void AnchoredLinear::add_second_derivatives(const PoolPlacement& place, double factor,
                                            FunctionRef<void(const Eigen::VectorXd& r, Eigen::VectorXd& w)> dual,
                                            double* H) const {
  constexpr double h = kGradientStep;
  for (std::size_t b = 0; b < states_.size(); ++b) {
    if (place.offset[b] < 0) continue;
    const AnchoredState& moved = states_[b];
    for (int k = 0; k < moved.dof; ++k) {
      for (const double step : {h, -h}) {
        evaluate(place.offset.data());
        moved.store->perturbed_anchor_difference(moved.slot, k, step, x_.data() + first_[b],
                                                 J_.data() + first_jacobian_[b]);
        r_ = b_;
        r_.noalias() += A_ * x_;
        dual(r_, w_);
        g_.noalias() = A_.transpose() * w_;
        for (std::size_t a = 0; a < states_.size(); ++a) {
          if (place.offset[a] < 0) continue;
          const int n = states_[a].dof;
          auto column = column_.head(n);
          column.noalias() = jacobian(a).transpose() * g_.segment(first_[a], n);
          column *= 0.5 * factor / (2 * step);
          const std::size_t high = std::max(a, b), low = std::min(a, b);
          const HessianPlace& at = place.hessian[high * (high + 1) / 2 + low];
          const int stride = int(at.stride);
          const bool row_is_a = (high == a) != bool(at.transposed);
          // Each ordered pair of entries occurs twice. Adding half of each keeps the Hessian symmetric.
          for (int m = 0; m < n; ++m) {
            if (row_is_a) H[at.position + k * stride + m] += column[m];
            if (!row_is_a || a == b) H[at.position + m * stride + k] += column[m];
          }
        }
      }
    }
  }
}

}  // namespace tandem::detail

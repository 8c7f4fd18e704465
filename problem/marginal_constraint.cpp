#include <algorithm>

#include <tandem/problem/marginal_constraint.hpp>

namespace tandem::detail {

void MarginalConstraint::set(std::vector<AnchoredState> states, Eigen::MatrixXd A, Eigen::VectorXd b) {
  linear_.set(std::move(states), std::move(A), std::move(b));
  const std::vector<double> zero(std::size_t(dim()), 0.0);
  add_bounds(zero.data(), zero.data());
}

std::unique_ptr<HardPoolBase> MarginalConstraint::copy(const StoreMapping& mapping) const {
  auto constraint = std::make_unique<MarginalConstraint>(*this);
  constraint->linear_.use_stores(mapping);
  return constraint;
}

void MarginalConstraint::evaluate_block(int, double* r) const {
  const Eigen::VectorXd& rows = linear_.evaluate(nullptr);
  std::copy_n(rows.data(), rows.size(), r);
}

void MarginalConstraint::values(const PoolPlacement&, int begin, int end, double* c) const {
  if (begin < end) evaluate_block(begin, c);
}

void MarginalConstraint::jacobian(const PoolPlacement& place, int begin, int end, double* c, double* values) const {
  if (begin >= end) return;
  const Eigen::VectorXd& rows = linear_.evaluate(place.offset.data());
  if (c) std::copy_n(rows.data(), rows.size(), c);
  double* to = values + place.jacobian[0];
  for (std::size_t s = 0; s < linear_.states().size(); ++s) {
    if (place.offset[s] < 0) continue;
    Eigen::Map<Eigen::MatrixXd> by_state(to, dim(), dofs()[s]);
    by_state.noalias() = linear_.A().middleCols(linear_.first()[s], dofs()[s]) * linear_.jacobian(s);
    to += by_state.size();
  }
}

void MarginalConstraint::accumulate(const PoolPlacement& place, int begin, int end, const double* weights,
                                    const double* jacobian, double* H) const {
  if (begin >= end) return;
  const int rows = dim(), states = arity();
  std::vector<const double*> of_state(std::size_t(states), nullptr);
  const double* next = jacobian + place.jacobian[0];
  for (int s = 0; s < states; ++s) {
    if (place.offset[std::size_t(s)] < 0) continue;
    of_state[std::size_t(s)] = next;
    next += rows * dofs()[s];
  }
  for (int a = 0, pair = 0; a < states; ++a)
    for (int b = 0; b <= a; ++b, ++pair) {
      const double *A = of_state[std::size_t(a)], *B = of_state[std::size_t(b)];
      if (!A || !B) continue;
      const HessianPlace& at = place.hessian[std::size_t(pair)];
      for (int j = 0; j < dofs()[b]; ++j)
        for (int i = 0; i < dofs()[a]; ++i) {
          double sum = 0;
          for (int row = 0; row < rows; ++row) sum += weights[row] * A[i * rows + row] * B[j * rows + row];
          H[at.position + (at.transposed ? i * int(at.stride) + j : j * int(at.stride) + i)] += sum;
        }
    }
}

void MarginalConstraint::add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature, double factor,
                                           const double* multipliers, double*, double* H) const {
  if (begin == end) return;
  const Eigen::Map<const Eigen::VectorXd> y(multipliers, dim());
  linear_.add_second_derivatives(
      place, factor, [&](const Eigen::VectorXd&, Eigen::VectorXd& w) { w = y; }, H);
}

}  // namespace tandem::detail

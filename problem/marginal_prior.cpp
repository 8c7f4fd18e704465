#include <algorithm>

#include <tandem/problem/marginal_prior.hpp>

namespace tandem::detail {
namespace {

/// Adds factor Jaᵀ M Jb, or its transpose, to a column-major block. N is the size if it is a common one. `scratch` has
/// room for two blocks.
template <int N, class Ja, class M, class Jb>
void add_product(const Ja& a, const M& m, const Jb& b, double factor, double* to, int stride, bool transposed,
                 double* scratch) {
  using Block = Eigen::Matrix<double, N, N>;
  Eigen::Map<Block> half(scratch, m.rows(), m.cols()), product(scratch + m.size(), m.rows(), m.cols());
  half = m.lazyProduct(b);
  product = factor * a.transpose().lazyProduct(half);
  const Eigen::OuterStride<> by(stride);
  if (transposed) {
    Eigen::Map<Block, 0, Eigen::OuterStride<>>(to, m.cols(), m.rows(), by) += product.transpose();
  } else {
    Eigen::Map<Block, 0, Eigen::OuterStride<>>(to, m.rows(), m.cols(), by) += product;
  }
}

}  // namespace

void MarginalPrior::set(std::vector<State> states, Eigen::MatrixXd A, Eigen::VectorXd b, double constant) {
  has_block_ = true;
  states_ = std::move(states);
  A_ = std::move(A);
  b_ = std::move(b);
  constant_ = constant;
  information_.noalias() = A_.transpose() * A_;
  ids_.clear();
  dofs_.clear();
  first_.clear();
  first_jacobian_.clear();
  int columns = 0, entries = 0, widest = 0;
  for (const State& s : states_) {
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
  g_.resize(columns);
  J_.resize(entries);
  scratch_.resize(2 * widest * widest);
}

std::unique_ptr<SoftPoolBase> MarginalPrior::copy(const StoreMapping& mapping) const {
  auto prior = std::make_unique<MarginalPrior>(*this);
  for (State& s : prior->states_) s.store = mapping(s.store);
  return prior;
}

void MarginalPrior::remove(int) {
  has_block_ = false;
  states_.clear();
  ids_.clear();
  A_.resize(0, 0);
  b_.resize(0);
}

/// Computes x and r and returns the cost at the point. If `offset` is given, also computes the Jacobians of the free
/// states.
double MarginalPrior::residual(const int* offset) const {
  for (std::size_t s = 0; s < states_.size(); ++s)
    states_[s].store->anchor_difference(states_[s].slot, x_.data() + first_[s],
                                        offset && offset[s] >= 0 ? J_.data() + first_jacobian_[s] : nullptr);
  r_ = b_;
  r_.noalias() += A_ * x_;
  return 0.5 * r_.squaredNorm() + constant_;
}

void MarginalPrior::evaluate_block(int, double* r) const {
  residual(nullptr);
  std::copy_n(r_.data(), r_.size(), r);
}

void MarginalPrior::linearize_block(int, const int* offset, double* r, double* J) const {
  const std::vector<int> all(states_.size(), 0);
  if (!offset) offset = all.data();
  residual(offset);
  std::copy_n(r_.data(), r_.size(), r);
  for (std::size_t s = 0; s < states_.size(); ++s) {
    Eigen::MatrixXd by_state = Eigen::MatrixXd::Zero(dim(), states_[s].dof);
    if (offset[s] >= 0) by_state = A_.middleCols(first_[s], states_[s].dof) * jacobian(s);
    J = std::copy_n(by_state.data(), by_state.size(), J);
  }
}

double MarginalPrior::block_cost(int) const { return residual(nullptr); }

double MarginalPrior::accumulate(const PoolPlacement& place, int begin, int end, double* gradient, double* H) const {
  if (begin >= end) return 0;
  const double cost = residual(place.offset.data());
  g_.noalias() = A_.transpose() * r_;
  for (std::size_t s = 0; s < states_.size(); ++s)
    if (const int offset = place.offset[s]; offset >= 0)
      Eigen::Map<Eigen::VectorXd>(gradient + offset, states_[s].dof).noalias() +=
          jacobian(s).transpose() * g_.segment(first_[s], states_[s].dof);
  if (H) add_products(place, 1.0, H);
  return cost;
}

/// Adds factor Jᵀ AᵀA J to the Hessian.
void MarginalPrior::add_products(const PoolPlacement& place, double factor, double* H) const {
  std::size_t pair = 0;
  for (std::size_t a = 0; a < states_.size(); ++a)
    for (std::size_t b = 0; b <= a; ++b, ++pair) {
      const int at_a = place.offset[a], at_b = place.offset[b];
      if (at_a < 0 || at_b < 0) continue;
      const int m = states_[a].dof, n = states_[b].dof;
      const auto information = information_.block(first_[a], first_[b], m, n);
      double* to = H + place.hessian[pair].position;
      const int stride = int(place.hessian[pair].stride);
      const bool transposed = place.hessian[pair].transposed;
      if (m == 6 && n == 6) {
        add_product<6>(jacobian(a), information, jacobian(b), factor, to, stride, transposed, scratch_.data());
      } else if (m == 3 && n == 3) {
        add_product<3>(jacobian(a), information, jacobian(b), factor, to, stride, transposed, scratch_.data());
      } else {
        add_product<Eigen::Dynamic>(jacobian(a), information, jacobian(b), factor, to, stride, transposed,
                                    scratch_.data());
      }
    }
}

void MarginalPrior::add_stiffness(const PoolPlacement& place, const double* v, const double*, double& along,
                                  double& scale) const {
  if (!has_block_) return;
  residual(place.offset.data());
  r_.setZero();  // A J v
  for (std::size_t s = 0; s < states_.size(); ++s) {
    if (place.offset[s] < 0) continue;
    const int n = states_[s].dof;
    const Eigen::Map<const Eigen::VectorXd> part(v + place.offset[s], n);
    const auto J = jacobian(s);
    g_.head(n).noalias() = J * part;
    r_.noalias() += A_.middleCols(first_[s], n) * g_.head(n);
    const auto information = information_.block(first_[s], first_[s], n, n);
    for (int k = 0; k < n; ++k) {  // ‖A J eₖ‖²
      scratch_.head(n).noalias() = information.lazyProduct(J.col(k));
      scale += part[k] * part[k] * J.col(k).dot(scratch_.head(n));
    }
  }
  along += r_.squaredNorm();
}

void MarginalPrior::add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature wanted, double factor,
                                      const double*, double*, double* H) const {
  constexpr double h = kGradientStep;
  if (begin == end) return;
  if (wanted == Curvature::beyond_gauss_newton) {
    residual(place.offset.data());
    add_products(place, -factor, H);
  }
  for (std::size_t b = 0; b < states_.size(); ++b) {
    if (place.offset[b] < 0) continue;
    const State& moved = states_[b];
    for (int k = 0; k < moved.dof; ++k) {
      for (const double step : {h, -h}) {
        residual(place.offset.data());
        moved.store->perturbed_anchor_difference(moved.slot, k, step, x_.data() + first_[b],
                                                 J_.data() + first_jacobian_[b]);
        r_ = b_;
        r_.noalias() += A_ * x_;
        g_.noalias() = A_.transpose() * r_;
        for (std::size_t a = 0; a < states_.size(); ++a) {
          if (place.offset[a] < 0) continue;
          const int n = states_[a].dof;
          auto column = scratch_.head(n);
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

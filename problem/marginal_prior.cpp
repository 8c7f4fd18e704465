#include <algorithm>

#include <tandem/problem/marginal_prior.hpp>

namespace tandem::detail {
namespace {

/// Adds factor Jaᵀ M Jb, or its transpose, to a column-major block. N is the size of the block, or Eigen::Dynamic.
/// `scratch` has room for two blocks.
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

void MarginalPrior::set(std::vector<AnchoredState> states, Eigen::MatrixXd A, Eigen::VectorXd b, double constant) {
  linear_.set(std::move(states), std::move(A), std::move(b));
  constant_ = constant;
  information_.noalias() = linear_.A().transpose() * linear_.A();
  r_.resize(dim());
  g_.resize(linear_.A().cols());
  int widest = 0;
  for (const int dof : linear_.dofs()) widest = std::max(widest, dof);
  scratch_.resize(2 * widest * widest);
}

std::unique_ptr<SoftPoolBase> MarginalPrior::copy(const StoreMapping& mapping) const {
  auto prior = std::make_unique<MarginalPrior>(*this);
  prior->linear_.use_stores(mapping);
  return prior;
}

void MarginalPrior::evaluate_block(int, double* r) const {
  const Eigen::VectorXd& rows = linear_.evaluate(nullptr);
  std::copy_n(rows.data(), rows.size(), r);
}

double MarginalPrior::block_cost(int) const { return cost_of(linear_.evaluate(nullptr)); }

double MarginalPrior::accumulate(const PoolPlacement& place, int begin, int end, double* gradient, double* H) const {
  if (begin >= end) return 0;
  const Eigen::VectorXd& r = linear_.evaluate(place.offset.data());
  g_.noalias() = linear_.A().transpose() * r;
  for (std::size_t s = 0; s < linear_.states().size(); ++s)
    if (const int offset = place.offset[s]; offset >= 0)
      Eigen::Map<Eigen::VectorXd>(gradient + offset, linear_.dofs()[s]).noalias() +=
          linear_.jacobian(s).transpose() * g_.segment(linear_.first()[s], linear_.dofs()[s]);
  if (H) add_products(place, 1.0, H);
  return cost_of(r);
}

/// Adds factor Jᵀ AᵀA J to the Hessian.
void MarginalPrior::add_products(const PoolPlacement& place, double factor, double* H) const {
  std::size_t pair = 0;
  for (std::size_t a = 0; a < linear_.states().size(); ++a)
    for (std::size_t b = 0; b <= a; ++b, ++pair) {
      const int at_a = place.offset[a], at_b = place.offset[b];
      if (at_a < 0 || at_b < 0) continue;
      const int m = linear_.dofs()[a], n = linear_.dofs()[b];
      const auto information = information_.block(linear_.first()[a], linear_.first()[b], m, n);
      double* to = H + place.hessian[pair].position;
      const int stride = int(place.hessian[pair].stride);
      const bool transposed = place.hessian[pair].transposed;
      if (m == 6 && n == 6) {
        add_product<6>(linear_.jacobian(a), information, linear_.jacobian(b), factor, to, stride, transposed,
                       scratch_.data());
      } else if (m == 3 && n == 3) {
        add_product<3>(linear_.jacobian(a), information, linear_.jacobian(b), factor, to, stride, transposed,
                       scratch_.data());
      } else {
        add_product<Eigen::Dynamic>(linear_.jacobian(a), information, linear_.jacobian(b), factor, to, stride,
                                    transposed, scratch_.data());
      }
    }
}

void MarginalPrior::add_stiffness(const PoolPlacement& place, const double* v, const double*, double& along,
                                  double& scale) const {
  if (linear_.size() == 0) return;
  linear_.evaluate(place.offset.data());
  r_.setZero();  // A J v
  for (std::size_t s = 0; s < linear_.states().size(); ++s) {
    if (place.offset[s] < 0) continue;
    const int n = linear_.dofs()[s];
    const Eigen::Map<const Eigen::VectorXd> part(v + place.offset[s], n);
    const auto J = linear_.jacobian(s);
    g_.head(n).noalias() = J * part;
    r_.noalias() += linear_.A().middleCols(linear_.first()[s], n) * g_.head(n);
    const auto information = information_.block(linear_.first()[s], linear_.first()[s], n, n);
    for (int k = 0; k < n; ++k) {  // ‖A J eₖ‖²
      scratch_.head(n).noalias() = information.lazyProduct(J.col(k));
      scale += part[k] * part[k] * J.col(k).dot(scratch_.head(n));
    }
  }
  along += r_.squaredNorm();
}

void MarginalPrior::add_exact_hessian(const PoolPlacement& place, int begin, int end, Curvature wanted, double factor,
                                      const double*, double*, double* H) const {
  if (begin == end) return;
  if (wanted == Curvature::beyond_gauss_newton) {
    linear_.evaluate(place.offset.data());
    add_products(place, -factor, H);
  }
  linear_.add_second_derivatives(
      place, factor, [](const Eigen::VectorXd& r, Eigen::VectorXd& w) { w = r; }, H);
}

}  // namespace tandem::detail

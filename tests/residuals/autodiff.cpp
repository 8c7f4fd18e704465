#include "residuals/autodiff.hpp"

namespace tandem {

template class BasicSEK3<1, testing::Jet>;
template class BasicSE2<testing::Jet>;

}  // namespace tandem

namespace tandem::testing {

double autodiff_error(const Eigen::VectorXd& r, const Eigen::MatrixXd& J, const std::vector<int>& dofs,
                      const std::function<void(int state, int k, Jet* dual)>& along) {
  const double scale = std::max(1e-300, J.cwiseAbs().maxCoeff());
  std::vector<Jet> dual(std::size_t(r.size()));
  double worst = 0.0;
  for (int state = 0, column = 0; state < int(dofs.size()); ++state)
    for (int k = 0; k < dofs[std::size_t(state)]; ++k, ++column) {
      along(state, k, dual.data());
      for (int row = 0; row < r.size(); ++row) {
        const Jet& d = dual[std::size_t(row)];
        const bool same = std::abs(d.a - r[row]) <= 1e-13 * (1.0 + r.norm());
        const double error = std::abs(d.v[0] - J(row, column)) / scale;
        if (!same || !(error <= worst))
          worst = same && !std::isnan(error) ? error : std::numeric_limits<double>::infinity();
      }
    }
  return worst;
}

}  // namespace tandem::testing

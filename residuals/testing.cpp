#include <array>
#include <sstream>

#include <tandem/residuals/testing.hpp>

namespace tandem::detail {

using Rows = Eigen::VectorXd;

std::pair<Rows, double> differentiate(int rows, const std::function<void(double h, double* f)>& f, double scale) {
  constexpr int columns = 5, steps = 24;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::pair best(Rows(Rows::Constant(rows, kInfinity)), kInfinity);
  std::array<Rows, columns> now, before;
  Rows ahead(rows), behind(rows);
  double h = 0.125;
  for (int step = 0; step < steps; ++step, h *= 0.5, before = now) {
    f(h, ahead.data());
    f(-h, behind.data());
    const double rounding = 4e-15 * std::max(scale, ahead.cwiseAbs().maxCoeff()) / h;
    now[0] = (ahead - behind) / (2.0 * h);
    for (int m = 1; m <= std::min(step, columns - 1); ++m) {
      now[m] = now[m - 1] + (now[m - 1] - before[m - 1]) / (std::pow(4.0, m) - 1.0);
      const double change = std::max((now[m] - now[m - 1]).norm(), (now[m] - before[m - 1]).norm());
      if (rounding + change < best.second) best = {now[m], rounding + change};
    }
  }
  return best;
}

namespace {

template <class A, class B>
bool same(const A& a, const B& b) {
  return (a - b).norm() <= 1e-12 * (1.0 + b.norm());  // false for NaN
}

}  // namespace

JacobianReport check_jacobians(const ResidualAt& residual) {
  const int rows = residual.rows, count = int(residual.dofs.size());
  int width = 0;
  for (const int dof : residual.dofs) width += dof;
  Rows r(rows), value(rows);
  Eigen::MatrixXd J(rows, width), some(rows, width);

  JacobianReport report;
  const unsigned all = (1u << count) - 1u;
  residual.evaluate(all, r.data(), J.data());
  for (unsigned wanted = 0; wanted <= all; ++wanted) {
    residual.evaluate(wanted, value.data(), some.data());
    const char* culprit = same(value, r) ? nullptr : ": the value";
    for (int state = 0, first = 0; state < count; first += residual.dofs[std::size_t(state++)]) {
      const int dof = residual.dofs[std::size_t(state)];
      if (wanted >> state & 1u && !same(some.middleCols(first, dof), J.middleCols(first, dof)))
        culprit = ": a Jacobian";
    }
    if (!culprit) continue;
    report.relative = report.absolute = std::numeric_limits<double>::infinity();
    report.text = std::string(residual.name) + culprit + " is not finite or depends on which Jacobians are requested";
    return report;
  }
  const double scale = std::max(std::numeric_limits<double>::min(), J.cwiseAbs().maxCoeff());
  for (int state = 0, first = 0; state < count; first += residual.dofs[std::size_t(state++)])
    for (int k = 0; k < residual.dofs[std::size_t(state)]; ++k) {
      const auto along = [&](double h, double* value) { residual.along(state, k, h, value); };
      const auto [slope, uncertainty] = differentiate(rows, along, scale);
      for (int i = 0; i < rows; ++i) {
        const double given = J(i, first + k), error = std::abs(given - slope[i]);
        if (error <= report.relative * scale) continue;
        std::ostringstream text;
        text << residual.name << ": state " << state << ", row " << i << ", column " << k << ": Jacobian " << given
             << ", differences " << slope[i] << " (to " << uncertainty << ")";
        report = {error / scale, error, uncertainty / scale, 0, state, i, k, text.str()};
      }
    }
  return report;
}

}  // namespace tandem::detail

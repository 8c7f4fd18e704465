#include <cmath>
#include <limits>
#include <string>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <tandem/lie/error.hpp>
#include <tandem/residuals/gaussian.hpp>

namespace tandem {
namespace {

Eigen::MatrixXd cholesky_factor(const Eigen::MatrixXd& M, const std::string& what) {
  if (M.rows() != M.cols() || M.rows() == 0)
    throw BadInputError(what + " is " + std::to_string(M.rows()) + " x " + std::to_string(M.cols()) + ", not square");
  if (!M.allFinite()) throw BadInputError(what + " has an entry that is not finite");
  const double scale = M.cwiseAbs().maxCoeff();
  if ((M - M.transpose()).cwiseAbs().maxCoeff() > 1e-9 * scale) throw BadInputError(what + " is not symmetric");
  const Eigen::LLT<Eigen::MatrixXd> llt(0.5 * (M + M.transpose()));
  bool definite = llt.info() == Eigen::Success;
  if (definite) {  // rounding can hide singularity: also require that the correlation matrix has no eigenvalue near 0
    const Eigen::VectorXd unit = M.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd correlation = unit.asDiagonal() * M * unit.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(correlation, Eigen::EigenvaluesOnly);
    definite = eigen.eigenvalues()[0] > 10.0 * double(M.rows()) * std::numeric_limits<double>::epsilon();
  }
  if (!definite) throw BadInputError(what + " is not positive definite");
  return llt.matrixL();
}

}  // namespace

Gaussian::Gaussian(const Eigen::VectorXd& sigmas) : diagonal_(sigmas.cwiseInverse()) {
  if (sigmas.size() == 0) throw BadInputError("Gaussian: the list of standard deviations is empty");
  for (const double s : sigmas)
    if (!(s > 0) || !std::isfinite(s))
      throw BadInputError("Gaussian: sigma " + std::to_string(s) + " is not positive and finite");
}

Gaussian::Gaussian(std::initializer_list<double> sigmas)
    : Gaussian(Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(sigmas.begin(), Eigen::Index(sigmas.size())))) {}

Gaussian Gaussian::covariance(const Eigen::MatrixXd& sigma) {
  const Eigen::MatrixXd L = cholesky_factor(sigma, "covariance");
  Gaussian g;
  g.full_ = L.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(L.rows(), L.cols()));
  g.diagonal_ = g.full_.diagonal();
  return g;
}

Gaussian Gaussian::information(const Eigen::MatrixXd& lambda) {
  Gaussian g;
  g.full_ = cholesky_factor(lambda, "information").transpose();
  g.diagonal_ = g.full_.diagonal();
  return g;
}

Gaussian Gaussian::scaled(double k) const {
  if (!(k > 0) || !std::isfinite(k))
    throw BadInputError("Gaussian: scale " + std::to_string(k) + " is not positive and finite");
  Gaussian g = *this;
  g.diagonal_ /= k;
  g.full_ /= k;
  return g;
}

Gaussian Gaussian::square_root(const Eigen::MatrixXd& W) {
  if (W.rows() != W.cols() || W.rows() == 0)
    throw BadInputError("Gaussian: the square root of the information is not a square matrix");
  if (!W.allFinite() || !(std::abs(W.determinant()) > 0))
    throw BadInputError("Gaussian: the square root of the information is singular or not finite");
  Gaussian g;
  g.full_ = W;
  g.diagonal_ = W.diagonal();
  return g;
}

Gaussian Gaussian::scaled(const Eigen::VectorXd& k) const {
  if (k.size() != dim())
    throw BadInputError("Gaussian: " + std::to_string(k.size()) + " scale factors for " + std::to_string(dim()) +
                        " rows");
  for (const double x : k)
    if (!(x > 0) || !std::isfinite(x))
      throw BadInputError("Gaussian: scale " + std::to_string(x) + " is not positive and finite");
  Gaussian g = *this;
  g.diagonal_.array() /= k.array();
  if (!is_diagonal()) {
    g.full_ = full_ * k.cwiseInverse().asDiagonal();
    g.diagonal_ = g.full_.diagonal();
  }
  return g;
}

double Gaussian::log_determinant() const {
  return is_diagonal() ? diagonal_.array().log().sum() : std::log(std::abs(full_.determinant()));
}

Eigen::MatrixXd Gaussian::sqrt_information() const {
  return is_diagonal() ? Eigen::MatrixXd(diagonal_.asDiagonal()) : full_;
}

Eigen::MatrixXd Gaussian::covariance_matrix() const {
  if (is_diagonal()) return Eigen::MatrixXd(diagonal_.cwiseAbs2().cwiseInverse().asDiagonal());
  const Eigen::MatrixXd W_inverse = full_.partialPivLu().solve(Eigen::MatrixXd::Identity(dim(), dim()));
  return W_inverse * W_inverse.transpose();
}

}  // namespace tandem

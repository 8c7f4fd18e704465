#include <cmath>

#include <Eigen/Eigenvalues>

#include <tandem/residuals/vehicle/vehicle_model.hpp>

namespace tandem {
namespace {

constexpr double kRounding = 1e-9;  // relative to the largest entry

double least_eigenvalue(const Matrix<6, 6>& A) {
  const Matrix<6, 6> symmetric = 0.5 * (A + A.transpose());
  return Eigen::SelfAdjointEigenSolver<Matrix<6, 6>>(symmetric, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

}  // namespace

std::string why_invalid(const VehicleBody& body) {
  for (const Matrix<6, 6>* A : {&body.mass, &body.linear, &body.quadratic, &body.lift})
    if (!A->allFinite()) return "a matrix of the vehicle has an entry that is not finite";
  const double largest = body.mass.cwiseAbs().maxCoeff();
  if ((body.mass - body.mass.transpose()).cwiseAbs().maxCoeff() > kRounding * largest)
    return "the mass matrix is not symmetric";
  if (!(least_eigenvalue(body.mass) > kRounding * largest)) return "the mass matrix is not positive definite";
  struct Damping {
    const char* name;
    const Matrix<6, 6>& matrix;
  };
  for (const Damping& d : {Damping{"linear", body.linear}, {"quadratic", body.quadratic}, {"lift", body.lift}})
    if (least_eigenvalue(d.matrix) < -kRounding * d.matrix.cwiseAbs().maxCoeff())
      return std::string("the ") + d.name +
             " damping matrix is not positive semidefinite, so it would drive the vehicle";
  if (!(least_eigenvalue(body.linear + body.quadratic + body.lift) > 0))
    return "the damping matrix is not positive definite";
  return {};
}

}  // namespace tandem

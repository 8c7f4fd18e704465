#include <vector>

#include <tandem/problem/sparse_program.hpp>

namespace tandem {

SparseProgram sparse(Program& program) {
  const int n = program.num_unknowns(), m = program.num_rows();
  SparseProgram result{0, Eigen::VectorXd(n), {n, n}, Eigen::VectorXd(m), {m, n}, program.lower(), program.upper()};
  const SymmetricPattern& h = program.hessian_pattern();
  const std::vector<int> start = h.column_starts(), rows = h.rows();
  Eigen::VectorXd values(h.nonzeros());
  result.cost = program.linearize(result.gradient, values);
  std::vector<Eigen::Triplet<double>> triplets;
  for (int column = 0; column < n; ++column)
    for (int k = start[std::size_t(column)]; k < start[std::size_t(column) + 1]; ++k) {
      const int row = rows[std::size_t(k)];
      if (row < column) continue;  // diagonal blocks are there in full
      triplets.emplace_back(row, column, values[k]);
      if (row != column) triplets.emplace_back(column, row, values[k]);
    }
  result.hessian.setFromTriplets(triplets.begin(), triplets.end());

  const TripletPattern& j = program.jacobian_pattern();
  values.resize(Eigen::Index(j.row.size()));
  if (m > 0) program.linearize_constraints(result.constraints, values);
  triplets.clear();
  for (std::size_t k = 0; k < j.row.size(); ++k) triplets.emplace_back(j.row[k], j.column[k], values[Eigen::Index(k)]);
  result.jacobian.setFromTriplets(triplets.begin(), triplets.end());
  return result;
}

}  // namespace tandem

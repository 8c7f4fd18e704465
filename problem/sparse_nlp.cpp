#include <vector>

#include <tandem/problem/sparse_nlp.hpp>

namespace tandem {

SparseNlp sparse(NlpEvaluator& nlp) {
  const int n = nlp.num_unknowns(), m = nlp.num_rows();
  SparseNlp result{0, Eigen::VectorXd(n), {n, n}, Eigen::VectorXd(m), {m, n}, nlp.lower(), nlp.upper()};
  const SymmetricPattern& h = nlp.hessian_pattern();
  Eigen::VectorXd values(h.nonzeros());
  result.cost = nlp.linearize(result.gradient, values);
  std::vector<Eigen::Triplet<double>> triplets;
  for (int block = 0; block < h.num_blocks(); ++block)
    for (int b = h.block_start[std::size_t(block)]; b < h.block_start[std::size_t(block) + 1]; ++b) {
      const int other = h.block_row[std::size_t(b)];
      const int at = h.value_start[std::size_t(block)] + h.block_offset[std::size_t(b)];
      for (int j = 0; j < h.width(block); ++j)
        for (int i = 0; i < h.width(other); ++i) {
          if (other == block && i < j) continue;  // diagonal blocks are stored in full
          const int row = h.first[std::size_t(other)] + i, column = h.first[std::size_t(block)] + j;
          triplets.emplace_back(row, column, values[at + j * h.height(block) + i]);
          if (row != column) triplets.emplace_back(column, row, triplets.back().value());
        }
    }
  result.hessian.setFromTriplets(triplets.begin(), triplets.end());

  const TripletPattern& j = nlp.jacobian_pattern();
  values.resize(Eigen::Index(j.row.size()));
  if (m > 0) nlp.linearize_constraints(result.constraints, values);
  triplets.clear();
  for (std::size_t k = 0; k < j.row.size(); ++k) triplets.emplace_back(j.row[k], j.column[k], values[Eigen::Index(k)]);
  result.jacobian.setFromTriplets(triplets.begin(), triplets.end());
  return result;
}

}  // namespace tandem

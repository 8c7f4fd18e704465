#include <gtest/gtest.h>

#include <tandem/solvers/linear/block_cholesky.hpp>

#include "block_matrix.hpp"

namespace tandem::testing {
namespace {

/// With a pattern in elimination order, the factor can overwrite the values, with bitwise equal results.
TEST(BlockCholeskyInPlace, EqualsFactorisationOfACopy) {
  for (const BlockMatrix& m : {chain(40, 2, 3), long_chain(2, true, 1), long_chain(3, false, 2), star(40, 20, 4)}) {
    BlockMatrix ordered{in_elimination_order(m.pattern), m.dense, {}};
    const SymmetricPattern& p = ordered.pattern;
    Eigen::VectorXd values(p.nonzeros());
    for (int k = 0; k < p.num_blocks(); ++k)
      for (int b = p.block_start[std::size_t(k)]; b < p.block_start[std::size_t(k) + 1]; ++b)
        for (int c = 0; c < p.width(k); ++c)
          for (int r = 0, other = p.block_row[std::size_t(b)]; r < p.width(other); ++r)
            values[p.value_start[std::size_t(k)] + c * p.height(k) + p.block_offset[std::size_t(b)] + r] =
                m.dense(p.first[std::size_t(other)] + r, p.first[std::size_t(k)] + c);
    BlockCholesky copying(m.pattern), from_copy(p), in_place(p);
    ASSERT_TRUE(copying.factorize(m.values));
    ASSERT_TRUE(from_copy.factorize(values));
    Eigen::VectorXd taken = values;
    ASSERT_TRUE(in_place.factorize_in_place(taken));
    EXPECT_EQ(in_place.nonzeros(), copying.nonzeros());
    EXPECT_NE(taken, values);
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(m.dense.rows(), -1.0, 2.0);
    Eigen::VectorXd x = b, y = b, z = b;
    copying.solve(x);
    from_copy.solve(y);
    in_place.solve(z);
    EXPECT_LE((m.dense * x - b).norm(), 1e-10 * b.norm());
    EXPECT_EQ(x, y);
    EXPECT_EQ(x, z);
    taken = values;
    EXPECT_TRUE(in_place.null_space(taken, 1e-12, 6).empty());
    EXPECT_NE(taken, values);
    const int late = p.size() - 3;  // not adjacent to the first block
    for (const int planted : {1, late}) {
      taken = values;
      for (int k = 0; k < p.num_blocks(); ++k)
        if (planted >= p.first[std::size_t(k)] && planted < p.first[std::size_t(k) + 1])
          taken[p.diagonal(k, planted - p.first[std::size_t(k)])] = -1.0;
      EXPECT_FALSE(in_place.factorize_in_place(taken));
      EXPECT_EQ(in_place.failed_unknown(), planted);
    }
    taken = values;
    ASSERT_TRUE(in_place.factorize_in_place(taken)) << "after a failed factorisation";
    z = b;
    in_place.solve(z);
    EXPECT_EQ(x, z);
    taken = m.values;
    EXPECT_TRUE(copying.factorize_in_place(taken)) << "falls back to a copy for other patterns";
  }
}

}  // namespace
}  // namespace tandem::testing

#include <type_traits>

#include <tandem/problem/block.hpp>
#include <tandem/problem/block_kernels.hpp>

namespace tandem::detail {
namespace {

/// Computes A ← W A for a matrix A of `columns` columns.
template <class M, class N>
TANDEM_INLINED void whiten(M rows, N columns, const double* diagonal, const double* full, double* A) {
  if (full)
    multiply_left(rows, columns, full, A);
  else
    scale_rows(rows, columns, diagonal, A);
}

/// Computes T = w Jᵀ of each free state, one after the other, and adds T r to the gradient.
template <class M>
TANDEM_INLINED void add_gradient(M dim, const BlockShape& shape, double w, const double* const* J, const double* r,
                                 double* T, double* gradient) {
  for (int s = 0; s < shape.arity; T += dim * shape.dofs[s], ++s) {
    if (shape.offset[s] < 0) continue;
    double* at = gradient + shape.offset[s];
    with_size(shape.dofs[s], [&](auto dof) TANDEM_INLINED_HERE {
      transpose(dim, dof, w, J[s], T);
      if constexpr (std::is_same_v<decltype(dof), int>)
        add_multiplied_directly(dof, dim, T, r, at);
      else
        add_multiplied(dof, dim, T, r, at);
    });
  }
}

template <class M>
TANDEM_INLINED void add_products(M dim, const BlockShape& shape, const HessianPlace* place, const double* T,
                                 const double* const* J, double* H) {
  constexpr std::integral_constant<int, 3> three;
  constexpr std::integral_constant<int, 6> six;
  constexpr std::integral_constant<int, 9> nine;
  const int* offset = shape.offset;
  const double* T_A = T;
  for (int A = 0; A < shape.arity; T_A += dim * shape.dofs[A], place += A + 1, ++A) {
    if (offset[A] < 0) continue;
    const double* T_B = T;
    for (int B = 0; B <= A; T_B += dim * shape.dofs[B], ++B) {
      if (offset[B] < 0) continue;
      const int stride = int(place[B].stride);
      double* to = H + place[B].position;
      const bool twice = A != B && offset[A] == offset[B];  // the block reads one variable twice: both triangles
      for (int turn = 0; turn <= int(twice); ++turn) {
        const bool transposed = place[B].transposed || turn > 0;
        const int rows = shape.dofs[transposed ? B : A], columns = shape.dofs[transposed ? A : B];
        const double* of_rows = transposed ? T_B : T_A;
        const double* of_columns = J[transposed ? A : B];
        if (rows == 6 && columns == 6)  // two SE(3) states, the most frequent case
          add_product(six, dim, six, of_rows, of_columns, to, stride);
        else if (rows == 6)
          add_product(six, dim, columns, of_rows, of_columns, to, stride);
        else if (rows == 9)
          add_product(nine, dim, columns, of_rows, of_columns, to, stride);
        else if (rows == 3)
          add_product(three, dim, columns, of_rows, of_columns, to, stride);
        else
          add_product_directly(rows, dim, columns, of_rows, of_columns, to, stride);
      }
    }
  }
}

template <class M>
TANDEM_INLINED Loss::Value loss_of_rows(M dim, const BlockWeight& weight, double* r) {
  whiten(dim, 1, weight.diagonal, weight.full, r);
  return weight.loss(squared_norm(dim, r));
}

/// Whitens the rows and the Jacobians of the free states in place. Returns the loss.
template <class M>
TANDEM_INLINED Loss::Value whiten_block(M dim, const BlockShape& shape, const BlockWeight& weight,
                                        const LinearizedBlock& block) {
  const Loss::Value value = loss_of_rows(dim, weight, block.r);
  for (int s = 0; s < shape.arity; ++s) {
    if (shape.offset[s] < 0) continue;
    double* J = block.J[s];
    with_size(shape.dofs[s], [&](auto dof) TANDEM_INLINED_HERE { whiten(dim, dof, weight.diagonal, weight.full, J); });
  }
  return value;
}

template <class M>
TANDEM_INLINED double add_soft_block(M dim, const BlockShape& shape, const HessianPlace* place,
                                     const BlockWeight& weight, const LinearizedBlock& block, double* gradient,
                                     double* H) {
  const Loss::Value value = whiten_block(dim, shape, weight, block);
  add_gradient(dim, shape, value.d1, block.J, block.r, block.transposed, gradient);
  if (H) add_products(dim, shape, place, block.transposed, block.J, H);
  return 0.5 * value.rho;
}

template <class M>
TANDEM_INLINED void add_first_order(M dim, const BlockShape& shape, const HessianPlace* place,
                                    const BlockWeight& weight, const LinearizedBlock& block, double gauss_newton_factor,
                                    double loss_factor, double* H) {
  const Loss::Value value = whiten_block(dim, shape, weight, block);
  double* T = block.transposed;
  for (int s = 0; s < shape.arity; T += dim * shape.dofs[s], ++s) {
    if (shape.offset[s] < 0) continue;
    const double* J = block.J[s];
    with_size(shape.dofs[s], [&](auto dof) TANDEM_INLINED_HERE {
      double g[kMaxDofs];
      multiply_transposed(dim, dof, J, block.r, g);
      transpose(dim, dof, gauss_newton_factor * value.d1, J, T);
      for (int k = 0; k < dim; ++k)
        for (int j = 0; j < dof; ++j) T[k * dof + j] += 2 * loss_factor * value.d2 * g[j] * block.r[k];
    });
  }
  add_products(dim, shape, place, block.transposed, block.J, H);
}

/// The kernels for `rows` rows, or for any number of rows if `rows` is 0. These are compiled for the baseline only.
template <int rows>
struct Kernels {
  static auto size(int dim) {
    if constexpr (rows > 0) {
      return std::integral_constant<int, rows>();
    } else {
      return dim;
    }
  }
  template <class F>
  static auto call(F f) {
    if constexpr (rows > 0) {
      return dispatch_simd(f);
    } else {
      return f();
    }
  }

  static void apply_charts(const BlockShape& shape, const double* const* charts, double* const* J) {
    double product[(rows > 0 ? rows : kMaxRows) * kMaxDofs];
    shape.for_free([&](int s) {
      if (charts[s])
        with_size(shape.dofs[s], [&](auto dof) { multiply_right(size(shape.dim), dof, J[s], charts[s], product); });
    });
  }
  static void add_products(const BlockShape& shape, const HessianPlace* place, const double* T, const double* const* J,
                           double* H) {
    call([&]() TANDEM_INLINED_HERE { detail::add_products(size(shape.dim), shape, place, T, J, H); });
  }
  static double soft_block_cost(int dim, const BlockWeight& weight, double* r) {
    return call([&]() TANDEM_INLINED_HERE { return 0.5 * loss_of_rows(size(dim), weight, r).rho; });
  }
  static double add_soft_block(const BlockShape& shape, const HessianPlace* place, const BlockWeight& weight,
                               const LinearizedBlock& block, double* gradient, double* H) {
    return call([&]() TANDEM_INLINED_HERE {
      return detail::add_soft_block(size(shape.dim), shape, place, weight, block, gradient, H);
    });
  }
  static void add_first_order(const BlockShape& shape, const HessianPlace* place, const BlockWeight& weight,
                              const LinearizedBlock& block, double gauss_newton_factor, double loss_factor, double* H) {
    call([&]() TANDEM_INLINED_HERE {
      detail::add_first_order(size(shape.dim), shape, place, weight, block, gauss_newton_factor, loss_factor, H);
    });
  }

  static constexpr BlockKernels all{&apply_charts, &add_products, &soft_block_cost, &add_soft_block, &add_first_order};
};

}  // namespace

const BlockKernels& block_kernels(int dim) {
  switch (dim) {
    case 1:
      return Kernels<1>::all;
    case 2:
      return Kernels<2>::all;
    case 3:
      return Kernels<3>::all;
    case 6:
      return Kernels<6>::all;
    case 15:  // preintegrated IMU samples
      return Kernels<15>::all;
    default:
      return Kernels<0>::all;
  }
}

}  // namespace tandem::detail

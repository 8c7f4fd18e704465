#pragma once

#include <string>
#include <tuple>
#include <utility>

#include <tandem/lie/dual_groups.hpp>
#include <tandem/lie/error.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

namespace detail {

/// Returns x ⊕ ε over dual numbers, where ε are the variables from `first` on.
template <class S, LieGroup X>
auto perturbed(const X& x, int first) {
  using Y = typename X::template Rebind<S>;
  if constexpr (requires { Y::perturbed(x, first); }) {
    return Y::perturbed(x, first);
  } else {
    typename Y::Tangent e;
    for (int i = 0; i < X::dof; ++i) e[i] = S::variable(0.0, first + i);
    return Y(x.template cast<S>() * Y::Exp(e));
  }
}

}  // namespace detail

/// Residual whose Jacobians come from forward automatic differentiation. F has the members `name`, `dim` and `States`
/// of a residual (see Residual), the measurement, and a call operator that is a template on the scalar of the states.
/// It returns the rows, or sets them:
///
///   template <class S>
///   Vector<dim, S> operator()(const BasicSE3<S>& x, const BasicRn<3, S>& p) const;
///   void operator()(const Over<SE3> auto& x, const Over<R3> auto& p, auto& r) const;
///
/// Constants are converted by X.cast<S>() and S(x); doubles and their matrices mix with S in arithmetic. Functions such
/// as sqrt are called without std::.
///
/// The states are X ⊕ ε with ε = 0, so the Jacobians refer to right perturbations. They equal closed forms up to
/// rounding, in about twice their time. Throws Error if a row or a derivative is not finite, for example the
/// derivative of norm() at 0. Evaluation does not allocate. Every state's group needs Rebind and cast.
template <class F, class States = typename F::States>
struct AutoDiff;

template <class F, LieGroup... Xs>
struct AutoDiff<F, std::tuple<Xs...>> {
  static constexpr std::string_view name = F::name;
  static constexpr int dim = F::dim;
  static constexpr bool linear = requires { requires F::linear; };
  using States = std::tuple<Xs...>;

  F function;

  void operator()(const Xs&... x, Vector<dim>& r) const {
    evaluate(r, x...);
    check_finite(r.allFinite(), "row");
  }
  void operator()(const Xs&... x, Vector<dim>& r, RowsBy<dim, Xs>*... J) const {
    if (!(J || ...)) return (*this)(x..., r);
    using S = Dual<(Xs::dof + ...)>;
    Vector<dim, S> dual;
    int first = 0;
    const auto next = [&]<class X>(const X& state) {
      return detail::perturbed<S>(state, std::exchange(first, first + X::dof));
    };
    // Braces guarantee evaluation from left to right.
    const std::tuple<typename Xs::template Rebind<S>...> states{next(x)...};
    std::apply([&](const auto&... y) { evaluate(dual, y...); }, states);
    typename S::Partials zero = S::Partials::Zero();  // NaN where a derivative is not finite
    for (int i = 0; i < dim; ++i) {
      r[i] = dual[i].a;
      zero += 0.0 * dual[i].v;
    }
    check_finite(r.allFinite(), "row");
    check_finite(zero.sum() == 0.0, "derivative");
    first = 0;
    const auto copy = [&]<class X>(RowsBy<dim, X>* to) {
      if (to)
        for (int i = 0; i < dim; ++i) to->row(i) = dual[i].v.template segment<X::dof>(first).transpose();
      first += X::dof;
    };
    (copy.template operator()<Xs>(J), ...);
  }

 private:
  template <class R, class... Ys>
  void evaluate(R& r, const Ys&... x) const {
    if constexpr (requires { function(x..., r); })
      function(x..., r);
    else
      r = R(function(x...));
  }
  static void check_finite(bool finite, const char* what) {
    if (!finite)
      throw Error(std::string(name) + ": a " + what +
                  " is not finite at these values; change the formula or the initial guess");
  }
};

template <class F>
AutoDiff(F) -> AutoDiff<F>;

}  // namespace tandem

#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <tandem/lie/dual.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/problem/problem.hpp>

/// Provides problems of the collection of Hock & Schittkowski 1981 (Test Examples for Nonlinear Programming Codes,
/// Lecture Notes in Economics and Mathematical Systems 187) as Tandem problems.
namespace tandem::testing {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// Returns x to the power of a positive integer.
template <class T>
T power(const T& x, int n) {
  T y = x;
  for (int k = 1; k < n; ++k) y *= x;
  return y;
}

/// Scalar residual of a formula in N unknowns.
template <int N>
struct Formula {
  static constexpr std::string_view name = "formula";
  static constexpr int dim = 1;
  using States = std::tuple<Rn<N>>;
  using Function = Dual<N> (*)(const Dual<N>* x);
  Function at;

  void operator()(const Rn<N>& x, Vector<1>& r, Matrix<1, N>* J = nullptr) const {
    std::array<Dual<N>, std::size_t(N)> unknowns;
    for (int i = 0; i < N; ++i) unknowns[std::size_t(i)] = Dual<N>::variable(x.vector()[i], i);
    const Dual<N> value = at(unknowns.data());
    r[0] = value.a;
    if (J) *J = value.v.template head<N>().matrix().transpose();
  }
};

/// Residual xᵢ, for bounds.
template <int N>
struct Entry {
  static constexpr std::string_view name = "entry";
  static constexpr int dim = 1;
  using States = std::tuple<Rn<N>>;
  int i;

  void operator()(const Rn<N>& x, Vector<1>& r, Matrix<1, N>* J = nullptr) const {
    r[0] = x.vector()[i];
    if (J) *J = Matrix<1, N>::Unit(i);
  }
};

/// A problem of the collection. Objectives that are sums of squares are costs as they are, up to a constant. For others
/// the cost is (f + c)², with a constant c that makes f + c positive, so that the minimisers are the same.
struct HockSchittkowski {
  int number;
  double minimum;        ///< of the objective, from the collection
  double constant = 0;   ///< f = cost − constant, or √cost − constant
  bool squared = false;  ///< the cost is (f + constant)²
  Problem problem{};

  double objective(double cost) const { return (squared ? std::sqrt(cost) : cost) - constant; }
};

/// Builds a problem in N unknowns.
template <int N>
class HockSchittkowskiBuilder {
 public:
  using Function = typename Formula<N>::Function;

  HockSchittkowskiBuilder(int number, double minimum, const std::array<double, std::size_t(N)>& start)
      : result_{.number = number, .minimum = minimum} {
    x_ = result_.problem.add(Rn<N>(Vector<N>(start.data())), "x");
  }
  /// Adds weight · r² to the cost.
  HockSchittkowskiBuilder& square(Function r, double weight = 1) {
    result_.problem.minimize(Formula<N>{r}, Gaussian{std::sqrt(0.5 / weight)}, {x_});
    return *this;
  }
  /// Subtracts a constant from the sum of squares.
  HockSchittkowskiBuilder& minus(double constant) {
    result_.constant = constant;
    return *this;
  }
  /// Makes `r` the objective plus `constant`.
  HockSchittkowskiBuilder& objective(double constant, Function r) {
    result_.constant = constant;
    result_.squared = true;
    return square(r);
  }
  HockSchittkowskiBuilder& zero(Function c) {
    result_.problem.subject_to(Formula<N>{c}, equal_to(0), {x_});
    return *this;
  }
  HockSchittkowskiBuilder& positive(Function c) {
    result_.problem.subject_to(Formula<N>{c}, at_least(0), {x_});
    return *this;
  }
  HockSchittkowskiBuilder& bound(int i, double low, double high) {
    result_.problem.subject_to(Entry<N>{i - 1}, between(low, high), {x_});
    return *this;
  }
  HockSchittkowskiBuilder& bound_all(double low, double high) {
    for (int i = 1; i <= N; ++i) bound(i, low, high);
    return *this;
  }
  void to(std::vector<HockSchittkowski>& all) { all.push_back(std::move(result_)); }

 private:
  HockSchittkowski result_;
  Variable<Rn<N>> x_;
};

/// Adds the problems in two unknowns.
void add_two_unknowns(std::vector<HockSchittkowski>& all);

/// Returns the problems with their starting points. Each call returns new problems.
std::vector<HockSchittkowski> hock_schittkowski();

}  // namespace tandem::testing

#include "random_programs.hpp"

namespace tandem::testing {
namespace {

/// Residual scale · (residual of R).
template <class R>
struct Scaled {
  static constexpr std::string_view name = "scaled";
  static constexpr int dim = 1;
  using States = typename R::States;
  R residual;
  double scale;

  void operator()(const R3& x, const R3& y, Vector<1>& r, Matrix<1, 3>* Jx = nullptr,
                  Matrix<1, 3>* Jy = nullptr) const {
    residual(x, y, r, Jx, Jy);
    r *= scale;
    for (auto* J : {Jx, Jy})
      if (J) *J *= scale;
  }
};

/// Residual (aᵀx − b)², whose gradient vanishes where the residual is 0.
struct SquaredDistance {
  static constexpr std::string_view name = "squared distance";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  Vector<3> a;
  double b;

  void operator()(const R3& x, Vector<1>& r, Matrix<1, 3>* J = nullptr) const {
    const double distance = a.dot(x.vector()) - b;
    r[0] = distance * distance;
    if (J) *J = 2 * distance * a.transpose();
  }
};

/// Residual aᵀx − b.
struct Plane {
  static constexpr std::string_view name = "plane";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  Vector<3> a;
  double b;

  void operator()(const R3& x, Vector<1>& r, Matrix<1, 3>* J = nullptr) const {
    r[0] = a.dot(x.vector()) - b;
    if (J) *J = a.transpose();
  }
};

class Builder {
 public:
  explicit Builder(std::uint64_t seed) : program_(random_problem(seed)), random_(seed + 1000003) {}

  RandomProblem build(Difficulty difficulty) {
    switch (difficulty) {
      case Difficulty::nonconvex:
        break;
      case Difficulty::only_constraints:
        for (int k = 0; k < integer(1, 2); ++k) add_variable_of_constraints();
        break;
      case Difficulty::redundant:
        add_redundant_equalities();
        break;
      case Difficulty::degenerate:
        if (integer(0, 1)) {
          add_vanishing_gradient();
        } else {
          add_vertex();
        }
        break;
      case Difficulty::badly_scaled:
        program_ = scaled([this] { return std::pow(10.0, uniform(-3.0, 3.0)); },
                          [this] { return std::pow(10.0, uniform(-4.0, 4.0)); });
        break;
      case Difficulty::large_rows:
        program_ = scaled([this] { return integer(0, 1) ? 1e3 : 1e-3; },
                          [this] {
                            return std::array{1e-6, 1e3, 1e6}[std::size_t(integer(0, 2))];
                          });
        break;
      case Difficulty::infeasible:
        add_contradiction();
        break;
    }
    return std::move(program_);
  }

 private:
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  int integer(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  Vector<3> vector(double size) {
    Vector<3> v;
    for (double& entry : v) entry = size * normal_(random_);
    return v;
  }
  /// Returns a residual that is linear every other time.
  Wave wave() { return {vector(1.0), vector(1.0), vector(0.5), vector(0.5), integer(0, 1) ? 0.0 : uniform(0.0, 1.0)}; }
  static double value(const Wave& w, const R3& x, const R3& y) {
    Vector<1> r;
    w(x, y, r);
    return r[0];
  }
  std::size_t any() { return std::size_t(integer(0, 3)); }
  /// Adds w(x_i, x_j) = its value at the feasible point.
  void add_equality(const Wave& w, std::size_t i, std::size_t j, double scale = 1) {
    const double at = scale * value(w, program_.feasible[i], program_.feasible[j]);
    program_.problem.subject_to(Scaled<Wave>{w, scale}, equal_to(at), {program_.x[i], program_.x[j]});
  }

  /// Adds a variable, three to six equalities that determine it, and sometimes a bound on it.
  void add_variable_of_constraints() {
    const std::size_t h = program_.x.size();
    program_.feasible.emplace_back(vector(2.0));
    program_.x.push_back(program_.problem.add(R3(program_.feasible[h].vector() + vector(1.0)), "h"));
    for (int k = 0, rows = integer(3, 6); k < rows; ++k) add_equality(wave(), h, any());
    if (integer(0, 1)) return;
    const Wave w = wave();
    const std::size_t i = any();
    program_.problem.subject_to(w, at_most(value(w, program_.feasible[h], program_.feasible[i]) + 0.1),
                                {program_.x[h], program_.x[i]});
  }

  /// Adds equalities, and copies, multiples and sums of them.
  void add_redundant_equalities() {
    Wave a = wave(), b = wave();
    a.height = b.height = 0;
    add_equality(a, 0, 1);
    add_equality(b, 0, 1);
    add_equality(Wave{a.a - 2 * b.a, a.b - 2 * b.b, a.c, a.d, 0.0}, 0, 1);
    add_equality(a, 0, 1, 3.0);
    Wave curved = wave();
    curved.height = 1;
    for (int k = 0, copies = integer(0, 3) ? 2 : 20; k < copies; ++k) add_equality(curved, 2, 3);
  }

  void add_vanishing_gradient() {
    const std::size_t i = any();
    const Vector<3> a = vector(1.0);
    program_.problem.subject_to(SquaredDistance{a, a.dot(program_.feasible[i].vector())}, at_most(0.0),
                                {program_.x[i]});
  }

  /// Adds planes through one point that enclose a cone, and a cost that pulls a variable into its tip.
  void add_vertex() {
    const std::size_t i = any();
    const Vector<3> tip = program_.feasible[i].vector(), axis = vector(1.0);
    for (int k = 0; k < 8; ++k) {
      const Vector<3> a = axis.normalized() + 0.5 * vector(1.0).normalized();
      program_.problem.subject_to(Plane{a, a.dot(tip)}, at_most(0.0), {program_.x[i]});
    }
    program_.problem.minimize(Prior<R3>{R3(tip + axis)}, Gaussian{0.1, 0.1, 0.1}, {program_.x[i]});
  }

  /// Returns a program with random units of variables and of rows.
  template <class Unit, class Row>
  RandomProblem scaled(Unit unit_of_variable, Row unit_of_row) {
    RandomProblem p;
    std::vector<double> unit;
    for (int k = 0; k < 4; ++k) {
      unit.push_back(unit_of_variable());
      p.x.push_back(p.problem.add(R3(unit.back() * vector(2.0)), "x" + std::to_string(k)));
      p.feasible.emplace_back(unit.back() * vector(2.0));
      const double sigma = unit.back() * std::pow(10.0, uniform(-1.0, 1.0));
      p.problem.minimize(Prior<R3>{R3(unit.back() * vector(2.0))}, Gaussian{sigma, sigma, sigma}, {p.x.back()});
    }
    for (int k = 0; k < 12; ++k) {
      const auto i = any(), j = (i + std::size_t(integer(1, 3))) % 4;
      Wave w = wave();
      w.a /= unit[i], w.c /= unit[i], w.b /= unit[j], w.d /= unit[j];
      const Scaled<Wave> row{w, unit_of_row()};
      if (k < 6) {
        p.problem.minimize(row, Gaussian{row.scale * std::pow(10.0, uniform(-1.0, 1.0))}, {p.x[i], p.x[j]});
        continue;
      }
      const double at = row.scale * value(w, p.feasible[i], p.feasible[j]);
      p.problem.subject_to(row, k < 8 ? equal_to(at) : at_most(at + row.scale * uniform(0.0, 1.0)), {p.x[i], p.x[j]});
    }
    return p;
  }

  void add_contradiction() {
    Problem& p = program_.problem;
    const auto x = program_.x[0], y = program_.x[1];
    Wave w = wave();
    if (integer(0, 1)) {
      const double at = value(w, program_.feasible[0], program_.feasible[1]), gap = uniform(0.01, 2.0);
      p.subject_to(w, at_most(at), {x, y});
      p.subject_to(w, at_least(at + gap), {x, y});
    } else {  // beyond the amplitude
      w.a.setZero(), w.b.setZero();
      w.height = 1;
      p.subject_to(w, at_least(1.0 + uniform(0.01, 1.0)), {x, y});
    }
  }

  RandomProblem program_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace

RandomProblem random_program(Difficulty difficulty, std::uint64_t seed) { return Builder(seed).build(difficulty); }

}  // namespace tandem::testing

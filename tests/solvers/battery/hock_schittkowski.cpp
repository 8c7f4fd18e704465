#include "hock_schittkowski.hpp"

#include <numbers>

namespace tandem::testing {
namespace {

using std::sqrt;

void add_three_unknowns(std::vector<HockSchittkowski>& all) {
  using Three = HockSchittkowskiBuilder<3>;
  Three(26, 0, {-2.6, 2, 2})
      .square([](auto x) { return x[0] - x[1]; })
      .square([](auto x) { return power(x[1] - x[2], 2); })
      .zero([](auto x) { return (1.0 + x[1] * x[1]) * x[0] + power(x[2], 4) - 3.0; })
      .to(all);
  Three(27, 0.04, {2, 2, 2})
      .square([](auto x) { return x[0] - 1.0; }, 0.01)
      .square([](auto x) { return x[1] - x[0] * x[0]; })
      .zero([](auto x) { return x[0] + x[2] * x[2] + 1.0; })
      .to(all);
  Three(28, 0, {-4, 1, 1})
      .square([](auto x) { return x[0] + x[1]; })
      .square([](auto x) { return x[1] + x[2]; })
      .zero([](auto x) { return x[0] + 2.0 * x[1] + 3.0 * x[2] - 1.0; })
      .to(all);
  Three(29, -16 * sqrt(2.0), {1, 1, 1})
      .objective(100, [](auto x) { return 100.0 - x[0] * x[1] * x[2]; })
      .positive([](auto x) { return 48.0 - x[0] * x[0] - 2.0 * x[1] * x[1] - 4.0 * x[2] * x[2]; })
      .to(all);
  Three(30, 1, {1, 1, 1})
      .square([](auto x) { return x[0]; })
      .square([](auto x) { return x[1]; })
      .square([](auto x) { return x[2]; })
      .positive([](auto x) { return x[0] * x[0] + x[1] * x[1] - 1.0; })
      .bound(1, 1, 10)
      .bound(2, -10, 10)
      .bound(3, -10, 10)
      .to(all);
  Three(31, 6, {1, 1, 1})
      .square([](auto x) { return x[0]; }, 9)
      .square([](auto x) { return x[1]; })
      .square([](auto x) { return x[2]; }, 9)
      .positive([](auto x) { return x[0] * x[1] - 1.0; })
      .bound(1, -10, 10)
      .bound(2, 1, 10)
      .bound(3, -10, 1)
      .to(all);
  Three(32, 1, {0.1, 0.7, 0.2})
      .square([](auto x) { return x[0] + 3.0 * x[1] + x[2]; })
      .square([](auto x) { return x[0] - x[1]; }, 4)
      .positive([](auto x) { return 6.0 * x[1] + 4.0 * x[2] - power(x[0], 3) - 3.0; })
      .zero([](auto x) { return 1.0 - x[0] - x[1] - x[2]; })
      .bound_all(0, kUnbounded)
      .to(all);
  Three(34, -std::log(std::log(10.0)), {0, 1.05, 2.9})
      .objective(10, [](auto x) { return 10.0 - x[0]; })
      .positive([](auto x) { return x[1] - exp(x[0]); })
      .positive([](auto x) { return x[2] - exp(x[1]); })
      .bound(1, 0, 100)
      .bound(2, 0, 100)
      .bound(3, 0, 10)
      .to(all);
  Three(35, 1.0 / 9, {0.5, 0.5, 0.5})
      .square([](auto x) { return x[0] + x[1] - 2.0; })
      .square([](auto x) { return x[0] + x[2] - 2.0; })
      .square([](auto x) { return x[1] - 1.0; })
      .positive([](auto x) { return 3.0 - x[0] - x[1] - 2.0 * x[2]; })
      .bound_all(0, kUnbounded)
      .to(all);
  Three(60, 0.03256820025, {2, 2, 2})
      .square([](auto x) { return x[0] - 1.0; })
      .square([](auto x) { return x[0] - x[1]; })
      .square([](auto x) { return power(x[1] - x[2], 2); })
      .zero([](auto x) { return x[0] * (1.0 + x[1] * x[1]) + power(x[2], 4) - (4.0 + 3.0 * sqrt(2.0)); })
      .bound_all(-10, 10)
      .to(all);
  Three(61, -143.6461422, {0, 0, 0})
      .square([](auto x) { return x[0] - 33.0 / 8.0; }, 4)
      .square([](auto x) { return x[1] + 4.0; }, 2)
      .square([](auto x) { return x[2] - 6.0; }, 2)
      .minus(172.0625)
      .zero([](auto x) { return 3.0 * x[0] - 2.0 * x[1] * x[1] - 7.0; })
      .zero([](auto x) { return 4.0 * x[0] - x[2] * x[2] - 11.0; })
      .to(all);
  Three(65, 0.9535288567, {-5, 5, 0})
      .square([](auto x) { return x[0] - x[1]; })
      .square([](auto x) { return x[0] + x[1] - 10.0; }, 1.0 / 9)
      .square([](auto x) { return x[2] - 5.0; })
      .positive([](auto x) { return 48.0 - x[0] * x[0] - x[1] * x[1] - x[2] * x[2]; })
      .bound(1, -4.5, 4.5)
      .bound(2, -4.5, 4.5)
      .bound(3, -5, 5)
      .to(all);
  Three(66, 0.5181632741, {0, 1.05, 2.9})
      .objective(10, [](auto x) { return 10.0 + 0.2 * x[2] - 0.8 * x[0]; })
      .positive([](auto x) { return x[1] - exp(x[0]); })
      .positive([](auto x) { return x[2] - exp(x[1]); })
      .bound(1, 0, 100)
      .bound(2, 0, 100)
      .bound(3, 0, 10)
      .to(all);
}

void add_four_unknowns(std::vector<HockSchittkowski>& all) {
  using Four = HockSchittkowskiBuilder<4>;
  Four(38, 0, {-3, -1, -3, -1})
      .square([](auto x) { return x[1] - x[0] * x[0]; }, 100)
      .square([](auto x) { return 1.0 - x[0]; })
      .square([](auto x) { return x[3] - x[2] * x[2]; }, 90)
      .square([](auto x) { return 1.0 - x[2]; })
      .square([](auto x) { return x[1] + x[3] - 2.0; }, 10)
      .square([](auto x) { return x[1] - x[3]; }, 0.1)
      .bound_all(-10, 10)
      .to(all);
  Four(39, -1, {2, 2, 2, 2})
      .objective(10, [](auto x) { return 10.0 - x[0]; })
      .zero([](auto x) { return x[1] - power(x[0], 3) - x[2] * x[2]; })
      .zero([](auto x) { return x[0] * x[0] - x[1] - x[3] * x[3]; })
      .to(all);
  Four(40, -0.25, {0.8, 0.8, 0.8, 0.8})
      .objective(10, [](auto x) { return 10.0 - x[0] * x[1] * x[2] * x[3]; })
      .zero([](auto x) { return power(x[0], 3) + x[1] * x[1] - 1.0; })
      .zero([](auto x) { return x[0] * x[0] * x[3] - x[2]; })
      .zero([](auto x) { return x[3] * x[3] - x[1]; })
      .to(all);
  Four(42, 28 - 10 * sqrt(2.0), {1, 1, 1, 1})
      .square([](auto x) { return x[0] - 1.0; })
      .square([](auto x) { return x[1] - 2.0; })
      .square([](auto x) { return x[2] - 3.0; })
      .square([](auto x) { return x[3] - 4.0; })
      .zero([](auto x) { return x[0] - 2.0; })
      .zero([](auto x) { return x[2] * x[2] + x[3] * x[3] - 2.0; })
      .to(all);
  Four(43, -44, {0, 0, 0, 0})
      .square([](auto x) { return x[0] - 2.5; })
      .square([](auto x) { return x[1] - 2.5; })
      .square([](auto x) { return x[2] - 5.25; }, 2)
      .square([](auto x) { return x[3] + 3.5; })
      .minus(79.875)
      .positive([](auto x) {
        return 8.0 - x[0] * x[0] - x[1] * x[1] - x[2] * x[2] - x[3] * x[3] - x[0] + x[1] - x[2] + x[3];
      })
      .positive(
          [](auto x) { return 10.0 - x[0] * x[0] - 2.0 * x[1] * x[1] - x[2] * x[2] - 2.0 * x[3] * x[3] + x[0] + x[3]; })
      .positive([](auto x) { return 5.0 - 2.0 * x[0] * x[0] - x[1] * x[1] - x[2] * x[2] - 2.0 * x[0] + x[1] + x[3]; })
      .to(all);
  Four(71, 17.0140173, {1, 5, 5, 1})
      .objective(0, [](auto x) { return x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]; })
      .positive([](auto x) { return x[0] * x[1] * x[2] * x[3] - 25.0; })
      .zero([](auto x) { return x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3] - 40.0; })
      .bound_all(1, 5)
      .to(all);
  Four(76, -4.681818181, {0.5, 0.5, 0.5, 0.5})
      .square([](auto x) { return x[2] + x[3] - 1.0; }, 0.5)
      .square([](auto x) { return x[0] - 0.5 * x[2] - 0.5; })
      .square([](auto x) { return x[2] + 3.0; }, 0.25)
      .square([](auto x) { return x[1] - 3.0; }, 0.5)
      .minus(7.5)
      .positive([](auto x) { return 5.0 - x[0] - 2.0 * x[1] - x[2] - x[3]; })
      .positive([](auto x) { return 4.0 - 3.0 * x[0] - x[1] - 2.0 * x[2] + x[3]; })
      .positive([](auto x) { return x[1] + 4.0 * x[2] - 1.5; })
      .bound_all(0, kUnbounded)
      .to(all);
}

void add_five_unknowns(std::vector<HockSchittkowski>& all) {
  using Five = HockSchittkowskiBuilder<5>;
  const auto sixth_power = [](Five& p) -> Five& {
    return p.square([](auto x) { return x[0] - x[1]; })
        .square([](auto x) { return x[2] - 1.0; })
        .square([](auto x) { return power(x[3] - 1.0, 2); })
        .square([](auto x) { return power(x[4] - 1.0, 3); });
  };
  Five p46(46, 0, {0.5 * sqrt(2.0), 1.75, 0.5, 2, 2});
  sixth_power(p46)
      .zero([](auto x) { return x[0] * x[0] * x[3] + sin(x[3] - x[4]) - 1.0; })
      .zero([](auto x) { return x[1] + power(x[2], 4) * x[3] * x[3] - 2.0; })
      .to(all);
  Five(48, 0, {3, 5, -3, 2, -2})
      .square([](auto x) { return x[0] - 1.0; })
      .square([](auto x) { return x[1] - x[2]; })
      .square([](auto x) { return x[3] - x[4]; })
      .zero([](auto x) { return x[0] + x[1] + x[2] + x[3] + x[4] - 5.0; })
      .zero([](auto x) { return x[2] - 2.0 * (x[3] + x[4]) + 3.0; })
      .to(all);
  Five p49(49, 0, {10, 7, 2, -3, 0.8});
  sixth_power(p49)
      .zero([](auto x) { return x[0] + x[1] + x[2] + 4.0 * x[3] - 7.0; })
      .zero([](auto x) { return x[2] + 5.0 * x[4] - 6.0; })
      .to(all);
  Five(50, 0, {35, -31, 11, 5, -5})
      .square([](auto x) { return x[0] - x[1]; })
      .square([](auto x) { return x[1] - x[2]; })
      .square([](auto x) { return power(x[2] - x[3], 2); })
      .square([](auto x) { return x[3] - x[4]; })
      .zero([](auto x) { return x[0] + 2.0 * x[1] + 3.0 * x[2] - 6.0; })
      .zero([](auto x) { return x[1] + 2.0 * x[2] + 3.0 * x[3] - 6.0; })
      .zero([](auto x) { return x[2] + 2.0 * x[3] + 3.0 * x[4] - 6.0; })
      .to(all);
  const auto with_linear_equalities = [&](int number, double minimum, double slope, double sum, bool bounded) {
    Five p(number, minimum, {2, 2, 2, 2, 2});
    if (number == 51) p = Five(number, minimum, {2.5, 0.5, 2, -1, 0.5});
    if (slope == 4) {
      p.square([](auto x) { return 4.0 * x[0] - x[1]; });
    } else {
      p.square([](auto x) { return x[0] - x[1]; });
    }
    p.square([](auto x) { return x[1] + x[2] - 2.0; })
        .square([](auto x) { return x[3] - 1.0; })
        .square([](auto x) { return x[4] - 1.0; })
        .zero([](auto x) { return x[2] + x[3] - 2.0 * x[4]; })
        .zero([](auto x) { return x[1] - x[4]; });
    if (sum == 4) {
      p.zero([](auto x) { return x[0] + 3.0 * x[1] - 4.0; });
    } else {
      p.zero([](auto x) { return x[0] + 3.0 * x[1]; });
    }
    if (bounded) p.bound_all(-10, 10);
    p.to(all);
  };
  with_linear_equalities(51, 0, 1, 4, false);
  with_linear_equalities(52, 1859.0 / 349, 4, 0, false);
  with_linear_equalities(53, 176.0 / 43, 1, 0, true);
  Five(77, 0.24150513, {2, 2, 2, 2, 2})
      .square([](auto x) { return x[0] - 1.0; })
      .square([](auto x) { return x[0] - x[1]; })
      .square([](auto x) { return x[2] - 1.0; })
      .square([](auto x) { return power(x[3] - 1.0, 2); })
      .square([](auto x) { return power(x[4] - 1.0, 3); })
      .zero([](auto x) { return x[0] * x[0] * x[3] + sin(x[3] - x[4]) - 2.0 * sqrt(2.0); })
      .zero([](auto x) { return x[1] + power(x[2], 4) * x[3] * x[3] - (8.0 + sqrt(2.0)); })
      .to(all);
  Five(78, -2.91970041, {-2, 1.5, 2, -1, -1})
      .objective(100, [](auto x) { return 100.0 + x[0] * x[1] * x[2] * x[3] * x[4]; })
      .zero([](auto x) { return x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3] + x[4] * x[4] - 10.0; })
      .zero([](auto x) { return x[1] * x[2] - 5.0 * x[3] * x[4]; })
      .zero([](auto x) { return power(x[0], 3) + power(x[1], 3) + 1.0; })
      .to(all);
  Five(79, 0.0787768209, {2, 2, 2, 2, 2})
      .square([](auto x) { return x[0] - 1.0; })
      .square([](auto x) { return x[0] - x[1]; })
      .square([](auto x) { return x[1] - x[2]; })
      .square([](auto x) { return power(x[2] - x[3], 2); })
      .square([](auto x) { return power(x[3] - x[4], 2); })
      .zero([](auto x) { return x[0] + x[1] * x[1] + power(x[2], 3) - (2.0 + 3.0 * sqrt(2.0)); })
      .zero([](auto x) { return x[1] - x[2] * x[2] + x[3] + (2.0 - 2.0 * sqrt(2.0)); })
      .zero([](auto x) { return x[0] * x[4] - 2.0; })
      .to(all);
}

void add_ten_unknowns(std::vector<HockSchittkowski>& all) {
  HockSchittkowskiBuilder<10>(113, 24.3062091, {2, 3, 5, 5, 1, 2, 7, 3, 6, 10})
      .square([](auto x) { return x[0] + x[1] - 10.0; }, 0.75)
      .square([](auto x) { return x[0] - x[1] + 2.0; }, 0.25)
      .square([](auto x) { return x[2] - 10.0; })
      .square([](auto x) { return x[3] - 5.0; }, 4)
      .square([](auto x) { return x[4] - 3.0; })
      .square([](auto x) { return x[5] - 1.0; }, 2)
      .square([](auto x) { return x[6]; }, 5)
      .square([](auto x) { return x[7] - 11.0; }, 7)
      .square([](auto x) { return x[8] - 10.0; }, 2)
      .square([](auto x) { return x[9] - 7.0; })
      .minus(31)
      .positive([](auto x) { return 105.0 - 4.0 * x[0] - 5.0 * x[1] + 3.0 * x[6] - 9.0 * x[7]; })
      .positive([](auto x) { return -10.0 * x[0] + 8.0 * x[1] + 17.0 * x[6] - 2.0 * x[7]; })
      .positive([](auto x) { return 8.0 * x[0] - 2.0 * x[1] - 5.0 * x[8] + 2.0 * x[9] + 12.0; })
      .positive([](auto x) {
        return -3.0 * power(x[0] - 2.0, 2) - 4.0 * power(x[1] - 3.0, 2) - 2.0 * x[2] * x[2] + 7.0 * x[3] + 120.0;
      })
      .positive([](auto x) { return -5.0 * x[0] * x[0] - 8.0 * x[1] - power(x[2] - 6.0, 2) + 2.0 * x[3] + 40.0; })
      .positive([](auto x) {
        return -0.5 * power(x[0] - 8.0, 2) - 2.0 * power(x[1] - 4.0, 2) - 3.0 * x[4] * x[4] + x[5] + 30.0;
      })
      .positive([](auto x) {
        return -x[0] * x[0] - 2.0 * power(x[1] - 2.0, 2) + 2.0 * x[0] * x[1] - 14.0 * x[4] + 6.0 * x[5];
      })
      .positive([](auto x) { return 3.0 * x[0] - 6.0 * x[1] - 12.0 * power(x[8] - 8.0, 2) + 7.0 * x[9]; })
      .to(all);
}

}  // namespace

std::vector<HockSchittkowski> hock_schittkowski() {
  std::vector<HockSchittkowski> all;
  add_two_unknowns(all);
  add_three_unknowns(all);
  add_four_unknowns(all);
  add_five_unknowns(all);
  add_ten_unknowns(all);
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
  return all;
}

}  // namespace tandem::testing

#pragma once

#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/lie/so2.hpp>
#include <tandem/problem/problem.hpp>

namespace tandem::detail {

/// A copy of the values of all variables of groups SO2, SE2, SO3, SE3, SE23 and Rn of 1, 2, 3 and 6.
class SavedValues {
 public:
  explicit SavedValues(const Problem& problem);

  /// Sets the values of a problem with the same or similar variables. If the numbers of variables of a group differ,
  /// variables correspond by name, and in their order among those of one name. Names of which the numbers differ are
  /// skipped.
  void copy_to(Problem& problem) const { set(problem, nullptr); }

  /// Moves the values of a problem as the values moved from `before` to these, which must be of one problem: sets x to
  /// x before⁻¹ after. Variables correspond as in copy_to().
  void move(const SavedValues& before, Problem& problem) const { set(problem, &before); }

 private:
  template <class G>
  struct ValuesOf {
    std::vector<G> values;
    std::vector<std::shared_ptr<const std::string>> names;

    void save(const Problem& problem);
    void set(Problem& problem, const ValuesOf* before) const;
  };
  template <class... Gs>
  using ValuesOfAll = std::tuple<ValuesOf<Gs>...>;

  void set(Problem& problem, const SavedValues* before) const;

  ValuesOfAll<SO2, SE2, SO3, SE3, SE23, Rn<1>, Rn<2>, Rn<3>, Rn<6>> values_;
};

/// Copies values between problems with the same or similar variables, as SavedValues does.
inline void copy_values(const Problem& from, Problem& to) { SavedValues(from).copy_to(to); }

}  // namespace tandem::detail

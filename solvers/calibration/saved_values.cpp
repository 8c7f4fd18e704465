#include <cstddef>
#include <map>
#include <string_view>
#include <utility>

#include <tandem/solvers/calibration/saved_values.hpp>

namespace tandem::detail {

template <class G>
void SavedValues::ValuesOf<G>::save(const Problem& problem) {
  for (const Variable<G>& variable : problem.variables<G>()) {
    values.push_back(problem.value(variable));
    names.push_back(variable.name);
  }
}

template <class G>
void SavedValues::ValuesOf<G>::copy_to(Problem& problem) const {
  const std::vector<Variable<G>> variables = problem.variables<G>();
  if (variables.size() != values.size()) return copy_by_name(variables, problem);
  for (std::size_t i = 0; i < values.size(); ++i) problem.set_value(variables[i], values[i]);
}

template <class G>
void SavedValues::ValuesOf<G>::copy_by_name(const std::vector<Variable<G>>& variables, Problem& problem) const {
  std::map<std::string_view, std::pair<std::vector<std::size_t>, std::vector<std::size_t>>> by_name;  // ours, theirs
  for (std::size_t i = 0; i < names.size(); ++i) by_name[*names[i]].first.push_back(i);
  for (std::size_t i = 0; i < variables.size(); ++i) by_name[*variables[i].name].second.push_back(i);
  for (const auto& [name, numbers] : by_name) {
    const auto& [ours, theirs] = numbers;
    for (std::size_t k = 0; ours.size() == theirs.size() && k < ours.size(); ++k)
      problem.set_value(variables[theirs[k]], values[ours[k]]);
  }
}

SavedValues::SavedValues(const Problem& problem) {
  std::apply([&](auto&... group) { (group.save(problem), ...); }, values_);
}

void SavedValues::copy_to(Problem& problem) const {
  std::apply([&](const auto&... group) { (group.copy_to(problem), ...); }, values_);
}

}  // namespace tandem::detail

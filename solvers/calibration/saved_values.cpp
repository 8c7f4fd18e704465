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
void SavedValues::ValuesOf<G>::set(Problem& problem, const ValuesOf* before) const {
  const std::vector<Variable<G>> variables = problem.variables<G>();
  const auto set_one = [&](std::size_t ours, const Variable<G>& x) {
    problem.set_value(x, before ? problem.value(x) * (before->values[ours].inverse() * values[ours]) : values[ours]);
  };
  if (variables.size() == values.size()) {
    for (std::size_t i = 0; i < values.size(); ++i) set_one(i, variables[i]);
    return;
  }
  std::map<std::string_view, std::pair<std::vector<std::size_t>, std::vector<std::size_t>>> by_name;  // ours, theirs
  for (std::size_t i = 0; i < names.size(); ++i) by_name[*names[i]].first.push_back(i);
  for (std::size_t i = 0; i < variables.size(); ++i) by_name[*variables[i].name].second.push_back(i);
  for (const auto& [name, numbers] : by_name) {
    const auto& [ours, theirs] = numbers;
    for (std::size_t k = 0; ours.size() == theirs.size() && k < ours.size(); ++k)
      set_one(ours[k], variables[theirs[k]]);
  }
}

SavedValues::SavedValues(const Problem& problem) {
  std::apply([&](auto&... group) { (group.save(problem), ...); }, values_);
}

void SavedValues::set(Problem& problem, const SavedValues* before) const {
  const auto set_group = [&]<class Values>(const Values& after) {
    after.set(problem, before ? &std::get<Values>(before->values_) : nullptr);
  };
  std::apply([&](const auto&... group) { (set_group(group), ...); }, values_);
}

}  // namespace tandem::detail

#include <cmath>
#include <vector>

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem {

void NlpEvaluator::row_magnitudes(const Eigen::VectorXd& jacobian, Eigen::VectorXd& magnitudes) const {
  check_unchanged();
  Eigen::VectorXd x(num_unknowns());
  std::vector<char> is_read(std::size_t(x.size()));
  for (const int column : jacobian_.column) is_read[std::size_t(column)] = true;
  for (const auto& [type, store] : problem_.stores_) {
    const std::unique_ptr<detail::StateStoreBase> difference = store->new_empty();  // from the identity
    difference->set_anchor(difference->add_identity(0, nullptr));
    const int dof = store->dof();
    std::vector<int> rotations, others;
    for (int i = 0; i < dof; ++i) (store->is_rotation(i) ? rotations : others).push_back(i);
    for (int slot = 0; slot < store->size(); ++slot) {
      const int id = store->id[std::size_t(slot)], offset = id < 0 ? -1 : offset_[std::size_t(id)];
      if (offset < 0 || !is_read[std::size_t(offset)]) continue;
      difference->copy_value(*store, slot, 0);
      difference->anchor_difference(0, x.data() + offset, nullptr);
      if (rotations.empty()) continue;
      double sum = 0;
      for (const int i : others) sum += x[offset + i] * x[offset + i];
      for (const int i : others) x[offset + i] = std::sqrt(sum);
      for (const int i : rotations) x[offset + i] = 1;
    }
  }
  magnitudes.setZero();
  for (std::size_t k = 0; k < jacobian_.row.size(); ++k)
    magnitudes[jacobian_.row[k]] += std::abs(jacobian[Eigen::Index(k)] * x[jacobian_.column[k]]);
}

}  // namespace tandem

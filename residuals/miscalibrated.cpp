#include <tandem/residuals/miscalibrated.hpp>

namespace tandem::detail {

template struct ParabolicMotion<SE3>;
template struct ParabolicMotion<SE2>;
template struct ParabolicMotion<R3>;
template struct ParabolicMotion<Rn<2>>;
template struct ApparentStates<SE3, SE3, SO3>;
template struct ApparentStates<SE3, R3, SO3>;
template struct ApparentStates<SE2, SE2, SO2>;
template struct ApparentStates<SE2, Rn<2>, SO2>;

}  // namespace tandem::detail

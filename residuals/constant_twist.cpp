#include <tandem/residuals/constant_twist.hpp>

namespace tandem::detail {

template struct FunctionsOf<ConstantTwist<SE3>>;
template struct FunctionsOf<ConstantTwist<SE2>>;

}  // namespace tandem::detail

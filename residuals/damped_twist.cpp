#include <tandem/residuals/damped_twist.hpp>

namespace tandem::detail {

template struct FunctionsOf<DampedTwist<SE3>>;

}  // namespace tandem::detail

#include <tandem/residuals/twist_components.hpp>

namespace tandem::detail {

template struct FunctionsOf<TwistComponents<SE3, sway | heave>>;

}  // namespace tandem::detail

#include <tandem/residuals/usbl_position.hpp>

namespace tandem::detail {

template struct FunctionsOf<UsblPosition<SE3, SE3>>;
template struct FunctionsOf<UsblPosition<SE3, R3>>;

}  // namespace tandem::detail

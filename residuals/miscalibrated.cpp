#include <tandem/residuals/miscalibrated.hpp>

namespace tandem::detail {

template struct MotionAbout<SE3>;
template struct MotionAbout<SE2>;
template struct MotionAbout<R3>;
template struct MotionAbout<Rn<2>>;
template struct Displaced<SE3, SE3, SO3>;
template struct Displaced<SE3, R3, SO3>;
template struct Displaced<SE2, SE2, SO2>;
template struct Displaced<SE2, Rn<2>, SO2>;

}  // namespace tandem::detail

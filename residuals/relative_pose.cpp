#include <tandem/residuals/relative_pose.hpp>

namespace tandem::detail {

template struct FunctionsOf<RelativePose<SE3>>;
template struct FunctionsOf<RelativePose<SE2>>;
template struct FunctionsOf<RelativePose<Rn<1>>>;
template struct FunctionsOf<RelativePose<Rn<3>>>;
template struct FunctionsOf<RelativePose<Rn<6>>>;

}  // namespace tandem::detail

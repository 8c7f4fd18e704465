#include <tandem/residuals/prior.hpp>

namespace tandem::detail {

template struct FunctionsOf<Prior<SE3>>;
template struct FunctionsOf<Prior<SE2>>;
template struct FunctionsOf<Prior<SO3>>;
template struct FunctionsOf<Prior<SO2>>;
template struct FunctionsOf<Prior<Rn<1>>>;
template struct FunctionsOf<Prior<Rn<2>>>;
template struct FunctionsOf<Prior<Rn<3>>>;
template struct FunctionsOf<Prior<Rn<6>>>;

}  // namespace tandem::detail

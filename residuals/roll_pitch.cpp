#include <tandem/residuals/roll_pitch.hpp>

namespace tandem::detail {

template struct FunctionsOf<RollPitch<SE3>>;

}  // namespace tandem::detail

#include <tandem/residuals/vehicle/vehicle_step.hpp>

namespace tandem {

template class VehicleStep<3>;
template class VehicleStep<8>;

}  // namespace tandem

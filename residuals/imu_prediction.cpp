#include <tandem/residuals/imu_prediction.hpp>

namespace tandem {

template ImuPrediction<double> predict(const SE3&, const R3&, const Rn<6>&, const ImuDelta&, const Earth&,
                                       ImuPredictionJacobians<double>*);

}  // namespace tandem
